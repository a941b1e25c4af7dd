"""A compensation as a file for a controller: CSV, JSON, or C with constant tables and one function."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any  # Any: values of JSON

from hdopt.compensation.applied import crosses, crossing_deg, how_applied
from hdopt.compensation.mesh import Beat
from hdopt.compensation.of_speed import Angular, OfSpeed
from hdopt.compensation.pulse import Pulse
from hdopt.compensation.surface import Crossing, Grid, Harmonics, Surface
from hdopt.compensation.zones import Zones

Found = Angular | OfSpeed

FORMATS = ("csv", "json", "c")


def written(found: Found, form: str, facts: Mapping[str, Any]) -> str:
    """The text of `found` in a `form` of `FORMATS`; `facts` (plain values) say what it is and what it needs."""
    return {"csv": _csv, "json": _json, "c": _c}[form](found, facts)


def _csv(given: Found, facts: Mapping[str, Any]) -> str:
    found, own = (given.common, _own(given)) if isinstance(given, OfSpeed) else (given, [])
    said = {**how_applied(given), **facts}
    head = [f"# {key}: {str(value).replace(chr(10), ' ')}" for key, value in said.items()]
    head.append(f"# half_return_arcmin: {found.back!r}")
    head.append(f"# return_crossing_output_deg: {found.crossing.deg!r}")
    head.append(f"# return_crosses: {crosses(found.crossing)}")
    head.append(f"# return_path_at_start: {found.crossing.start!r}")
    if isinstance(given, OfSpeed):
        head.append(f"# lag_arcmin_per_input_rpm: {given.lag!r}")
        head.append(f"# speeds_input_rpm: {' '.join(map(repr, given.speeds))}")
        if own:
            head.append(f"# of_each_speed: {BETWEEN}")
    if not isinstance(found, Grid):
        if isinstance(found, Zones):
            head += [f"# pulses: {PULSES}"] * bool(found.pulses)
            head += [f"# pulse: {','.join(map(repr, _pulse(pulse)))}" for pulse in found.pulses]
        return "\n".join([*head, *_csv_terms(found, own)]) + "\n"
    head += [f"# of_speed: {rpm!r},{k},{j},{c!r},{s!r}" for rpm, k, j, c, s in own]
    inputs, outputs = found.values.shape
    if isinstance(found, Beat):
        head.append("# columns: the input turns of a turn of the output, each by the output angle at which it begins")
    rows = ["input_deg\\output_deg," + ",".join(f"{360 * j / outputs:g}" for j in range(outputs))]
    rows += [
        f"{360 * i / inputs:g}," + ",".join(f"{value:.8f}" for value in row)
        for i, row in enumerate(found.values.tolist())
    ]
    return "\n".join([*head, *rows]) + "\n"


PULSE = ("sum", "j", "centre_rad", "cos_rad", "sin_rad", "half_width_rad", "height_arcmin")
PULSES = (
    "sum, j, centre, cos, sin, half_width (rad), height (arcmin): to that sum add height (1 - |d|/half_width) where "
    "|d| < half_width, d = input + j output - centre - cos cos(output) - sin sin(output), less whole turns"
)


def _pulse(pulse: Pulse) -> tuple[int, int, float, float, float, float, float]:
    """The values of `PULSE`."""
    return (pulse.zone + 1, pulse.j, pulse.centre, pulse.cos, pulse.sin, pulse.half_width, pulse.height)


BETWEEN = (
    "each term counts in full at its speed_input_rpm (negative backward) and falls in a straight line to the "
    "neighbouring speeds; beyond the first and the last it stays"
)


def _own(found: OfSpeed) -> list[tuple[float, int, int, float, float]]:
    """Speed (r/min), k, j, cosine and sine of every term that a speed has of its own."""
    return [(rpm, *term[:4]) for rpm, one in zip(found.speeds, found.own, strict=True) for term in _terms(one)]


def _csv_terms(found: Harmonics | Zones, own: Sequence[tuple[float, int, int, float, float]]) -> list[str]:
    """Title and lines of the terms of `found`, with those of each speed's `own` in a last column, if any."""
    summed = isinstance(found, Zones)
    title = "k_input,j_output,cos_arcmin,sin_arcmin" + ",sum" * summed + ",speed_input_rpm" * bool(own)
    rows = [f"{k},{j},{c!r},{s!r}" + f",{n}" * summed + "," * bool(own) for k, j, c, s, n in _terms(found)]
    return [title, *rows, *(f"{k},{j},{c!r},{s!r}" + ",0" * summed + f",{rpm!r}" for rpm, k, j, c, s in own)]


