"""The moment that files bear: now, or the one that SOURCE_DATE_EPOCH gives for builds that are to repeat."""

from __future__ import annotations

import datetime
import os


def moment() -> datetime.datetime:
    """The present, UTC, or the second of the environment's SOURCE_DATE_EPOCH where it holds a whole number."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if epoch.isdigit():
        return datetime.datetime.fromtimestamp(int(epoch), datetime.UTC)
    return datetime.datetime.now(datetime.UTC)
