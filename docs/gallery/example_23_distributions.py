"""
Distributions from Python
=========================

A stack of records: no study file, distributions as objects.
"""

import matplotlib.pyplot as plt

import hdopt
from hdopt.tolerance.distributions import Normal, Rayleigh

drive = hdopt.load_study("csf-25-80").drive
tolerances = {
    "axis_eccentricity_mm": Rayleigh(scale=0.003, upper=0.01),
    "axis_tilt_x_deg": Normal(std=0.03, lower=-0.1, upper=0.1),
}
problem = hdopt.ToleranceProblem.of_drive(drive, tolerances, limit=0.6)
quantiles = hdopt.stack(problem, 2**12).stack.quantiles
plt.plot(list(quantiles), [estimate.value for estimate in quantiles.values()], "o-")
plt.xlabel("share of drives")
plt.ylabel("peak-to-peak, arcmin")
