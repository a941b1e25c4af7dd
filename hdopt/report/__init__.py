"""What a report is made of. Sections are built by `hdopt.report.sections`, pages are written by `hdopt.report.html`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any  # Any: the state that pickle keeps

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

REPORT_FILE = "report.html"
RESULTS_FILE = "results.json"


@dataclass(frozen=True)
class Figure:
    """A Plotly figure. `key` names it in the page and in file names; `caption` says what to see in it."""

    key: str
    title: str
    figure: go.Figure
    caption: str = ""

    def __getstate__(self) -> dict[str, Any]:
        """Traces and layout as they are: Plotly's own way to pickle turns arrays into text that tables cannot read."""
        traces = [trace.to_plotly_json() for trace in self.figure.data]
        return {**self.__dict__, "figure": {"data": traces, "layout": self.figure.layout.to_plotly_json()}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        import plotly.graph_objects as go

        self.__dict__.update(state, figure=go.Figure(state["figure"]))


@dataclass(frozen=True)
class Table:
    """A table, also written as `key`.csv beside the report unless `in_file` is False. `formats` maps a column to a
    format spec such as '.3f', or to one of those that `hdopt.report.cells` names."""

    key: str
    title: str
    frame: pd.DataFrame
    caption: str = ""
    formats: Mapping[str, str] = field(default_factory=dict)
    in_file: bool = True


@dataclass(frozen=True)
class Picture:
    """A drawing given as the text of an SVG, or the bytes of a PNG."""

    key: str
    title: str
    content: str | bytes
    caption: str = ""


@dataclass(frozen=True)
class Text:
    """A paragraph in plain words."""

    text: str


@dataclass(frozen=True)
class Points:
    """Sentences that follow each other, a line each."""

    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Ruling:
    """Whether a requirement is `met`, None where that cannot be decided, and the sentence that says by what."""

    met: bool | None
    text: str


@dataclass(frozen=True)
class KeyFigures:
    """The few numbers to see first: label -> value with its unit, already written out."""

    values: Mapping[str, str]


@dataclass(frozen=True)
class Download:
    """A file inside the page: its `name`, its `content`, and what it is. One that `opens` is a page of its own, which a
    button shows in a new tab."""

    name: str
    content: str | bytes
    what: str = ""
    opens: bool = False


Item = Figure | Table | Picture | Text | Points | Ruling | KeyFigures | Download


@dataclass(frozen=True)
class Section:
    """One topic of a report: a heading, what it says in a sentence or two, and what it shows."""

    key: str
    title: str
    items: tuple[Item, ...]
    summary: str = ""


@dataclass(frozen=True)
class Report:
    """Everything on one page, with the JSON-ready results behind it."""

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    results: Mapping[str, object] = field(default_factory=dict)


SectionBuilder = Callable[..., Section]
"""A function of `hdopt.report.sections`: takes a frozen result, returns the section that shows it."""
