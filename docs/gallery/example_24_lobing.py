"""
An effect beside the base model
===============================

Six lobes of the circular spline, 8 um in radius: an effect of the study.
"""

import matplotlib.pyplot as plt

import hdopt

study = hdopt.load_study("csf-25-80")
lobed = study.with_(
    {"effects": {"circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 8.0, "phase_deg": 10.0}}}
)
for name, one in (("base model", study), ("with lobes", lobed)):
    orders = hdopt.kinematic_error(one).to_frame()
    plt.stem(orders["order"], orders["amplitude_arcmin"], label=name, linefmt="C0" if one is study else "C1")
plt.xlabel("order")
plt.ylabel("amplitude, arcmin")
plt.legend()
