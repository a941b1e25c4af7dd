"""The documentation site: `make docs`. Pages that derive from the program are written before Sphinx reads any."""

from __future__ import annotations

import os
import re
import sys
from importlib.metadata import version as installed
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
from typeset import setup_math  # noqa: E402
from write_pages import write_pages  # noqa: E402

project = "hdopt"
author = "The hdopt developers"
copyright = "2026 the hdopt authors"
version = release = installed("hdopt")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_gallery.gen_gallery"]
myst_enable_extensions = ["deflist", "dollarmath"]
html_math_renderer = "mathtext"
myst_heading_anchors = 4
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["gallery/*", "_build"]
html_theme = "furo"
html_title = f"hdopt {release}"
html_show_sphinx = False
pygments_style = "default"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
default_role = "code"
suppress_warnings = ["config.cache"]
sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "filename_pattern": r"/example_",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "plot_gallery": os.environ.get("HDOPT_DOCS_PICTURES", "1") != "0",
    "remove_config_comments": True,
    "show_memory": False,
    "min_reported_time": 1e9,
    "download_all_examples": False,
    "capture_repr": ("_repr_html_", "__repr__"),
}

OUTSIDE_CODE = re.compile(r"(``.+?``|`[^`]+`)")


def as_text(app, what, name, obj, options, lines):
    """Docstrings are prose, not reStructuredText: code in backticks, everything else as it stands."""
    for place, line in enumerate(lines):
        parts = OUTSIDE_CODE.split(line)
        lines[place] = "".join(
            f"``{part.strip('`')}``" if part.startswith("`") else re.sub(r"([*|\\_])", r"\\\1", part) for part in parts
        )


FUNCTION = re.compile(r"^`(hdopt(?:\.\w+)+)` · `(tests/[\w/.]+)`$", re.M)
"""Under an equation on the page on theory."""


def linked(app, docname, source):
    """Functions and tests under the equations as links, which they are not where the page is read as a file."""
    if docname == "theory":
        source[0] = FUNCTION.sub(r"{py:obj}`\1` · {download}`\2 <../\2>`", source[0])


def setup(app):
    write_pages(HERE / "generated")
    setup_math(app)
    app.connect("source-read", linked)
    app.connect("autodoc-process-docstring", as_text)
