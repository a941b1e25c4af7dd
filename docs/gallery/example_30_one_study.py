"""
One study, from the drive to the drawing
========================================

All of it in one notebook: a drive's error, sweeps, the stack of its tolerances, what they should be, a design search,
a recording and its diagnosis, and the files for the shop. Every cell runs as it stands; nothing has to be a file before
the end. Sizes are small, so that the whole takes half a minute.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hdopt

study = hdopt.load_study("csf-25-80")
hdopt.check_study(study)

# %%
# One drive
# ---------
#
# Records go in, frozen results come out. Each has ``to_frame()``, ``plot()`` and ``to_dict()``.

result = hdopt.kinematic_error(study.drive, study.errors)
print(f"{result.peak_to_peak_arcmin:.3f} arcmin peak to peak")
result.to_frame()

# %%

result.plot(backend="matplotlib")

# %%
# The waveform of one relative turn of the teeth, here over its first input turn: angles in rad, the error in arcmin.

first = result.theta < 2 * np.pi
figure, axes = plt.subplots()
axes.plot(np.degrees(result.theta[first]), result.waveform_arcmin[first])
axes.set(xlabel="input angle, deg", ylabel="kinematic error, arcmin")

# %%
# Sweeps
# ------
#
# Arrays of errors in, an array out: some microseconds a drive, and no file is read again.

sizes = np.linspace(0, 0.02, 101)
swept = hdopt.peak_to_peak(study, study.errors.with_(wg_eccentricity=sizes))
figure, axes = plt.subplots()
axes.plot(1000 * sizes, swept)
axes.set(xlabel="wave generator's eccentricity, um", ylabel="peak-to-peak, arcmin")

# %%
# ``study.with_(...)`` is the study with another value, checked like a file.

structures = ("integral", "automatic", "one_way_major", "one_way_minor")
{name: round(float(hdopt.peak_to_peak(study.with_(structure=name), study.errors)), 3) for name in structures}

# %%
# Many drives
# -----------

stack = hdopt.stack(study, 2**12)
share = stack.stack.conforming
print(f"{100 * share.low:.2f} to {100 * share.high:.2f} % of drives are within the limit")
stack.plot(backend="matplotlib")

# %%
# Which tolerances matter, and what each should be at the least cost.

hdopt.sobol(study, 2**8, second_order=False).to_frame()

# %%

priced = hdopt.load_study("csf-25-80-tolerances").with_(verify_n=2**14)
hdopt.allocate(priced, "rss", compare=False, curve=()).to_frame()

# %%
# Which design
# ------------
#
# ``csf-25-80-design-trade`` is the whole trade; this is one variable of it.

trade = hdopt.load_study("csf-25-80-design-trade").with_(
    profiles=["ellipse"],
    structures=["integral", "automatic"],
    objective="peak_to_peak_arcmin",
    robust=False,
    variables={"width_mm": {"lower": 5.0, "upper": 14.0}},
)
found = hdopt.search(trade, fronts=False)
found.to_frame()

# %%
# A recording
# -----------
#
# A table will do where there is no file. The input's encoder is off-centre here: one wave a turn, which is none of the
# drive's errors.

turns, samples = 20, 60
theta = np.arange(turns * samples) * (2 * np.pi / samples)
made = hdopt.kinematic_error(study.with_(structure="automatic"))
noise = np.random.default_rng(1).normal(0, 0.02, theta.size)
error = np.interp(theta, made.theta, made.waveform_arcmin) + 0.4 * np.cos(theta + 0.3) + noise
table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / 80 + error / 60})
recording = hdopt.recording_from_table(table, ratio=80)
hdopt.inspect(recording, study, "peak_to_peak=1.0arcmin").to_frame()

# %%

diagnosis = hdopt.diagnose(recording, study.with_(structure="automatic"))
for effect in diagnosis.effects:
    print(f"{effect.says} Confidence {effect.confidence:.2f}.")
diagnosis.to_frame()

# %%
# For the shop, and for a spreadsheet
# -----------------------------------

drawn = hdopt.export(study, {"dxf": "wave-generator.dxf"})
hdopt.write_tables(drawn, "inspection-plan.xlsx")
hdopt.write_tables(stack, "stack.xlsx")
drawn.to_frame()
