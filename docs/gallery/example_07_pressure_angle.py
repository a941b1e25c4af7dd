"""
Pressure angle
==============

A radial depth becomes rotation through tan of the pressure angle.
"""

import matplotlib.pyplot as plt

import hdopt

study = hdopt.load_study("csf-25-80")
angles = [8, 10, 12, 14, 16, 20]
values = [hdopt.kinematic_error(study.with_(pressure_angle_deg=float(a))).peak_to_peak_arcmin for a in angles]
plt.plot(angles, values, "o-")
plt.xlabel("pressure angle, deg")
plt.ylabel("peak-to-peak, arcmin")
