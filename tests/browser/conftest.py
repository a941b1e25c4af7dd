"""Fixtures to test any report in a real browser:

def test_my_report(look_at, tmp_path):
    look_at(write_report(my_report, tmp_path))
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from chromium import Chromium, Findings, check_report, find_chromium


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="session")
def browser() -> Iterator[Chromium]:
    executable = find_chromium()
    if executable is None:
        pytest.skip("no Chromium found; install Debian's package chromium to test reports in a browser")
    with Chromium(executable) as running:
        yield running


@pytest.fixture
def look_at(browser: Chromium, tmp_path: Path, request: pytest.FixtureRequest) -> Callable[..., Findings]:
    """Check a report and fail with everything that is wrong; HDOPT_SCREENSHOTS=FOLDER keeps the pictures."""

    def look(html: Path, no_hover: tuple[str, ...] = ()) -> Findings:
        kept = os.environ.get("HDOPT_SCREENSHOTS")
        folder = Path(kept) / request.node.name if kept else tmp_path / "pictures"
        findings = check_report(browser, html, folder, no_hover, pictures=bool(kept))
        assert not findings.problems, "\n".join(findings.problems)
        return findings

    return look
