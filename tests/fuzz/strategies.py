"""Hypothesis strategies for what users give to hdopt: studies, recordings, cams, allocations, command lines.

Half of what they make is sound and half is damaged: wrong types, numbers at the ends of floats, foreign names, cut-off
files, bytes that are no text.
"""

from __future__ import annotations

import json
from copy import deepcopy
from functools import cache

from hypothesis import strategies as st

from hdopt.study import leaves, load_study
from hdopt.study.write import study_toml

ANY_TEXT = st.text(st.characters(exclude_categories=("Cs",)), max_size=30)
EXTREME = st.sampled_from([0, -1, 1e308, -1e308, 5e-324, 1e-300, float("inf"), float("nan"), 2**63, 10**400, True])
WRONG = st.one_of(EXTREME, ANY_TEXT, st.lists(st.integers(), max_size=3), st.dictionaries(ANY_TEXT, st.integers()))


def around(low: float, high: float) -> st.SearchStrategy[float]:
    """A sound number, or now and then anything."""
    return st.one_of(*[st.floats(low, high)] * 6, WRONG)


ERRORS = st.fixed_dictionaries(
    {},
    optional={
        "axis_eccentricity_mm": around(0, 0.05),
        "axis_eccentricity_direction_deg": around(0, 360),
        "axis_tilt_x_deg": around(-0.5, 0.5),
        "wg_eccentricity_mm": around(0, 0.05),
        "wg_eccentricity_direction_deg": around(0, 360),
        "wg_tilt_major_deg": around(-0.5, 0.5),
        "cs_tooth_amplitude_mm": around(0, 0.01),
        "cs_tooth_phase_deg": around(0, 360),
        "fs_tooth_amplitude_mm": around(0, 0.01),
        "fs_tooth_phase_deg": around(0, 360),
    },
)
WAVE_GENERATOR = st.fixed_dictionaries(
    {},
    optional={
        "profile": st.sampled_from(["ellipse", "resal", "two_disk", "measured", "none", 3]),
        "structure": st.sampled_from(["integral", "automatic", "one_way_major", "one_way_minor", ""]),
        "width_mm": around(1, 30),
        "semi_major_mm": around(30, 33),
        "semi_minor_mm": around(29, 31),
        "wrap_angle_deg": around(0, 60),
        "bearing_thickness_mm": around(1, 5),
    },
)
GEAR = st.fixed_dictionaries(
    {},
    optional={
        "flexspline_teeth": st.one_of(st.integers(-10, 400), WRONG),
        "circular_spline_teeth": st.one_of(st.integers(-10, 400), WRONG),
        "module_mm": around(0.1, 1),
        "pressure_angle_deg": around(5, 40),
        "flexspline_inner_radius_mm": around(10, 60),
    },
)
REQUIREMENT = st.fixed_dictionaries(
    {"peak_to_peak_arcmin": around(0.1, 3)},
    optional={"yield": around(0.5, 0.9999), "homogenization": st.sampled_from(["single_tooth", "contact", "x"])},
)
SECTIONS = st.fixed_dictionaries(
    {"drive": st.one_of(st.just("csf-25-80"), GEAR, ANY_TEXT)},
    optional={
        "errors": ERRORS,
        "wave_generator": WAVE_GENERATOR,
        "requirement": REQUIREMENT,
        "clearances": st.dictionaries(st.sampled_from(["backlash_mm", "disc_radius_mm"]), around(0, 20)),
        "study": st.fixed_dictionaries({}, optional={"title": ANY_TEXT, "steps": st.lists(ANY_TEXT, max_size=2)}),
        "erors": ERRORS,
    },
)


def _toml(data: dict) -> str:
    try:
        return study_toml(data)
    except (ValueError, TypeError, OverflowError):
        return repr(data)


@st.composite
def damaged(draw, text: st.SearchStrategy[str]) -> bytes:
    """Text as it is, cut off, with bytes changed, or other bytes altogether."""
    raw = draw(text).encode("utf-8", "surrogatepass")
    kind = draw(st.sampled_from(["whole"] * 6 + ["cut", "changed", "bytes"]))
    if kind == "cut":
        return raw[: draw(st.integers(0, len(raw)))]
    if kind == "changed" and raw:
        place = draw(st.integers(0, len(raw) - 1))
        return raw[:place] + draw(st.binary(max_size=4)) + raw[place + 1 :]
    return draw(st.binary(max_size=200)) if kind == "bytes" else raw


STUDY_FILES = damaged(SECTIONS.map(_toml))


