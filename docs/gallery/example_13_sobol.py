"""
Which tolerances matter
=======================

Total indices count what an input does together with others.
"""

import matplotlib.pyplot as plt

import hdopt

indices = hdopt.sobol("csf-25-80", 2**9, second_order=False).to_frame()
indices = indices[indices["kind"] == "input"]
plt.barh(indices.index, indices["ST"], xerr=(indices["ST high"] - indices["ST low"]) / 2)
plt.xlabel("total index")
plt.tight_layout()
