"""Formulas of the site as pictures inside the page, set by matplotlib: no network, no TeX."""

from __future__ import annotations

import io
import re
from html import escape

POINTS_A_PIXEL = 0.75
INK = "#123456"
"""Stands for the colour of the text around."""


def picture(formula: str, size: float) -> tuple[str, float, float, float]:
    """`formula` in TeX at `size` points as SVG, with its width, height and depth below the line, points. Raises
    `ValueError` for what matplotlib's mathtext does not know."""
    from matplotlib import rc_context
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import MathTextParser, math_to_image

    text = f"${formula.strip()}$"
    content = io.BytesIO()
    with rc_context({"mathtext.fontset": "stix", "svg.hashsalt": "hdopt", "savefig.transparent": True}):
        font = FontProperties(size=size)
        parsed = MathTextParser("path").parse(text, dpi=72, prop=font)
        math_to_image(text, content, prop=font, dpi=72, format="svg", color=INK)
    return content.getvalue().decode(), parsed.width, parsed.height, parsed.depth


def html(formula: str, size: float, block: bool) -> str:
    """`formula` as a picture that stands on the line of the text, or in a `block` of its own with fractions at full
    size; its TeX is what a screen reader says."""
    svg, width, _, depth = picture(formula.replace(r"\frac", r"\dfrac") if block else formula, size)
    svg = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", "", svg[svg.index("<svg") :], flags=re.S)
    style = f"width:{width / POINTS_A_PIXEL:.1f}px;height:auto;vertical-align:{-depth / POINTS_A_PIXEL:.1f}px"
    head = f'<svg class="math" role="img" aria-label="{escape(formula.strip())}" style="{style};max-width:100%"'
    image = svg.replace("<svg", head, 1).replace(INK, "currentColor")
    return f'<p class="math">{image}</p>' if block else image


def setup_math(app) -> None:
    """Make Sphinx set the formulas of `app` so."""
    from docutils import nodes

    def inline(self, node):
        self.body.append(html(node.astext(), 11, block=False))
        raise nodes.SkipNode

    def display(self, node):
        self.body.append(html(node.astext(), 12.5, block=True))
        raise nodes.SkipNode

    app.add_html_math_renderer("mathtext", (inline, None), (display, None))