def _terms(found: Harmonics | Zones) -> list[tuple[int, int, float, float, int]]:
    """k, j, cosine, sine of every term, and the sum that it belongs to: 0, or 1 and 2 for the zones."""
    sums = (found.rest, found.first, found.second) if isinstance(found, Zones) else (found,)
    return [
        (*term, number)
        for number, part in enumerate(sums)
        for term in zip(part.k.tolist(), part.j.tolist(), part.cos.tolist(), part.sin.tolist(), strict=True)
    ]


def _json(given: Found, facts: Mapping[str, Any]) -> str:
    found = given.common if isinstance(given, OfSpeed) else given
    content: dict[str, Any] = {"schema": 1, **how_applied(given), **facts}
    content["half_return_arcmin"] = found.back
    if isinstance(given, OfSpeed):
        content["lag_arcmin_per_input_rpm"] = given.lag
        content["of_each_speed"] = BETWEEN
        content["speeds"] = [
            {"speed_input_rpm": rpm, "terms": [dict(zip(TERM, term, strict=False)) for term in _terms(one)]}
            for rpm, one in zip(given.speeds, given.own, strict=True)
        ]
    content["return_crossing_output_deg"] = found.crossing.deg
    content["return_crosses"] = crosses(found.crossing)
    content["return_path_at_start"] = found.crossing.start
    if isinstance(found, Grid):
        content["table"] = "input angle by output angle" if isinstance(found, Surface) else "input angle by input turn"
        content["input_step_deg"], content["output_step_deg"] = (360 / steps for steps in found.values.shape)
        content["table_arcmin"] = found.values.tolist()
        return json.dumps(content, indent=1, allow_nan=False) + "\n"
    if isinstance(found, Zones):
        if found.pulses:
            content["pulses_say"] = PULSES
            content["pulses"] = [dict(zip(PULSE, _pulse(pulse), strict=True)) for pulse in found.pulses]
    names = (*TERM, "sum") if isinstance(found, Zones) else TERM
    content["terms"] = [dict(zip(names, term, strict=False)) for term in _terms(found)]
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


TERM = ("k", "j", "cos_arcmin", "sin_arcmin")
FUNCTION = "hdopt_error_arcmin"

_HEAD = """/* Kinematic error of a drive, to be subtracted: output = input/N - error.
{facts}
   input_rad from the zero of the recording's input count, output_rad = input_rad/N counted on;
   path: the side of the return error, +1 forward, -1 backward, 0 unknown; keep it, and after each move call
   path = hdopt_path(path, output_moved_rad), which crosses {crosses} after a reversal{over}.
   The recordings began with a path of {start!r} times the side of their first motion. */
#include <math.h>

double hdopt_path(double path, double output_moved_rad)
{{
    if (output_moved_rad == 0)
        return path;
    double side = output_moved_rad > 0 ? 1 : -1;
    {moves}
}}
"""

_C_TERMS = """
#define HDOPT_TERMS {count}
static const int hdopt_k[] = {{{k}}};
static const int hdopt_j[] = {{{j}}};
static const double hdopt_cos[] = {{{cos}}};
static const double hdopt_sin[] = {{{sin}}};
static const int hdopt_sum[] = {{{sum}}};

double hdopt_error_arcmin(double input_rad, double output_rad, double path)
{{
    double error[] = {{path * ({back}), 0, 0}};
    for (int i = 0; i < HDOPT_TERMS; i++) {{
        double phase = hdopt_k[i] * input_rad + hdopt_j[i] * output_rad;
        error[hdopt_sum[i]] += hdopt_cos[i] * cos(phase) + hdopt_sin[i] * sin(phase);
    }}{pulses}
    return error[0] + {larger}(error[1], error[2]);
}}
"""

