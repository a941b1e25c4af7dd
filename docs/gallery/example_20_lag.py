"""
Lag at reversal
===============

What backlash leaves after the error; below zero the flanks interfere.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.mechanics.lag import backlash_lag_arcmin

study = hdopt.load_study("csf-25-80")
theta = np.linspace(0, 2 * np.pi, 361)
error = kinematic_error_arcmin(study.drive, study.errors, theta)
plt.plot(np.degrees(theta), backlash_lag_arcmin(study.drive, error))
plt.axhline(0, color="k", lw=0.5)
plt.xlabel("input angle, deg")
plt.ylabel("lag, arcmin")
