"""
The beat as a carpet
====================

A row an input turn: straight stripes belong to the wave generator and the circular spline, slanted ones to the
flexspline.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt
from hdopt.kinematics.waveform import kinematic_error_arcmin

study = hdopt.load_study("csf-25-80")
theta = np.arange(80 * 90) * 2 * np.pi / 90
error = kinematic_error_arcmin(study.drive, study.errors, theta).reshape(80, 90)
plt.imshow(error, aspect="auto", extent=(0, 360, 80, 0), cmap="RdBu_r")
plt.xlabel("input angle, deg")
plt.ylabel("input turn")
plt.colorbar(label="arcmin")
