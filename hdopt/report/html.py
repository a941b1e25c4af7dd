"""Write a report as one page that opens from disk, anywhere, with its numbers beside it.

The page holds everything it needs (Plotly's library once, styles, data, pictures) and forbids itself any other source,
so it looks the same offline, in an archive and in ten years. The numbers of each figure and table are files inside it,
to be saved from it: nothing is lost where the page travels alone. Nothing is computed here.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Collection, Iterator
from functools import singledispatchmethod
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any  # Any: what a template is given

from markupsafe import Markup, escape

from hdopt.errors import HdoptError
from hdopt.files import make_folder, to_csv, to_json, write_text
from hdopt.moment import moment
from hdopt.report import (
    REPORT_FILE,
    RESULTS_FILE,
    Download,
    Figure,
    Item,
    KeyFigures,
    Picture,
    Points,
    Report,
    Ruling,
    Table,
    Text,
)
from hdopt.report.cells import columns, index_has_meaning, minus, stacks
from hdopt.report.numbers import figure_frame
from hdopt.report.theme import HEIGHT, template

ROWS_SHOWN = 60
"""Rows of a table in the page; a longer one goes on in its CSV file."""

CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; worker-src blob:"
)
"""Only what is in the page itself: no network, no other file."""

_KEY = re.compile(r"[a-z0-9][a-z0-9_-]*")
_REFERENCE = re.compile(r"\[\[([^\[\]]+)\]\]")
_DIGITS = r"\d[\d.,\u202f]*"
_NUMBER = re.compile(rf"([-+−±<>≈≤≥]?{_DIGITS}%?(?: to {_DIGITS})?)(?: (.*))?")
_CODE = re.compile(r"`([^`]+)`")


def write_report(report: Report, folder: Path) -> Path:
    """Write report.html, a CSV for every table and figure, and results.json into `folder`; return the page's path.

    In summaries, captions and paragraphs `[[key]]` becomes a link to the figure, table or picture of that key
    ('Figure 3'), and text between backticks is set as code.
    """
    folder = Path(folder)
    _check_keys(report)
    make_folder(folder)
    for name, text in _csv_texts(report).items():
        write_text(folder / name, text)
    if report.results:
        write_text(folder / RESULTS_FILE, to_json(report.results) + "\n")
    page = folder / REPORT_FILE
    write_text(page, render(report))
    return page


def render(report: Report) -> str:
    """The HTML of the page of a `report`, with the numbers behind it as files inside. Raises `HdoptError` where a text
    refers to a figure or table that the report does not have."""
    import jinja2

    templates = files("hdopt.report") / "templates"
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    page = environment.from_string((templates / "report.html.j2").read_text(encoding="utf-8"))
    inside: dict[str, str | bytes] = {**_csv_texts(report)}
    if report.results:
        inside[RESULTS_FILE] = to_json(report.results) + "\n"
    prepare = _Preparation(report, inside)
    figures = [item for section in report.sections for item in section.items if isinstance(item, Figure)]
    html: str = page.render(
        report=report,
        sections=[
            {
                "anchor": section.key,
                "title": section.title,
                "summary": prepare.prose(section.summary),
                "items": [prepare.item(item) for item in section.items],
            }
            for section in report.sections
        ],
        figures=[(figure.key, _figure_json(figure)) for figure in figures],
        files=[(name, _packed(content)) for name, content in {**inside, **_downloads(report)}.items()],
        template_json=script_safe(json.dumps(template().to_plotly_json())),
        plotly_js=_plotly_js() if figures else "",
        css=(templates / "report.css").read_text(encoding="utf-8"),
        js=(templates / "report.js").read_text(encoding="utf-8"),
        content_security_policy=CONTENT_SECURITY_POLICY,
        results_file=RESULTS_FILE if report.results else "",
        version=version("hdopt"),
        date=date_of_page(),
    )
    return html


class _Preparation:
    """Numbers a report's figures and tables, and turns its items into what the page template shows."""

    def __init__(self, report: Report, csv_files: Collection[str]) -> None:
        self.csv_files = csv_files
        self.numbers: dict[str, str] = {}
        counts = {"Figure": 0, "Table": 0}
        for section in report.sections:
            for item in section.items:
                if isinstance(item, Figure | Picture | Table):
                    kind = "Table" if isinstance(item, Table) else "Figure"
                    counts[kind] += 1
                    self.numbers[item.key] = f"{kind} {counts[kind]}"

    def prose(self, text: str) -> Markup:
        """Plain text as HTML, with references to figures and tables linked."""
        linked = _REFERENCE.sub(self._reference, str(escape(text)))
        return Markup(_CODE.sub(r"<code>\1</code>", linked))

    def _reference(self, match: re.Match[str]) -> str:
        key = match.group(1)
        if key not in self.numbers:
            from hdopt.errors import unknown_name

            raise HdoptError("report: " + unknown_name("figure or table", key, self.numbers))
        return f'<a href="#{key}">{self.numbers[key].replace(" ", "&nbsp;")}</a>'

    @singledispatchmethod
    def item(self, item: Item) -> dict[str, Any]:
        raise TypeError(f"a report cannot show a {type(item).__name__}")

    @item.register
    def _(self, item: Text) -> dict[str, Any]:
        return {"kind": "text", "text": self.prose(item.text)}

    @item.register
    def _(self, item: KeyFigures) -> dict[str, Any]:
        return {"kind": "key-figures", "entries": [(label, *_split_unit(v)) for label, v in item.values.items()]}

    @item.register
    def _(self, item: Points) -> dict[str, Any]:
        return {"kind": "points", "sentences": [self.prose(sentence) for sentence in item.sentences]}

    @item.register
    def _(self, item: Ruling) -> dict[str, Any]:
        kind, says = {True: ("met", "Met"), False: ("missed", "Missed"), None: ("open", "Not decidable")}[item.met]
        return {"kind": "ruling", "met": kind, "says": says, "text": self.prose(item.text)}

    @item.register
    def _(self, item: Download) -> dict[str, Any]:
        return {"kind": "download", "name": item.name, "what": self.prose(item.what), "opens": item.opens}

    @item.register
    def _(self, item: Figure) -> dict[str, Any]:
        height = item.figure.layout.height or HEIGHT
        return self._numbered(item) | {"kind": "figure", "height": f"{height:g}"}

    @item.register
    def _(self, item: Picture) -> dict[str, Any]:
        return self._numbered(item) | {"kind": "picture", "source": _data_url(item.content)}

    @item.register
    def _(self, item: Table) -> dict[str, Any]:
        shown = columns(item.frame, item.formats)
        rows = list(zip(*(column.cells for column in shown), strict=True))
        return self._numbered(item) | {
            "kind": "table",
            "columns": shown,
            "stacks": stacks(shown),
            "rows": rows[:ROWS_SHOWN],
            "rows_left_out": max(0, len(rows) - ROWS_SHOWN),
        }

    def _numbered(self, item: Figure | Picture | Table) -> dict[str, Any]:
        csv = f"{item.key}.csv"
        return {
            "key": item.key,
            "anchor": item.key,
            "number": self.numbers[item.key],
            "title": _full_stop(item.title),
            "caption": self.prose(item.caption),
            "label": f"{item.title}. {_REFERENCE.sub('', item.caption)}".strip(),
            "csv": csv if csv in self.csv_files else "",
        }


