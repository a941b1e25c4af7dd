"""
Three profiles
==============

Deflection over the angle on the profile: ellipse, Resal and two discs with the same greatest deflection.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt

study = hdopt.load_study("csf-25-80")
radius = study.drive.geometry.flexspline_inner_radius
phi = np.linspace(0, np.pi, 361)
for name in ("ellipse", "resal", "two_disk"):
    curve = study.with_(profile=name).drive.wave_generator.profile
    plt.plot(np.degrees(phi), curve.radius(phi) - radius, label=name)
plt.xlabel("angle from the major axis, deg")
plt.ylabel("deflection, mm")
plt.legend()
