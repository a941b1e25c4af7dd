"""The moment that files bear: now, or the one that SOURCE_DATE_EPOCH gives for builds that are to repeat."""

from __future__ import annotations

import datetime
import os

from hdopt.errors import HdoptError


def moment() -> datetime.datetime:
    """The present, UTC, or the second of the environment's SOURCE_DATE_EPOCH where it is set.

    `HdoptError` where that is no whole number of seconds since 1970, or one past the year 9999.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch:
        return datetime.datetime.now(datetime.UTC)
    try:
        if not (epoch.isascii() and epoch.isdigit()):
            raise ValueError
        return datetime.datetime.fromtimestamp(int(epoch), datetime.UTC)
    except (ValueError, OverflowError, OSError):
        raise HdoptError(
            f"the environment's SOURCE_DATE_EPOCH is {epoch[:40]!r}; it holds whole seconds since the start of 1970, "
            "up to the year 9999: correct it, or unset it for the present"
        ) from None
