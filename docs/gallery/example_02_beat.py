"""
The beat over 80 input turns
============================

Flexspline and circular spline teeth meet anew only after 80 input turns, so one turn shows little more than half.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt
from hdopt.kinematics.waveform import kinematic_error_arcmin

study = hdopt.load_study("csf-25-80")
theta = np.arange(80 * 90) * 2 * np.pi / 90
plt.plot(theta / (2 * np.pi), kinematic_error_arcmin(study.drive, study.errors, theta), lw=0.4)
plt.xlabel("input turns")
plt.ylabel("kinematic error, arcmin")
