"""
The cam for the shop
====================

Key dimensions and inspection plan of the wave generator, with what was assumed.
"""

import matplotlib.pyplot as plt
import numpy as np

import hdopt

result = hdopt.export("csf-25-80", {})
print(result.to_frame()[["part", "feature", "nominal_mm", "instrument"]].head())
cam = hdopt.load_study("csf-25-80").drive.wave_generator.profile
phi = np.linspace(0, 2 * np.pi, 721)
plt.plot(cam.radius(phi) * np.sin(phi), cam.radius(phi) * np.cos(phi))
plt.axis("equal")
plt.xlabel("x, mm")
plt.ylabel("y, mm")
