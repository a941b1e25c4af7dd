"""
A stack that is no drive
========================

Chase's shaft and housing: least-cost tolerances of a linear stack.
"""

import matplotlib.pyplot as plt

import hdopt

table = hdopt.allocate("chase-shaft-housing", "rss", compare=False).to_frame()
table[["present tolerance", "tolerance"]].plot.barh()
plt.xlabel("tolerance, in")
plt.tight_layout()
