"""
What tolerances cost
====================

Reciprocal and exponential cost of a tolerance.
"""

import matplotlib.pyplot as plt
import numpy as np

from hdopt.allocation.cost import Exponential, Reciprocal

t = np.linspace(0.002, 0.02, 100)
for cost in (Reciprocal(0.2, 0.005), Exponential(3.0, 0.005, 0.1)):
    plt.plot(t, cost.cost(t), label=type(cost).__name__)
plt.xlabel("tolerance, mm")
plt.ylabel("cost")
plt.legend()
