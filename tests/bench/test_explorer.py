"""Frames a second of the explorer, counted in headless Chromium while a slider is dragged."""

import math
import os
import time
from typing import NamedTuple

import pytest

from tests.browsers import browser
from tests.explorer.served import Visitor, running, served

pytestmark = pytest.mark.bench

SECONDS = 5.0
EXPLORED = """
import limitsets as ls
ls.explore({}).show(port=0, show=False, ready=lambda url: print(url, flush=True))
"""
HENON = EXPLORED.format("ls.maps.Henon()")
# With the surface at the joint the displacement is small beside a cell, in thousands of them.
AT_JOINT = EXPLORED.format('ls.load("paper-designed").with_values({"arm.surface_height": 0.05})')


class Hand(NamedTuple):
    """How a slider is dragged: so many pixels to either side, so many radians a second, about a place further on."""

    pixels: float = 60.0
    speed: float = 2.0
    back: float = 0.0


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


def frames_a_second(address: str, layer: str, picture: str, slider: int, hand: Hand) -> float:
    with browser() as chromium:
        visitor = Visitor(chromium, address)
        visitor.page.wait_for_timeout(3000)
        visitor.canvas(picture).evaluate(COUNT, layer)
        (x, y), mouse = visitor.handle(slider), visitor.page.mouse
        mouse.move(x, y)
        mouse.down()
        begin = time.perf_counter()
        while (past := time.perf_counter() - begin) < SECONDS:
            mouse.move(x + hand.pixels * (math.sin(hand.speed * past) - hand.back), y)
            time.sleep(0.014)  # a hand's mouse says where it is some sixty times a second
        painted: int = visitor.page.evaluate("painted")
        mouse.up()
        return painted / past


@pytest.mark.parametrize("case", ["throw", "at the joint", "henon"])
def test_the_picture_follows_the_slider(case):
    if case == "throw":
        with served() as address:
            found = frames_a_second(address, "limit sets", "lanes", 2, Hand())
    elif case == "at the joint":
        with running("-c", AT_JOINT) as address:
            # 24 steps of the slider, from -0.035 to 0.135 in: a slow hand would be counted, not the computation
            found = frames_a_second(address, "limit sets", "lanes", 3, Hand(pixels=12.0, speed=6.0))
    else:
        with running("-c", HENON) as address:
            # to values below the first: beyond a = 1.43 all orbits leave, and pictures without points are the same
            found = frames_a_second(address, "points", "map", 0, Hand(back=1.0))
    load = os.getloadavg()[0]
    print(f"{case}: {found:.1f} frames a second (load of the machine {load:.1f}, {os.cpu_count()} cores)")
    if load < 1.5 * (os.cpu_count() or 1):  # a browser, a server and nobody else
        assert found >= 20.0
