"""What a frame of the explorer costs: `python tests/browser/frame_cost.py [EXPLORER.html]`, as a table."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from chromium import Chromium, find_chromium

from hdopt.workflow.explore import explore

FRAMES = 120
REPEATS = 3
SIZES = ((390, 844), (1280, 900), (1920, 1080))
INPUTS = ("axis_eccentricity_mm", "width_mm", "pressure_angle_deg")
"""An error; an input that moves all drives of the cloud; one that changes what bends."""


def main(arguments: list[str]) -> int:
    executable = find_chromium()
    if executable is None:
        print("no Chromium found; install Debian's package chromium")
        return 2
    with tempfile.TemporaryDirectory() as folder, Chromium(executable) as browser:
        file = Path(arguments[0]) if arguments else Path(folder) / "explorer.html"
        if not arguments:
            explore("csf-25-80", file)
        print("screen px | input | frames a second | page's processor time, ms a frame | all processes, ms a frame")
        for size in SIZES:
            for name in INPUTS:
                rate, page_ms, all_ms = cheapest(browser, file, size, name)
                print(f"{size[0]} x {size[1]} | {name} | {rate:.0f} | {page_ms:.1f} | {all_ms:.1f}")
    return 0


def cheapest(browser: Chromium, file: Path, size: tuple[int, int], name: str) -> tuple[float, float, float]:
    """Frames a second of the best of `REPEATS` runs, and the least milliseconds of processor time a frame took."""
    with browser.open(file, size) as page:
        found = []
        for _ in range(REPEATS):
            page_before, all_before = page.cpu_seconds(), page.cpu_seconds(every=True)
            rate = page.evaluate(f"hdoptExplorer.measure({name!r}, {FRAMES})")["frames_per_second"]
            took = page.cpu_seconds() - page_before, page.cpu_seconds(every=True) - all_before
            found.append((rate, *(1e3 * seconds / FRAMES for seconds in took)))
    return max(one[0] for one in found), min(one[1] for one in found), min(one[2] for one in found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
