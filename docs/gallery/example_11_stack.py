"""
Will the drives meet the limit?
===============================

Yield, ppm and quantiles of the shipped tolerances, with intervals.
"""

import matplotlib.pyplot as plt

import hdopt

result = hdopt.stack("csf-25-80", 2**13)
print(result.to_frame()[["value", "low", "high"]])
quantiles = result.stack.quantiles
plt.plot([estimate.value for estimate in quantiles.values()], list(quantiles), "o-")
plt.axvline(result.stack.limit, color="k", ls="--")
plt.xlabel("peak-to-peak, arcmin")
plt.ylabel("share of drives below")