_C_PULSES = """
    /* A damaged tooth: {says} */
    static const double pulse[][7] = {{
        {rows}
    }};
    for (int i = 0; i < {count}; i++) {{
        double d = input_rad + pulse[i][1] * output_rad - pulse[i][2];
        d -= pulse[i][3] * cos(output_rad) + pulse[i][4] * sin(output_rad);
        d = fabs(remainder(d, 6.283185307179586476925));
        if (d < pulse[i][5])
            error[(int)pulse[i][0]] += pulse[i][6] * (1 - d / pulse[i][5]);
    }}"""

_C_TABLE = """
#define HDOPT_INPUTS {inputs}
#define HDOPT_OUTPUTS {outputs}
static const double hdopt_table[HDOPT_INPUTS][HDOPT_OUTPUTS] = {{
{rows}
}};

double hdopt_error_arcmin(double input_rad, double output_rad, double path)
{{
    const double turn = 6.283185307179586476925;
    double x = input_rad / turn, y = output_rad / turn;
    x = (x - floor(x)) * HDOPT_INPUTS;
    y = (y - floor(y)) * HDOPT_OUTPUTS;
    int i = (int)floor(x), j = (int)floor(y);
    double p = x - i, q = y - j;
    int i0 = i % HDOPT_INPUTS, i1 = (i + 1) % HDOPT_INPUTS, j0 = j % HDOPT_OUTPUTS, j1 = (j + 1) % HDOPT_OUTPUTS;
    double low = hdopt_table[i0][j0] * (1 - p) + hdopt_table[i1][j0] * p;
    double high = hdopt_table[i0][j1] * (1 - p) + hdopt_table[i1][j1] * p;
    return low * (1 - q) + high * q + path * ({back});
}}
"""

_C_BEAT = """
#define HDOPT_INPUTS {inputs}
#define HDOPT_TURNS {outputs}
static const double hdopt_table[HDOPT_INPUTS][HDOPT_TURNS] = {{
{rows}
}};

double hdopt_error_arcmin(double input_rad, double output_rad, double path)
{{
    const double turn = 6.283185307179586476925;
    double x = input_rad / turn, y;
    x -= floor(x);
    y = floor(output_rad / turn * HDOPT_TURNS - x + 0.5);
    int n = (int)(y - HDOPT_TURNS * floor(y / HDOPT_TURNS));
    int i = (int)floor(x * HDOPT_INPUTS);
    double p = x * HDOPT_INPUTS - i;
    n = (n + i / HDOPT_INPUTS) % HDOPT_TURNS;
    i %= HDOPT_INPUTS;
    int j = (i + 1) % HDOPT_INPUTS, m = j ? n : (n + 1) % HDOPT_TURNS;
    return hdopt_table[i][n] * (1 - p) + hdopt_table[j][m] * p + path * ({back});
}}
"""


_C_SPEED = """
#define HDOPT_SPEEDS {speeds}
static const double hdopt_rpm[] = {{{rpm}}};
static const int hdopt_own_end[] = {{{end}}};
static const int hdopt_own_k[] = {{{k}}};
static const int hdopt_own_j[] = {{{j}}};
static const double hdopt_own_cos[] = {{{cos}}};
static const double hdopt_own_sin[] = {{{sin}}};

/* What the speed number n has of its own. */
static double hdopt_own_arcmin(int n, double input_rad, double output_rad)
{{
    double error = 0;
    for (int i = n ? hdopt_own_end[n - 1] : 0; i < hdopt_own_end[n]; i++) {{
        double phase = hdopt_own_k[i] * input_rad + hdopt_own_j[i] * output_rad;
        error += hdopt_own_cos[i] * cos(phase) + hdopt_own_sin[i] * sin(phase);
    }}
    return error;
}}

/* input_rpm: speed of the input, negative backward; between the recorded speeds straight lines. */
double hdopt_error_arcmin(double input_rad, double output_rad, double path, double input_rpm)
{{
    double error = hdopt_common_arcmin(input_rad, output_rad, path) + input_rpm * ({lag});
    int n = 0;
    double share;
    if (HDOPT_SPEEDS == 0)
        return error;
    while (n < HDOPT_SPEEDS && hdopt_rpm[n] < input_rpm)
        n++;
    if (n == 0 || n == HDOPT_SPEEDS)
        return error + hdopt_own_arcmin(n ? n - 1 : 0, input_rad, output_rad);
    share = (input_rpm - hdopt_rpm[n - 1]) / (hdopt_rpm[n] - hdopt_rpm[n - 1]);
    return error + (1 - share) * hdopt_own_arcmin(n - 1, input_rad, output_rad)
        + share * hdopt_own_arcmin(n, input_rad, output_rad);
}}
"""


