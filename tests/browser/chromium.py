"""A headless Chromium driven through its DevTools protocol, and what it can say about a report opened from disk.

By hand: `python tests/browser/chromium.py REPORT.html FOLDER` leaves screenshots and a PDF in FOLDER.
"""

from __future__ import annotations

import base64
import json
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

EXECUTABLES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
    "--remote-allow-origins=*",
    "--remote-debugging-port=0",
)
WIDE = (1280, 900)
NARROW = (390, 844)

LOOK_JS = Path(__file__).with_name("look.js").read_text(encoding="utf-8")
"""Defines `look` in a page: figures(), probes(i), label(i), overflow(), sideways()."""


class ChromiumError(RuntimeError):
    """The browser did not do what it was told."""


def find_chromium() -> str | None:
    """Path of the first Chromium found, or None."""
    return next((path for name in EXECUTABLES if (path := shutil.which(name))), None)


class Chromium:
    """A running browser; use it as a context manager, `open` gives a page."""

    def __init__(self, executable: str, start_timeout: float = 60.0) -> None:
        self._profile = tempfile.TemporaryDirectory(prefix="hdopt-chromium-", ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [executable, *FLAGS, f"--user-data-dir={self._profile.name}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        port_file = Path(self._profile.name) / "DevToolsActivePort"
        deadline = time.monotonic() + start_timeout
        while not (port_file.exists() and port_file.read_text().count("\n") >= 1):
            if self._process.poll() is not None or time.monotonic() > deadline:
                self.close()
                raise ChromiumError(f"{executable} did not start within {start_timeout:g} s")
            time.sleep(0.05)
        port, path = port_file.read_text().split("\n")[:2]
        self._address = f"ws://127.0.0.1:{port}{path}"

    def __enter__(self) -> Chromium:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._profile.cleanup()

    @contextmanager
    def open(self, html: Path, size: tuple[int, int] = WIDE):
        """A `Page` showing the file `html`, its figures drawn; errors and requests are collected from the start."""
        page = Page(self._address, html, size)
        try:
            page.load()
            yield page
        finally:
            page.close()


class Page:
    """One tab, listening to its console and its network."""

    def __init__(self, address: str, html: Path, size: tuple[int, int]) -> None:
        import websocket

        self._socket = websocket.create_connection(address, timeout=60, max_size=None, suppress_origin=True)
        self._last_id = 0
        self._loaded = False
        self._session = ""
        self.html = html.resolve()
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=self._target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self._call(f"{domain}.enable")
        self.resize(size)

    def load(self, timeout: float = 60.0) -> None:
        start = time.monotonic()
        self._call("Page.navigate", url=self.html.as_uri())
        while not self._loaded:
            if time.monotonic() - start > timeout:
                raise ChromiumError(f"{self.html} did not load within {timeout:g} s")
            self._handle(self._receive())
        self.evaluate("window.hdoptReport ? window.hdoptReport.drawn.then(() => true) : true")
        self.load_seconds = time.monotonic() - start
        self.evaluate(LOOK_JS + ";true")

    def close(self) -> None:
        self._session = ""
        self._call("Target.closeTarget", targetId=self._target)
        self._socket.close()

    def resize(self, size: tuple[int, int], scale: float = 1.0) -> None:
        width, height = size
        mobile = width < 600
        self._call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile
        )
        self._call("Emulation.setTouchEmulationEnabled", enabled=mobile)

    def evaluate(self, expression: str) -> Any:
        answer = self._call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise ChromiumError(_exception_text(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def figures(self) -> list[dict[str, Any]]:
        """What is drawn of each figure; see look.js."""
        return self.evaluate("look.figures()")

    def hover_text(self, index: int) -> str:
        """Move the mouse over figure `index` until a label shows; its text, or '' where none ever does."""
        for x, y in self.evaluate(f"look.probes({index})"):
            for step in (1, 0):  # a mouse arrives, it does not appear
                self._call("Input.dispatchMouseEvent", type="mouseMoved", x=x - step, y=y)
            self.wait(0.08)
            if text := self.evaluate(f"look.label({index})"):
                return text
        return ""

    def screenshot(self, file: Path) -> Path:
        """The page from top to bottom in one picture."""
        width = self.evaluate("innerWidth")
        height = self.evaluate("document.documentElement.scrollHeight")
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        answer = self._call("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
        file.write_bytes(base64.b64decode(answer["data"]))
        return file

    def print_pdf(self, file: Path) -> Path:
        a4 = {"paperWidth": 8.27, "paperHeight": 11.69}
        answer = self._call("Page.printToPDF", printBackground=True, preferCSSPageSize=True, **a4)
        file.write_bytes(base64.b64decode(answer["data"]))
        return file

    def cpu_seconds(self, every: bool = False) -> float:
        """Processor time that the busiest of the browser's page processes, or `every` process, has taken so far."""
        session, self._session = self._session, ""
        found = self._call("SystemInfo.getProcessInfo")["processInfo"]
        self._session = session
        if every:
            return sum(process["cpuTime"] for process in found)
        return max(process["cpuTime"] for process in found if process["type"] == "renderer")

    def wait(self, seconds: float) -> None:
        """Let the page run, taking in what it reports meanwhile."""
        self.evaluate(f"new Promise((done) => setTimeout(done, {1000 * seconds:g}))")

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._last_id += 1
        message = {"id": self._last_id, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            answer = self._receive()
            if answer.get("id") == self._last_id:
                if "error" in answer:
                    raise ChromiumError(f"{method}: {answer['error'].get('message')}")
                return answer["result"]
            self._handle(answer)

    def _receive(self) -> dict[str, Any]:
        return json.loads(self._socket.recv())

    def _handle(self, event: dict[str, Any]) -> None:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.errors.append(_exception_text(parameters["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            said = (str(a.get("value", a.get("description", ""))) for a in parameters["args"])
            self.errors.append(f"console {parameters['type']}: {' '.join(said)}")
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.errors.append(f"{parameters['entry']['source']}: {parameters['entry']['text']}")
        elif method == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if not url.startswith(("data:", "blob:", "about:")) and url.partition("#")[0] != self.html.as_uri():
                self.requests.append(url)


def _exception_text(details: dict[str, Any]) -> str:
    return details.get("exception", {}).get("description") or details.get("text", "exception")


@dataclass(frozen=True)
class Findings:
    """What `check_report` saw: everything wrong, and the pictures it took."""

    problems: tuple[str, ...]
    figures: tuple[str, ...]
    labels: dict[str, str]
    load_seconds: float
    pdf_pages: int
    files: tuple[Path, ...]


def check_report(
    browser: Chromium, html: Path, folder: Path, no_hover: Sequence[str] = (), pictures: bool = True
) -> Findings:
    """Open `html` at both widths and on paper; the PDF, and screenshots if `pictures`, go to `folder`.

    Looked for: messages in the console, requests of any kind, figures without marks, traces without points, figures
    whose hover shows no label (but `no_hover`, by key), anything wider than the screen (on the narrow one also tables
    of no more than 240 cells), a PDF that is not one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    problems: list[str] = []
    labels: dict[str, str] = {}
    with browser.open(html) as page:
        load_seconds = page.load_seconds
        asked = page.evaluate("document.querySelectorAll('.plot').length")
        drawn = page.figures()
        if asked != len(drawn):
            problems.append(f"{asked} figures in the page, {len(drawn)} drawn")
        problems += _figure_problems(drawn, "wide")
        for index, figure in enumerate(drawn):
            if figure["key"] not in no_hover:
                labels[figure["key"]] = page.hover_text(index)
        problems += [f"{key}: hovering shows no label" for key, text in labels.items() if not text]
        page.evaluate("scrollTo({top: 0, behavior: 'instant'})")
        files = [page.screenshot(folder / "wide.png")] if pictures else []
        pdf = page.print_pdf(folder / "report.pdf")
        files.append(pdf)
        pages = count_pages(pdf)
        if not pages:
            problems.append("printing gives no pages")
        problems += [f"at {WIDE[0]} px: {overflow}" for overflow in page.evaluate("look.overflow()")]
        problems += page.errors + [f"requested {url}" for url in page.requests]
    with browser.open(html, NARROW) as page:
        problems += _figure_problems(page.figures(), "narrow")
        wide = page.evaluate("[...look.overflow(), ...look.sideways()]")
        problems += [f"at {NARROW[0]} px: {overflow}" for overflow in wide]
        if pictures:
            files.append(page.screenshot(folder / "narrow.png"))
        problems += page.errors + [f"requested {url}" for url in page.requests]
    return Findings(
        tuple(dict.fromkeys(problems)), tuple(f["key"] for f in drawn), labels, load_seconds, pages, tuple(files)
    )


def _figure_problems(figures: list[dict[str, Any]], where: str) -> list[str]:
    problems = []
    for figure in figures:
        name = f"{figure['key']} ({where})"
        if not figure["traces"] or not figure["marks"]:
            problems.append(f"{name}: nothing is drawn ({figure['traces']} traces, {figure['marks']} marks)")
        if figure["empty"]:
            problems.append(f"{name}: traces without points: {', '.join(figure['empty'])}")
        if abs(figure["width"] - figure["drawn_width"]) > 1:
            problems.append(f"{name}: drawn {figure['drawn_width']} px wide in a space of {figure['width']} px")
    return problems


def count_pages(pdf: Path) -> int:
    """Pages of a PDF, 0 where the file is none."""
    content = pdf.read_bytes()
    return len(re.findall(rb"/Type\s*/Page\b(?!s)", content)) if content.startswith(b"%PDF-") else 0


def main(arguments: Sequence[str]) -> int:
    if len(arguments) != 2:
        print("usage: python tests/browser/chromium.py REPORT.html FOLDER")
        return 2
    executable = find_chromium()
    if executable is None:
        print("no Chromium found; install Debian's package chromium")
        return 2
    with Chromium(executable) as browser:
        findings = check_report(browser, Path(arguments[0]), Path(arguments[1]))
    print(f"{len(findings.figures)} figures drawn in {findings.load_seconds:.1f} s, {findings.pdf_pages} pages printed")
    for key, text in findings.labels.items():
        print(f"  {key}: hover says {text!r}")
    for file in findings.files:
        print(f"  {file}")
    for problem in findings.problems:
        print(f"PROBLEM {problem}")
    return 1 if findings.problems else 0


if __name__ == "__main__":
    import sys

    sys.exit(main(sys.argv[1:]))
