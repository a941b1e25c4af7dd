"""
A thousand drives at once
=========================

One compiled call computes the converged peak-to-peak of every drive.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt

study = hdopt.load_study("csf-25-80")
rng = np.random.default_rng(0)
drives = study.errors.with_(
    axis_eccentricity=rng.rayleigh(0.005, 1000), axis_eccentricity_direction=rng.uniform(0, 2 * np.pi, 1000)
)
plt.hist(hdopt.peak_to_peak(study, drives), bins=40)
plt.xlabel("peak-to-peak, arcmin")
plt.ylabel("drives")
