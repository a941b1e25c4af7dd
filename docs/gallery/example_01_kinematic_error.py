"""
Kinematic error over one input turn
===================================

The error of the shipped CSF-25-80 with the paper's base case of errors.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt
from hdopt.kinematics.waveform import kinematic_error_arcmin

study = hdopt.load_study("csf-25-80")
theta = np.linspace(0, 2 * np.pi, 721)
plt.plot(np.degrees(theta), kinematic_error_arcmin(study.drive, study.errors, theta))
plt.xlabel("input angle, deg")
plt.ylabel("kinematic error, arcmin")
