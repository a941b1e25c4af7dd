"""
An acceptance sheet
===================

A simulated recording of four turns, as ``hdopt inspect`` reads one from a file.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hdopt
from hdopt.kinematics.waveform import kinematic_error_arcmin

study = hdopt.load_study("csf-25-80")
theta = np.arange(4 * 200) * 2 * np.pi / 200
error = kinematic_error_arcmin(study.drive, study.errors, theta)
table = pd.DataFrame({"time_s": 0.01 * np.arange(len(theta)), "input_angle_deg": np.degrees(theta)})
table["output_angle_deg"] = np.degrees(theta) / 80 - error / 60
sheet = hdopt.inspect(hdopt.recording_from_table(table, 80.0), study, {"peak_to_peak": 1.0})
print(sheet.to_frame().head(6))
plt.plot(np.degrees(theta), error)
plt.xlabel("input angle, deg")
plt.ylabel("error, arcmin")
