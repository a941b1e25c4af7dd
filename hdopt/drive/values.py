"""What values a drive may have: the error that names an impossible one, and the checks that raise it."""

from __future__ import annotations

import math

from hdopt.errors import HdoptError


class DriveError(HdoptError):
    """A value that no drive can have. The message says what came, what is allowed and what to do."""


def require(condition: bool, message: str) -> None:
    """Raise `DriveError` with `message` unless `condition` holds."""
    if not condition:
        raise DriveError(message)


def require_positive(**values: float) -> None:
    """Raise `DriveError` naming the first of `values` that is not finite and above zero."""
    for name, value in values.items():
        require(
            isinstance(value, int | float) and math.isfinite(value) and value > 0,
            f"{name} is {value!r}; it must be a finite number above 0",
        )


def require_positive_if_given(**values: float | None) -> None:
    """`require_positive` for those of `values` that are not None."""
    require_positive(**{name: value for name, value in values.items() if value is not None})


def require_not_negative(what: str, **values: float | None) -> None:
    """Raise `DriveError` naming the first of `values` that is not finite and 0 or above; None was not given.

    `what` begins the sentence that says what is allowed, such as "a clearance".
    """
    for name, value in values.items():
        require(
            value is None or (math.isfinite(value) and value >= 0),
            f"{name} is {value!r}; {what} must be a finite number, 0 or above",
        )
