"""
What a tighter tolerance brings
===============================

The yield over the largest wave-generator tilt, its distribution scaled with its bound.
"""

import matplotlib.pyplot as plt

import hdopt

study = hdopt.load_study("csf-25-80")
bounds = [0.05, 0.1, 0.15]
shares = []
for bound in bounds:
    row = {"distribution": "normal", "std": bound / 3, "lower": -bound, "upper": bound}
    changed = study.with_({"tolerances.wg_tilt_major_deg": row, "tolerances.wg_tilt_minor_deg": row})
    shares.append(hdopt.stack(changed, 2**12).stack.conforming.value)
plt.plot(bounds, shares, "o-")
plt.xlabel("largest tilt, deg")
plt.ylabel("yield")