def _check_keys(report: Report) -> None:
    """Keys name files and anchors: refuse one that cannot, and one used twice."""
    seen: set[str] = {"report", "template"}
    for section in report.sections:
        for part in (section, *section.items):
            key = getattr(part, "key", None)
            if key is None:
                continue
            if not _KEY.fullmatch(key):
                raise HdoptError(f"report: the key {key!r} cannot name a file; use a-z, 0-9, '-' and '_' only")
            if key in seen:
                raise HdoptError(f"report: the key {key!r} is used twice; give every section, figure and table its own")
            seen.add(key)


def _csv_texts(report: Report) -> dict[str, str]:
    """The numbers of every table and figure, by the name of their file."""
    return {name: to_csv(frame, index=index_has_meaning(frame)) for name, frame in _csv_tables(report)}


def _downloads(report: Report) -> dict[str, str | bytes]:
    items = (item for section in report.sections for item in section.items)
    return {item.name: item.content for item in items if isinstance(item, Download)}


def _packed(content: str | bytes) -> str:
    """A file as it lies in the page: gzip, the same bytes each time, in base64."""
    raw = content.encode() if isinstance(content, str) else content
    return base64.b64encode(gzip.compress(raw, mtime=0)).decode()


def _csv_tables(report: Report) -> Iterator[tuple[str, Any]]:
    for section in report.sections:
        for item in section.items:
            if isinstance(item, Table) and item.in_file:
                yield f"{item.key}.csv", item.frame
            elif isinstance(item, Figure) and not (frame := figure_frame(item.figure)).empty:
                yield f"{item.key}.csv", frame


def _figure_json(figure: Figure) -> str:
    """Data and layout of a figure; the template is left out, because the page gives the same one to all."""
    content = json.loads(figure.figure.to_json())
    content["layout"].pop("template", None)
    return script_safe(json.dumps({"data": content["data"], "layout": content["layout"]}, separators=(",", ":")))


def script_safe(text: str) -> str:
    """The JSON `text` so written that it cannot end the script element that holds it."""
    return text.replace("<", "\\u003c")


def _plotly_js() -> str:
    from plotly.offline import get_plotlyjs

    source: str = get_plotlyjs()
    return source


def _data_url(content: str | bytes) -> str:
    """An image as a data URL; an SVG so included cannot run scripts nor clash with the names of another."""
    kind, raw = ("svg+xml", content.encode()) if isinstance(content, str) else ("png", content)
    return f"data:image/{kind};base64,{base64.b64encode(raw).decode()}"


def _split_unit(value: str) -> tuple[str, str]:
    """'1.369 arcmin' as ('1.369', 'arcmin'), '0.8 to 1.3 arcmin' as ('0.8 to 1.3', 'arcmin'); what is neither a number
    nor a range, with a unit or without, stays whole."""
    found = _NUMBER.fullmatch(value)
    return (minus(found.group(1)), found.group(2) or "") if found else (value, "")


def _full_stop(title: str) -> str:
    return title if title.endswith((".", "?", "!")) else title + "."


def date_of_page() -> str:
    """The date, UTC as in the other files, or that of SOURCE_DATE_EPOCH where a reproducible page is wanted."""
    now = moment()
    return f"{now.day} {now:%B %Y}"
