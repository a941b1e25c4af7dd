"""
Standard grades
===============

IT grades of ISO 286 over the nominal size.
"""

import matplotlib.pyplot as plt

from hdopt.allocation.grades import it_grade

sizes = [5, 15, 25, 40, 65, 100, 150]
for grade in ("IT5", "IT6", "IT7"):
    plt.plot(sizes, [1000 * it_grade(grade, size).tolerance for size in sizes], "o-", label=grade)
plt.xlabel("nominal size, mm")
plt.ylabel("tolerance, um")
plt.legend()
