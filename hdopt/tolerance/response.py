"""What a stack samples: a response over a matrix of inputs, checked for numbers that are none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError


class Response(Protocol):
    """Inputs of shape (n, d) in, one number a row out, shape (n,)."""

    def __call__(self, inputs: Array) -> Array: ...


def evaluate(response: Response, inputs: Array, names: Sequence[str], where: str) -> Array:
    """`response(inputs)`; a value that is not finite is refused with the inputs that gave it."""
    values = np.asarray(response(inputs), float)
    if values.shape != (len(inputs),):
        raise HdoptError(
            f"the response gave shape {values.shape} for {len(inputs)} rows; it must give one number a row"
        )
    if not np.isfinite(values.sum()):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            row = int(bad[0])
            sample = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, inputs[row], strict=True))
            raise HdoptError(
                f"the response is {values[row]} for sample {row} of {where} ({len(bad)} such in this block): {sample}; "
                "narrow the inputs to where the response is defined"
            )
    return values