@st.composite
def _recording(draw) -> str:
    """A table of angles, steady or not, with cells that are none."""
    rows = draw(st.integers(0, 60))
    step = draw(st.one_of(st.floats(0.01, 30), st.sampled_from([0.0, -1.0, 1e308, float("inf"), float("nan")])))
    head = draw(
        st.sampled_from(["time_s,input_deg,output_deg", "input_deg,output_deg", "input_deg,error_arcmin", "a,b"])
    )
    odd = draw(st.dictionaries(st.integers(0, 60), ANY_TEXT, max_size=2))
    lines = [head]
    for i in range(rows):
        cells = [str(i * 0.01), str(i * step), str(i * step / 80)][-len(head.split(",")) :]
        lines.append(odd.get(i, ",".join(cells)))
    return "\n".join(lines)


RECORDING_FILES = damaged(_recording())


@st.composite
def _cam(draw) -> str:
    points = draw(st.integers(0, 80))
    radius = draw(around(20, 40))
    return "angle_deg,radius_mm\n" + "\n".join(f"{i * 360 / max(points, 1)},{radius}" for i in range(points))


CAM_FILES = damaged(_cam())

ALLOCATION_FILES = damaged(
    st.one_of(
        st.dictionaries(
            st.sampled_from(["errors", "total_cost", "study"]),
            st.dictionaries(
                st.one_of(st.sampled_from(["axis_eccentricity_mm", "wg_tilt_major_deg"]), ANY_TEXT),
                st.one_of(st.fixed_dictionaries({"tolerance": around(0.001, 0.1)}), WRONG),
                max_size=3,
            ),
        ),
        WRONG,
    ).map(json.dumps)
)

STUDIES = {name: load_study(name).data for name in ("csf-25-80-tolerances", "chase-shaft-housing")}
HERE = ["--engine", "process"]
STACK = ["stack", "-n", "2048", *HERE]
COMMANDS = {
    "csf-25-80-tolerances": [["profile"]] * 42 + [STACK] * 2 + [["ke", "--method", "closed form"]],
    "chase-shaft-housing": [STACK] * 3 + [["allocate", "--no-compare", *HERE]],
}
"""Dear commands seldom: `profile` takes 5 ms, the stacks 20 and 130 ms, `allocate` 36 ms and `ke` 320 ms. In one
thread: numbers are what is tried, and on a machine with other work threads are mostly waited for."""
MAGNITUDES = [0.0, -1.0, 5e-324, 1e-300, 1e-14, 1e-6, 1e-3, 1e3, 1e6, 1e14, 1e300, 1e308, -1e308]


MARKER = 987654321.125


@cache
def _around_a_number(name: str, path: tuple[str, ...]) -> list[str]:
    """The text of a shipped study, before and after the number at `path`; written once, which takes milliseconds."""
    data = deepcopy(STUDIES[name])
    _table(data, path)[path[-1]] = MARKER
    data.setdefault("allocate", {}).update(verify_n=2**14, curve=[])
    return study_toml(data).split(repr(MARKER))


@st.composite
def _one_number(draw) -> tuple[str, list[str]]:
    """A shipped study with one of its numbers far off, each allowed by itself, and a command that computes with it."""
    name = draw(st.sampled_from(["csf-25-80-tolerances"] * 3 + ["chase-shaft-housing"]))
    path = draw(st.sampled_from(PLACES[name]))
    value = draw(st.one_of(st.sampled_from(MAGNITUDES), st.floats(-308, 308).map(lambda decades: 10.0**decades)))
    before, after = _around_a_number(name, path)
    return f"{before}{value!r}{after}", draw(st.sampled_from(COMMANDS[name]))


def _table(data: dict, path: tuple[str, ...]) -> dict:
    for part in path[:-1]:
        data = data[part]
    return data


PLACES = {
    name: [path for path in leaves(data) if type(_table(data, path)[path[-1]]) in (int, float)]
    for name, data in STUDIES.items()
}
NUMBERS = _one_number()

KEYS = ["axis_tilt_x_deg", "wave_generator.width_mm", "width_mm", "module_mm", "upper", "profile", "steps", ""]
OPTIONS = st.lists(
    st.one_of(
        st.tuples(st.just("--set"), st.builds(lambda k, v: f"{k}={v}", st.sampled_from(KEYS), WRONG)),
        st.tuples(st.sampled_from(["--structure", "--drive", "--seed", "--turns", "--sampling-deg"]), WRONG.map(str)),
        st.tuples(st.sampled_from(["--check", "--help", "--nothing", "--json"])),
        st.tuples(ANY_TEXT),
    ),
    max_size=3,
).map(lambda parts: [str(word).replace("\0", "") for part in parts for word in part])
