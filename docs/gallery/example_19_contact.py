"""
Contact angle and k_e
=====================

Deeper engagement brings more teeth into mesh, which even the error out.
"""

import matplotlib.pyplot as plt

import hdopt

names = ["ellipse", "resal", "two_disk"]
study = hdopt.load_study("csf-25-80")
found = [hdopt.profile(study.with_(profile=name)) for name in names]
plt.bar(names, [one.contact_angle_deg for one in found])
for place, one in enumerate(found):
    plt.text(place, 20, f"k_e = {one.homogenization_coefficient:.3f}", ha="center", color="w")
plt.ylabel("contact angle, deg")
