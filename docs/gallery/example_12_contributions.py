"""
What makes the spread
=====================

Shares of the variance, linearised at the mean magnitudes.
"""

import matplotlib.pyplot as plt

import hdopt

shares = hdopt.stack("csf-25-80", 2**12).tables()["contributions"].set_index("input")["share of the variance"]
shares[shares > 0.001].sort_values().plot.barh()
plt.xlabel("share of the variance")
plt.tight_layout()