def _c(found: Found, facts: Mapping[str, Any]) -> str:
    if isinstance(found, OfSpeed):
        common = _c(found.common, facts).replace(f"double {FUNCTION}(", "static double hdopt_common_arcmin(")
        columns = list(zip(*_own(found), strict=True)) or [()] * 5
        numbers = dict(zip(("k", "j", "cos", "sin"), map(_list, columns[1:]), strict=True))
        end = itertools.accumulate(len(one) for one in found.own)
        return common + _C_SPEED.format(
            speeds=len(found.speeds), rpm=_list(found.speeds), end=_list(list(end)), lag=repr(found.lag), **numbers
        )
    said = "\n".join(f"   {key}: {value}" for key, value in facts.items()).replace("*/", "* /")
    crossing = found.crossing
    over = f", over about {crossing_deg(crossing):.3g} deg of output" if crossing.deg else ""
    head = _HEAD.format(facts=said, crosses=crosses(crossing), over=over, start=crossing.start, moves=_moves(crossing))
    if not isinstance(found, Grid):
        columns = list(zip(*_terms(found), strict=True)) or [()] * 5
        numbers = {name: _list(column) for name, column in zip(("k", "j", "cos", "sin", "sum"), columns, strict=True)}
        larger = "fmin" if isinstance(found, Zones) and found.sense < 0 else "fmax"
        pulses = _c_pulses(found.pulses) if isinstance(found, Zones) and found.pulses else ""
        count = len(list(_terms(found)))
        return head + _C_TERMS.format(count=count, back=repr(found.back), larger=larger, pulses=pulses, **numbers)
    rows = ",\n".join("{" + _list(row) + "}" for row in found.values.tolist())
    inputs, outputs = found.values.shape
    form = _C_TABLE if isinstance(found, Surface) else _C_BEAT
    return head + form.format(inputs=inputs, outputs=outputs, rows=rows, back=repr(found.back))


def _c_pulses(pulses: Sequence[Pulse]) -> str:
    rows = ",\n        ".join("{" + _list(_pulse(pulse)) + "}" for pulse in pulses)
    return _C_PULSES.format(says=PULSES, rows=rows, count=len(pulses))


def _moves(crossing: Crossing) -> str:
    """What the C code returns as the path after a move."""
    turn = math.radians(crossing.deg)
    if crossing.straight and turn > 0:
        return f"path += 2 * output_moved_rad / {turn!r};\n    return side * path > 1 ? side : path;"
    # Crossing at once leaves nothing of the old side, however small the move.
    return f"return side + (path - side) * {f'exp(-fabs(output_moved_rad) / {turn!r})' if turn > 0 else '0'};"


def _list(values: Sequence[float]) -> str:
    return ", ".join(repr(value) for value in values) or "0"


def homing_arcmin(found: Found, ratio: float, off_deg: float = 1.0) -> tuple[float, float]:
    """Rms (arcmin) that `found` adds wrongly where the input's, or the output's, zero is off by `off_deg` of its shaft;
    `ratio` is N."""
    import numpy as np

    theta = np.linspace(0.0, 2 * math.pi * ratio, 20_000)
    here = found.at(theta, theta / ratio)
    off = math.radians(off_deg)
    moved = found.at(theta + off, theta / ratio), found.at(theta, theta / ratio + off)
    return float(np.std(moved[0] - here)), float(np.std(moved[1] - here))
