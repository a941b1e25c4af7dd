"""The names of array types that signatures use: what an array holds, in one word."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Numbers in double precision."""

Singles: TypeAlias = NDArray[np.float32]
"""Numbers in single precision, as compiled lanes work on them."""

Index: TypeAlias = NDArray[np.int64]
"""Whole numbers: counts and places in other arrays."""

Mask: TypeAlias = NDArray[np.bool_]
"""True or false for each element, such as which rows count."""

Bits: TypeAlias = NDArray[np.uint32]
"""Numbers whose binary digits count, such as those of Sobol' points."""
