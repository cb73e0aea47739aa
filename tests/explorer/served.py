"""A server of its own for a test, and Debian's Chromium to look at it."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

ARGS = [
    "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run",
]  # fmt: skip
CHROMIUM = Path("/usr/bin/chromium")


@contextmanager
def served(*options: str) -> Iterator[str]:
    """Run `limitsets explore` with options; the page's address."""
    with running("-m", "limitsets", "explore", "--no-show", "--port", "0", *options) as address:
        yield address


@contextmanager
def running(*arguments: str) -> Iterator[str]:
    """Run Python with a server that says its address in the first line; end it with Ctrl-C."""
    command = [sys.executable, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            said = process.stdout.readline()
            found = re.search(r"http://\S+", said)
            assert found, said
            yield found[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)


@contextmanager
def browser() -> Iterator[Any]:
    """Start Chromium."""
    from playwright.sync_api import sync_playwright

    if not CHROMIUM.exists():
        pytest.fail(f"{CHROMIUM} is missing: apt-get install chromium (as root), or bash .ci/run as root")
    os.environ.setdefault("PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD", "1")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=str(CHROMIUM), args=ARGS)
        try:
            yield started
        finally:
            started.close()


class Visitor:
    """One who looks at a page: what the browser complains of and whom it asks is written down."""

    def __init__(self, browser: Any, address: str, **options: Any) -> None:
        self.page = browser.new_context(**{"viewport": {"width": 1440, "height": 900}} | options).new_page()
        self.complaints: list[str] = []
        self.asked: list[str] = []
        self.page.on(
            "console",
            lambda said: self.complaints.append(said.text) if said.type in ("error", "warning") else None,
        )
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(address)
        self.page.wait_for_selector(".noUi-handle", timeout=60_000)
        self.page.wait_for_function("window.Bokeh && Bokeh.documents.length > 0")

    def columns(self, name: str) -> dict[str, list[Any]]:
        """Give what a picture shows, by the name of its source."""
        script = """name => { const data = Bokeh.documents[0].get_model_by_name(name).data;
            return Object.fromEntries(Object.entries(data).map(([key, value]) => [key, Array.from(value)])) }"""
        found: dict[str, list[Any]] = self.page.evaluate(script, name)
        return found

    def changed(self, name: str, before: Any) -> Any:
        """Wait until a source holds something else than before."""
        for _ in range(200):
            now = self.columns(name)
            if now != before:
                return now
            self.page.wait_for_timeout(50)
        pytest.fail(f"{name} did not change")

    def settled(self, name: str) -> Any:
        """Wait until a source has held the same for a second."""
        last, same = self.columns(name), 0
        for _ in range(200):
            self.page.wait_for_timeout(100)
            now = self.columns(name)
            last, same = now, same + 1 if now == last else 0
            if same == 10:
                return now
        pytest.fail(f"{name} did not settle")

    def figure(self, name: str) -> dict[str, float]:
        """Say where the frame of a figure is on the screen."""
        script = """name => { const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name(name));
            const box = view.frame.bbox, at = view.canvas_view.el.getBoundingClientRect(),
                [x, y] = [view.frame.x_scale, view.frame.y_scale];
            const ranges = [x.source_range, y.source_range];
            return {left: at.left + box.left, top: at.top + box.top, width: box.width, height: box.height,
                x0: ranges[0].start, x1: ranges[0].end, y0: ranges[1].start, y1: ranges[1].end} }"""
        found: dict[str, float] = self.page.evaluate(script, name)
        return found

    def at(self, name: str, x: float, y: float) -> tuple[float, float]:
        """Give the place on the screen of a point of a figure, after scrolling it into sight."""
        self.page.evaluate(
            """name => Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name(name)).el
                .scrollIntoView({block: 'center'})""",
            name,
        )
        box = self.figure(name)
        across = (x - box["x0"]) / (box["x1"] - box["x0"])
        up = (y - box["y0"]) / (box["y1"] - box["y0"])
        return box["left"] + across * box["width"], box["top"] + (1 - up) * box["height"]

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag with the mouse."""
        self.page.mouse.move(*start)
        self.page.mouse.down()
        self.page.mouse.move(*end, steps=5)
        self.page.mouse.up()

    def slide(self, number: int, by: float) -> None:
        """Drag the handle of a slider [pixels]."""
        box = self.page.locator(".noUi-handle").nth(number).bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.drag((x, y), (x + by, y))
