"""
Records instead of a study
==========================

Drive and errors are frozen records; nothing has to be a file.
"""

import matplotlib.pyplot as plt

import hdopt

drive = hdopt.load_study("csf-25-80").drive
sizes = [0.0, 0.005, 0.01, 0.02]
values = [hdopt.kinematic_error(drive, hdopt.DriveErrors(axis_eccentricity=size)).peak_to_peak_arcmin for size in sizes]
plt.plot([1000 * size for size in sizes], values, "o-")
plt.xlabel("eccentricity of the input axis, um")
plt.ylabel("peak-to-peak, arcmin")
