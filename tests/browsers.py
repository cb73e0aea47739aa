"""What tests look at pages with: a reader of HTML, and any Chromium, Chrome or Edge that is installed."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

COMMANDS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge",
    "microsoft-edge-stable", "msedge",
)  # fmt: skip
PROGRAMS = {
    "darwin": (
        "/Applications/Chromium.app/Contents/MacOS/Chromium",
        "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
        "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    ),
    "win32": (
        r"C:\Program Files\Google\Chrome\Application\chrome.exe",
        r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    ),
}
ARGS = [
    "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run",
]  # fmt: skip
REQUIRED = "LIMITSETS_TESTS_NEED_BROWSER"  # set by .ci/run, which installs a browser
REASON = "no Chromium, Chrome or Edge is installed"


class Page(HTMLParser):
    """Read tags with their attributes, and texts with the tag around them and its id; every tag is closed."""

    VOID = ("meta", "img", "br", "hr", "link", "input", "circle", "polygon", "polyline")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str | None, str]] = []
        self.open: list[tuple[str, str | None]] = []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in self.VOID:
            self.open.append((tag, dict(attrs).get("id")))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.texts.append((*self.open[-1], data))


def installed() -> str | None:
    """Find the program of a browser; None where there is none."""
    programs = (path for path in PROGRAMS.get(sys.platform, ()) if Path(path).exists())
    return next((found for name in COMMANDS if (found := shutil.which(name))), next(programs, None))


@contextmanager
def browser() -> Iterator[Any]:
    """Start the browser; leave the test out where there is none, and fail where there has to be one."""
    program = installed()
    if program is None:
        (pytest.fail if os.environ.get(REQUIRED) else pytest.skip)(REASON)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=ARGS)
        try:
            yield started
        finally:
            started.close()
