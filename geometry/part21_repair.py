"""Where Open CASCADE's text of a STEP file departs from ISO 10303, put right after it was written.

Its own reader forgives all of it, so that only a reader of the text notices: `hdopt.geometry.pmi_practice` does.
"""

from __future__ import annotations

import re

_UNTYPED = re.compile(r"(#\d+ = )MEASURE_WITH_UNIT\(([-+.\dEe]+),")
_RUNOUT = re.compile(r"#\d+ = RUNOUT_ZONE_DEFINITION\(#\d+,\(\)\);\n#\d+ = RUNOUT_ZONE_ORIENTATION\(#(\d+)\);\n")


def repaired(text: str) -> str:
    """The `text` of a STEP file with lengths that have their type, and without the zones of run-outs.

    Limits are written as MEASURE_WITH_UNIT(0.011,...), whose value has no type and which no schema allows; and every
    cylindrical zone gets a run-out's definition, with an empty set, and an angle.
    """
    text = _UNTYPED.sub(r"\1LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(\2),", text)
    for angle in _RUNOUT.findall(text):
        text = re.sub(rf"#{angle} = [^;]*;\n", "", text, count=1)
    return _RUNOUT.sub("", text)
