"""What a stack samples: a response over a matrix of inputs, checked for numbers that are none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, NoResult
from hdopt.words import counted


class Response(Protocol):
    """Inputs of shape (n, d) in, one number a row out, shape (n,)."""

    def __call__(self, inputs: Array) -> Array: ...


@runtime_checkable
class Bounded(Protocol):
    """A response that knows a bound which no point of a box exceeds."""

    def upper_bound(self, lower: Array, upper: Array) -> float | None:
        """The bound over the box between `lower` and `upper`, (d,) each; None where there is no proof."""


@runtime_checkable
class Signed(Protocol):
    """A response that is the size of a signed one, which is the straighter of both."""

    def signed(self, inputs: Array) -> Array:
        """The same as the response, with its sign: inputs (n, d) in, shape (n,) out."""


def proven_bound(response: Response, lower: Array, upper: Array) -> float | None:
    """What `response` proves of itself over the box between `lower` and `upper`, (d,) each; None where it does not."""
    return response.upper_bound(lower, upper) if isinstance(response, Bounded) else None


def evaluate(response: Response, inputs: Array, names: Sequence[str], where: str) -> Array:
    """`response(inputs)` for `inputs` (n, d), shape (n,).

    A value that is not finite is refused with the inputs that gave it (`HdoptError`): `names` (d,) are theirs, and
    `where` says in the message which sample it was.
    """
    values = np.asarray(response(inputs), float)
    if values.shape != (len(inputs),):
        raise HdoptError(
            f"the response gave shape {values.shape} for {counted(len(inputs), 'row')}; it must give one number a row"
        )
    if not np.isfinite(values.sum()):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            row = int(bad[0])
            sample = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, inputs[row], strict=True))
            raise NoResult(
                f"the response is {values[row]} for sample {row} of {where} ({len(bad)} such in this block): {sample}; "
                "narrow the inputs to where the response is defined"
            )
    return values
