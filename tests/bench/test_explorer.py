"""Frames a second of the explorer, counted in headless Chromium while a slider is dragged."""

import math
import os
import time

import pytest

from tests.explorer.served import Visitor, browser, running, served

pytestmark = pytest.mark.bench

SECONDS = 5.0
HENON = """
import limitsets as ls
ls.explore(ls.maps.Henon()).show(port=0, show=False, ready=lambda url: print(url, flush=True))
"""
# A picture counts when the figure has been painted with data that came since the last one.
COUNT = """([source, figure]) => {
    const document = Bokeh.documents[0], data = document.get_model_by_name(source)
    const view = Bokeh.index.find_one(document.get_model_by_name(figure)), paint = view.paint.bind(view)
    let fresh = false
    window.painted = 0
    data.properties.data.change.connect(() => { fresh = true })
    view.paint = (...given) => { const done = paint(...given); if (fresh) { painted++; fresh = false } return done }
}"""


def frames_a_second(address: str, source: str, figure: str, slider: int) -> float:
    with browser() as chromium:
        visitor = Visitor(chromium, address)
        visitor.page.wait_for_timeout(3000)
        visitor.page.evaluate(COUNT, [source, figure])
        box = visitor.page.locator(".noUi-handle").nth(slider).bounding_box()
        x, y, mouse = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, visitor.page.mouse
        mouse.move(x, y)
        mouse.down()
        begin = time.perf_counter()
        while (past := time.perf_counter() - begin) < SECONDS:
            mouse.move(x + 60 * math.sin(2 * past), y)
            time.sleep(0.014)  # a hand's mouse says where it is some sixty times a second
        painted: int = visitor.page.evaluate("painted")
        mouse.up()
        return painted / past


@pytest.mark.parametrize("case", ["throw", "henon"])
def test_the_picture_follows_the_slider(case):
    if case == "throw":
        with served() as address:
            found = frames_a_second(address, "limit sets", "lanes", 2)
    else:
        with running("-c", HENON) as address:
            found = frames_a_second(address, "points", "map", 0)
    load = os.getloadavg()[0]
    print(f"{case}: {found:.1f} frames a second (load of the machine {load:.1f}, {os.cpu_count()} cores)")
    if load < 1.5 * (os.cpu_count() or 1):  # a browser, a server and nobody else
        assert found >= 20.0
