"""
Width of the wave generator
===========================

Tilt acts through the distance between the two rims.
"""

import matplotlib.pyplot as plt

import hdopt

study = hdopt.load_study("csf-25-80")
widths = [5.0, 7.0, 9.0, 11.0]
values = [hdopt.kinematic_error(study.with_(width_mm=width)).peak_to_peak_arcmin for width in widths]
plt.plot(widths, values, "o-")
plt.xlabel("width, mm")
plt.ylabel("peak-to-peak, arcmin")
