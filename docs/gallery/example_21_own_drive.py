"""
A drive of your own
===================

A study from Python: a 100:1 drive with the proportions of the shipped one.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import hdopt

folder = Path(tempfile.mkdtemp())
made = hdopt.new_study(folder / "mine", "csf-25-80")
study = hdopt.load_study(made.file).with_(flexspline_teeth=200, circular_spline_teeth=202, module_mm=0.3168)
print(hdopt.check_study(study).to_frame()[["what", "can"]])
hdopt.kinematic_error(study).to_frame().set_index("symbol")["amplitude_arcmin"].plot.bar()
plt.ylabel("amplitude, arcmin")
plt.tight_layout()
