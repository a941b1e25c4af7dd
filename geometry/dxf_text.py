"""The text of a DXF file: its date is that of the other files, and the same drawing always gets the same bytes."""

from __future__ import annotations

import io
import re
import uuid
from typing import TYPE_CHECKING

from hdopt.moment import moment

if TYPE_CHECKING:
    from ezdxf.document import Drawing

NAMESPACE = uuid.UUID("6ba7b812-9dad-11d1-80b4-00c04fd430c8")
"""For names of objects (RFC 9562, appendix C)."""


def text_of(document: Drawing, identity: str) -> str:
    """The text of a DXF `document`: dated by `moment`, its two identifiers made from `identity`, which names what is
    drawn. Its writer would take the clock and random numbers."""
    from ezdxf.tools.juliandate import juliandate

    stream = io.StringIO()
    document.write(stream)
    written = moment()
    day, own = repr(juliandate(written.replace(tzinfo=None))), f"{{{str(uuid.uuid5(NAMESPACE, identity)).upper()}}}"
    text = re.sub(r"(?<=\$TDCREATE\n 40\n|\$TDUPDATE\n 40\n).*", day, stream.getvalue())
    text = re.sub(r"(?<=\$FINGERPRINTGUID\n  2\n).*|(?<=\$VERSIONGUID\n  2\n).*", own, text)
    # Which library wrote the file, and when to the microsecond.
    return re.sub(r"(?<= @ )\d{4}-\d\d-\d\dT[\d:.+]+", written.isoformat(), text)
