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
# A picture counts when the canvas has been painted with other data than at the last count, and the screen has come to
# the next frame.
COUNT = """(canvas, name) => {
    const pen = canvas.getContext("2d"), clear = pen.clearRect.bind(pen)
    const data = () => JSON.stringify(canvas.shown.layers.find((layer) => layer.called === name))
    let last = data()
    window.painted = 0
    pen.clearRect = (...given) => {
        clear(...given)
        const now = data()
        if (now !== last) { last = now; requestAnimationFrame(() => { painted++ }) }
    }
}"""


def frames_a_second(address: str, layer: str, picture: str, slider: int, back: float = 0.0) -> float:
    with browser() as chromium:
        visitor = Visitor(chromium, address)
        visitor.page.wait_for_timeout(3000)
        visitor.canvas(picture).evaluate(COUNT, layer)
        (x, y), mouse = visitor.handle(slider), visitor.page.mouse
        mouse.move(x, y)
        mouse.down()
        begin = time.perf_counter()
        while (past := time.perf_counter() - begin) < SECONDS:
            mouse.move(x + 60 * (math.sin(2 * past) - back), y)
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
            # to values below the first: beyond a = 1.43 all orbits leave, and pictures without points are the same
            found = frames_a_second(address, "points", "map", 0, back=1.0)
    load = os.getloadavg()[0]
    print(f"{case}: {found:.1f} frames a second (load of the machine {load:.1f}, {os.cpu_count()} cores)")
    if load < 1.5 * (os.cpu_count() or 1):  # a browser, a server and nobody else
        assert found >= 20.0
