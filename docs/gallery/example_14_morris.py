"""
Screening by Morris
===================

SALib's elementary effects, over the percentiles of the inputs.
"""

import matplotlib.pyplot as plt

import hdopt

screened = hdopt.screen("csf-25-80", "morris", 256).to_frame()
plt.barh(screened.index, screened["mu_star"])
plt.xlabel("mean absolute elementary effect")
plt.tight_layout()
