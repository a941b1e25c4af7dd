"""The page itself in a real browser, and the harness that looks at it: what is broken must be found."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from chromium import NARROW, Chromium, check_report

from hdopt.report import Download, Figure, KeyFigures, Picture, Report, Section, Table, Text, theme
from hdopt.report.html import write_report

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 20"><circle cx="20" cy="10" r="9"/></svg>'
NUMBERS = Table("numbers", "Numbers", pd.DataFrame({"a": [1]}))
CSP_START = '<meta http-equiv="Content-Security-Policy"'
CSP_OFF = '<meta name="switched-off"'


def line_figure(key: str = "waveform") -> Figure:
    theta = np.linspace(0, 360, 181)
    figure = theme.figure("Input angle [deg]", "KE [arcmin]")
    figure.add_scatter(x=theta, y=np.sin(2 * np.radians(theta)), mode="lines", name="sine")
    return Figure(key, "A waveform", figure, "Two cycles a turn; see [[numbers]].")


def report_of(*items: object) -> Report:
    return Report("A drive", "Something to look at", (Section("first", "First", tuple(items), "What it says."),))


@pytest.fixture
def whole_report() -> Report:
    x = np.linspace(0, 1, 12)
    heat = theme.figure("x", "y")
    heat.add_heatmap(x=x, y=x, z=np.add.outer(x, x**2))
    wide = pd.DataFrame({f"a_long_column_name_{i}_arcmin": np.arange(4) * 1.5 for i in range(12)})
    return report_of(
        KeyFigures({"Peak-to-peak": "1.369 arcmin", "Contact angle": "54.56 deg", "Yield": "99.73 %"}),
        Text("Plain words with `code` and a reference to [[heat]]."),
        line_figure(),
        Figure("heat", "A heat map", heat, "Dark is large."),
        Table("numbers", "Numbers", wide, "Wide on purpose."),
        Picture("drawing", "A drawing", SVG, "A circle."),
    )


def test_everything_is_drawn_and_nothing_is_fetched(look_at, tmp_path, whole_report):
    findings = look_at(write_report(whole_report, tmp_path / "out"))
    assert findings.figures == ("waveform", "heat")
    assert all(findings.labels.values())
    assert findings.pdf_pages >= 2


def test_a_file_in_the_page_is_the_one_beside_it(browser: Chromium, tmp_path, whole_report):
    page_file = write_report(whole_report, tmp_path)
    with browser.open(page_file) as page:
        for name in ("numbers.csv", "waveform.csv"):
            text = page.evaluate(f"hdoptReport.file('{name}').then((blob) => blob.text())")
            assert text == (tmp_path / name).read_text()


def test_a_page_inside_the_page_opens(browser: Chromium, tmp_path):
    inner = Download("inner.html", "<!DOCTYPE html><p>inside</p>", opens=True)
    with browser.open(write_report(report_of(inner), tmp_path)) as page:
        page.evaluate("window.open = (url) => { window.opened = url; }")
        page.evaluate("document.querySelector('[data-open]').click()")
        page.wait(0.3)
        assert page.evaluate("hdoptReport.file('inner.html').then((blob) => blob.text())") == inner.content
        assert page.evaluate("window.opened").startswith("blob:")


def test_a_figure_follows_the_width_of_the_window(browser: Chromium, tmp_path, whole_report):
    with browser.open(write_report(whole_report, tmp_path)) as page:
        before = page.figures()[0]["drawn_width"]
        page.resize(NARROW)
        page.wait(0.4)
        assert before > 600
        assert 300 < page.figures()[0]["drawn_width"] <= 390
        page.resize((1280, 900))
        page.wait(0.4)
        assert page.figures()[0]["drawn_width"] == before


def test_no_button_sends_a_figure_anywhere(browser: Chromium, tmp_path, whole_report):
    with browser.open(write_report(whole_report, tmp_path)) as page:
        titles = page.evaluate("[...document.querySelectorAll('.modebar-btn')].map((button) => button.dataset.title)")
    assert set(titles) == {"Download plot", "Reset views"}


def test_the_page_forbids_itself_the_network(browser: Chromium, tmp_path):
    html = write_report(report_of(Text("Nothing")), tmp_path)
    html.write_text(html.read_text().replace("</main>", '<img src="http://127.0.0.1:9/x.png"></main>'))
    findings = check_report(browser, html, tmp_path / "pictures")
    assert any("Content Security Policy" in problem for problem in findings.problems)


def test_the_harness_finds_what_is_broken(browser: Chromium, tmp_path):
    empty = theme.figure("x", "y")
    empty.add_scatter(x=[], y=[], mode="lines", name="nothing")
    html = write_report(report_of(Figure("empty", "Empty", empty), line_figure("good"), NUMBERS), tmp_path)
    broken = '<div style="width:2000px">wide</div><script>console.error("boom"); missing()</script></main>'
    html.write_text(html.read_text().replace("</main>", broken).replace(CSP_START, CSP_OFF))
    text = html.read_text().replace("</main>", '<img src="other.png"></main>')
    html.write_text(text)
    said = "\n".join(check_report(browser, html, tmp_path / "pictures").problems)
    assert "empty (wide): nothing is drawn" in said
    assert "traces without points: nothing" in said
    assert "empty: hovering shows no label" in said
    assert "good" not in said
    assert "console error: boom" in said
    assert "missing is not defined" in said
    assert "other.png" in said
    assert "at 390 px: div reaches" in said
