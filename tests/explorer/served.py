"""A server of its own for a test, and one who looks at its page."""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

HANDLE = 16.0  # of the browser's own slider [pixels]


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
            assert said.startswith(("explorer: ", "http")), said  # no other line before it
            yield found[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)


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
        self.page.wait_for_selector("input[type=range]", timeout=60_000)
        self.page.wait_for_function("window.Bokeh && Bokeh.documents.length > 0")
        self.page.locator("canvas[data-name]").first.wait_for()

    def columns(self, name: str) -> dict[str, list[Any]]:
        """Give what a picture shows, by the name of its layer."""
        script = (
            "(all, name) => all.flatMap((each) => each.shown.layers).find((each) => each.called === name)"
        )
        found: dict[str, Any] = self.page.locator("canvas[data-name]").evaluate_all(script, name)
        return {key: value for key, value in found.items() if isinstance(value, list)}

    def cells(self) -> dict[str, dict[str, float]]:
        """Give the places of the cells of the page."""
        names = ("title", "error", "sliders", "pictures", "proved", "estimated", "part", "atlas")
        return {name: self.page.locator(f".{name}").bounding_box() for name in names}

    def canvas(self, name: str) -> Any:
        """Find a picture."""
        return self.page.locator(f'canvas[data-name="{name}"]')

    def changed(self, name: str, before: Any) -> Any:
        """Wait until a layer holds something else than before."""
        for _ in range(200):
            now = self.columns(name)
            if now != before:
                return now
            self.page.wait_for_timeout(50)
        pytest.fail(f"{name} did not change")

    def settled(self, name: str) -> Any:
        """Wait until a layer has held the same for a second."""
        last, same = self.columns(name), 0
        for _ in range(200):
            self.page.wait_for_timeout(100)
            now = self.columns(name)
            last, same = now, same + 1 if now == last else 0
            if same == 10:
                return now
        pytest.fail(f"{name} did not settle")

    def figure(self, name: str) -> dict[str, float]:
        """Say where the frame of a picture is on the screen."""
        script = """canvas => { const at = canvas.getBoundingClientRect(), frame = canvas.frame;
            return {...frame, left: at.left + frame.left, top: at.top + frame.top} }"""
        found: dict[str, float] = self.canvas(name).evaluate(script)
        return found

    def at(self, name: str, x: float, y: float) -> tuple[float, float]:
        """Give the place on the screen of a point of a picture, after scrolling it into sight."""
        self.canvas(name).evaluate("canvas => canvas.scrollIntoView({block: 'center'})")
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
        x, y = self.handle(number)
        self.drag((x, y), (x + by, y))

    def handle(self, number: int) -> tuple[float, float]:
        """Say where the handle of a slider is on the screen."""
        bar = self.page.locator("input[type=range]").nth(number)
        bar.scroll_into_view_if_needed()
        box = bar.bounding_box()
        share = bar.evaluate("bar => (bar.value - bar.min) / (bar.max - bar.min)")
        return box["x"] + HANDLE / 2 + share * (box["width"] - HANDLE), box["y"] + box["height"] / 2
