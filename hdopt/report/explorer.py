"""Write the explorer: one page that opens from disk and computes the closed form itself, slider by slider.

The physics is in templates/closed_form.js, the views in explorer_charts.js, the sliders in explorer.js. Nothing is
computed here.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from importlib.resources import files
from typing import Any  # Any: the JSON of the page, as `hdopt.files.to_json` takes it

from hdopt.report import theme
from hdopt.report.html import CONTENT_SECURITY_POLICY, script_safe

LIGHT = {
    "ink": theme.INK,
    "muted": theme.MUTED,
    "rule": "#d9dee5",
    "soft": "#f5f7f9",
    "grid": theme.GRID,
    "axis": theme.AXIS,
    "paper": theme.PAPER,
    "accent": theme.BLUE,
    "good": "#00795a",
    "bad": "#b34700",
    "cloud": theme.faded(theme.SKY, 0.55),
    "reference": theme.GREY,
    "band": theme.faded(theme.BLUE, 0.14),
}
"""Colours of the page; good and bad are the theme's green and vermillion, dark enough to be read as text."""
DARK = {
    "ink": "#e8ebef",
    "muted": "#a3aebb",
    "rule": "#333c47",
    "soft": "#1d242c",
    "grid": "#28303a",
    "axis": "#66717f",
    "paper": "#12171c",
    "accent": theme.SKY,
    "good": "#3fcf9f",
    "bad": "#ff9455",
    "cloud": theme.faded("#4f9dbf", 0.5),
    "reference": "#8d99a6",
    "band": theme.faded(theme.SKY, 0.2),
}
"""The same on a dark ground."""


def render_explorer(title: str, data: Mapping[str, Any], notes: Sequence[str] = ()) -> str:
    """The HTML of the explorer called `title`. `data` is what explorer.js reads (see `hdopt.workflow.explore`),
    JSON-ready; `notes` are sentences for the foot of the page."""
    import jinja2

    templates = files("hdopt.report") / "templates"

    def text(name: str) -> str:
        return (templates / name).read_text(encoding="utf-8")

    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    page = environment.from_string(text("explorer.html.j2"))
    style = jinja2.Environment().from_string(text("explorer.css"))
    shown = {**data, "sequential": [list(stop) for stop in theme.SEQUENTIAL]}
    html: str = page.render(
        title=title,
        notes=list(notes),
        version=version("hdopt"),
        content_security_policy=CONTENT_SECURITY_POLICY,
        css=style.render(light=_properties(LIGHT), dark=_properties(DARK)),
        data_json=script_safe(json.dumps(shown, separators=(",", ":"), allow_nan=False)),
        closed_form_js=text("closed_form.js"),
        charts_js=text("explorer_charts.js"),
        js=text("explorer.js"),
    )
    return html


def _properties(colours: Mapping[str, str]) -> str:
    return "\n".join(f"  --{name}: {value};" for name, value in colours.items())
