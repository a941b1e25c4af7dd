"""
Orders and where they come from
===============================

The amplitudes at whole orders and their sidebands; 1/N is the beat.
"""

import matplotlib.pyplot as plt

import hdopt

orders = hdopt.kinematic_error("csf-25-80").to_frame()
plt.barh(orders["symbol"], orders["amplitude_arcmin"])
plt.gca().invert_yaxis()
plt.xlabel("amplitude, arcmin")
plt.tight_layout()
