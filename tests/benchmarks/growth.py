"""Draw how time grows with size from the table of docs/benchmarks.md: `python -m tests.benchmarks.growth`.

What is drawn is what the table says: the curve of every row, each over its own first size and time, and its exponent.
"""

from __future__ import annotations

import re
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, PICTURE = DOCS / "benchmarks.md", DOCS / "benchmarks-growth.svg"

ROW = re.compile(
    r"^\| (?P<name>[^|]+) \| (?P<sizes>[\d., ]+) \| (?P<seconds>[\de., +-]+) \| (?P<exponent>-?[\d.]+) \|$"
)


def rows(page: str) -> list[tuple[str, list[float], list[float], float]]:
    """Name, sizes, seconds and exponent of every row of the table of growth in the text of a `page`."""
    _, _, table = page.partition("## Growth")
    found = (ROW.match(line) for line in table.splitlines())
    return [
        (
            one["name"],
            [float(size.replace(",", "")) for size in one["sizes"].split(", ")],
            [float(taken) for taken in one["seconds"].split(", ")],
            float(one["exponent"]),
        )
        for one in found
        if one
    ]


def drawn(page: str) -> Figure:
    """The curves of a `page`, over size and time as multiples of the first."""
    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for (name, sizes, seconds, exponent), marker in zip(rows(page), "osv^D<>ph*", strict=False):
        over = [size / sizes[0] for size in sizes]
        axes.plot(over, [s / seconds[0] for s in seconds], marker=marker, label=f"{name}: {exponent:.2f}")
    axes.plot([1, 64], [1, 64], color="0.6", linestyle="--", label="in proportion: 1.00")
    axes.set(xscale="log", yscale="log", xlabel="size, times the first", ylabel="time, times the first")
    axes.grid(visible=True, which="major", linewidth=0.4)
    figure.legend(loc="outside lower center", ncols=1, fontsize="x-small", frameon=False)
    return figure


def write(page: Path = PAGE, picture: Path = PICTURE) -> None:
    """Draw the table of `page` into the file `picture`; the same page gives the same bytes."""
    with rc_context({"svg.hashsalt": "growth", "svg.fonttype": "none"}):
        drawn(page.read_text(encoding="utf-8")).savefig(picture, format="svg", metadata={"Date": None})


if __name__ == "__main__":
    write()
