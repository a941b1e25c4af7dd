"""
Four structures of the wave generator
=====================================

Alignment takes eccentricity and tilt out of the error.
"""

import matplotlib.pyplot as plt

import hdopt

study = hdopt.load_study("csf-25-80")
names = ["integral", "one_way_major", "one_way_minor", "automatic"]
values = [hdopt.kinematic_error(study.with_(structure=name)).peak_to_peak_arcmin for name in names]
plt.bar(names, values)
plt.ylabel("peak-to-peak, arcmin")
