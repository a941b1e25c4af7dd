"""The notebook of the gallery's last example: `python docs/write_notebook.py`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from sphinx_gallery.py_source_parser import split_code_and_text_blocks

DOCS = Path(__file__).parent
EXAMPLE = DOCS / "gallery" / "example_30_one_study.py"
NOTEBOOK = DOCS / "notebooks" / "one-study.ipynb"
LEVELS = {"=": "#", "-": "##"}
"""Of a heading by what underlines it in the example; markdown in the notebook."""


def notebook(example: Path) -> str:
    """The JSON of a notebook with the cells of `example`, a file of the gallery; no outputs."""
    _, blocks = split_code_and_text_blocks(str(example))
    content = {
        "cells": [cell(kind, text) for kind, text, _ in blocks if text.strip()],
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 4,
    }
    return json.dumps(content, indent=1) + "\n"


def cell(kind: str, text: str) -> dict[str, Any]:
    """A cell of a `kind`, "text" or "code"."""
    if kind == "text":
        words = re.sub(r"^(.+)\n([=-])\2+$", lambda found: f"{LEVELS[found[2]]} {found[1]}", text.strip(), flags=re.M)
        words = words.replace("``", "`")
        return {"cell_type": "markdown", "metadata": {}, "source": words.splitlines(keepends=True)}
    code = text.strip().splitlines(keepends=True)
    return {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": code}


if __name__ == "__main__":
    NOTEBOOK.write_text(notebook(EXAMPLE), encoding="utf-8")
