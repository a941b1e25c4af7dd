"""
What a profile asks of the ring
===============================

Change of curvature along the flexspline's neutral line.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt
from hdopt.mechanics.bending import curvature_change

study = hdopt.load_study("csf-25-80")
phi = np.linspace(0, np.pi, 361)
for name in ("ellipse", "resal", "two_disk"):
    drive = study.with_(profile=name).drive
    change = curvature_change(drive.geometry, drive.wave_generator.profile, phi)
    plt.plot(np.degrees(phi), change, label=name)
plt.xlabel("angle from the major axis, deg")
plt.ylabel("change of curvature, 1/mm")
plt.legend()
