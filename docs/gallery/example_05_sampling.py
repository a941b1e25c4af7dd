"""
Why a grid of 10 deg reads low
==============================

Published peak-to-peak values were taken on a grid; the converged value needs no grid.
"""

import matplotlib.pyplot as plt

import hdopt

grids = [10, 5, 2, 1]
found = [hdopt.kinematic_error("csf-25-80", sampling_deg=grid, turns=80) for grid in grids]
plt.plot(grids, [one.sampled_peak_to_peak_arcmin for one in found], "o-", label="on the grid")
plt.axhline(found[0].peak_to_peak_arcmin, color="k", ls="--", label="converged")
plt.xlabel("grid, deg")
plt.ylabel("peak-to-peak, arcmin")
plt.legend()
