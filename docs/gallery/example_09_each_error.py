"""
Each error alone
================

What is left of the error when all others are zero: they do not add up.
"""

import matplotlib.pyplot as plt

import hdopt
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin

study = hdopt.load_study("csf-25-80")
errors = {name: value for name, value in study.errors.by_name().items() if not name.endswith(("direction", "phase"))}
alone = {
    name: converged_peak_to_peak_arcmin(study.drive, study.errors.with_(**{**dict.fromkeys(errors, 0.0), name: value}))
    for name, value in errors.items()
}
plt.barh(list(alone), list(alone.values()))
plt.xlabel("peak-to-peak alone, arcmin")
plt.tight_layout()
