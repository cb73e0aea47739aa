"""The explorer's page in a browser, and in a notebook."""

import re
import socket
from itertools import combinations
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from playwright.sync_api import expect

import limitsets as ls
from limitsets.face.explorer.estimates import estimate
from tests.browsers import browser
from tests.explorer.served import Visitor, served

pytestmark = pytest.mark.sweep


# ----------------------------------------------------------------
# The page in a headless browser: what a visitor sees and touches, and what two of them do to each other.


SPEED = 2  # the third slider
CELLS = {
    "title": 0,
    "error": 1,
    "sliders": 0,
    "pictures": 1,
    "proved": 0,
    "estimated": 1,
    "part": 2,
    "atlas": 0,
}


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Serve paper-designed with a goal that is refuted at once: proofs go on behind each page until it is forgotten."""
    tree = ls.load("paper-designed").as_dict() | {"goal": {"oriented_beyond": {"x": "18 in", "side": 2}}}
    file = tmp_path_factory.mktemp("served") / "paper-designed.toml"
    file.write_text(ls.dump(ls.load(tree)), encoding="utf-8")
    with served(str(file)) as found:
        yield found


@pytest.fixture(scope="module")
def chromium():
    with browser() as started:
        yield started


@pytest.fixture
def visitor(chromium, address):
    one = Visitor(chromium, address)
    yield one
    assert one.complaints == []
    host = urlsplit(address).netloc
    assert [url for url in one.asked if urlsplit(url).netloc not in (host, "")] == []  # nothing from outside
    one.page.context.close()


def test_a_slider_moves_the_picture(visitor):
    sets, points = visitor.columns("limit sets"), visitor.columns("critical points")
    visitor.slide(SPEED, 40)
    assert visitor.changed("limit sets", sets)["right"] != sets["right"]
    assert visitor.changed("critical points", points)["x"] != points["x"]


def test_the_picture_is_of_where_the_slider_rests(visitor):
    (x, y), mouse = visitor.handle(SPEED), visitor.page.mouse
    mouse.move(x, y)
    mouse.down()
    for step in range(60):  # faster than values are sent
        mouse.move(x + step, y)
    mouse.up()
    rests = rests_at(visitor)
    field = visitor.page.get_by_label("speed, typed")
    expect(field).to_have_value(re.compile(r"^1[6-9]\d"))
    expect(field).to_have_value(f"{rests:.6g} deg/s")


def test_arrow_keys_move_a_slider_that_has_the_focus(visitor):
    sets = visitor.columns("limit sets")
    handle = visitor.page.locator("input[type=range]").nth(SPEED)
    handle.focus()
    visitor.page.keyboard.press("ArrowRight")  # of the keyboard's focus browsers draw the outline
    style = handle.evaluate(
        "each => { const look = getComputedStyle(each); return [look.outlineStyle, look.outlineWidth]; }"
    )
    assert style[0] != "none"
    assert float(style[1].removesuffix("px")) >= 2  # WCAG 2.4.13 asks for 2
    visitor.changed("limit sets", sets)


def test_a_bad_value_is_said_and_the_picture_stays(visitor):
    sets, places = visitor.columns("limit sets"), visitor.cells()
    field = visitor.page.get_by_label("speed, typed")
    field.fill("very fast")
    field.press("Enter")
    wrong = visitor.page.locator(".wrong")
    wrong.wait_for()
    assert "very fast" in wrong.inner_text()
    assert visitor.cells() == places  # the room of the line is kept
    assert visitor.columns("limit sets") == sets
    field.fill("150 deg/s")
    field.press("Enter")
    visitor.changed("limit sets", sets)
    wrong.wait_for(state="detached")


def test_the_rows_have_the_same_columns_and_the_arm_lies_below_its_x(visitor):
    cells = visitor.cells()
    lefts = sorted({box["x"] for box in cells.values()})
    assert len(lefts) == 3
    for called, column in CELLS.items():
        assert cells[called]["x"] == lefts[column]
    sliders, proved, pictures = cells["sliders"], cells["proved"], cells["pictures"]
    assert proved["y"] < sliders["y"] + sliders["height"] + 20  # right below the sliders
    assert proved["y"] < 500  # of 900: room for what is proved
    right = {box["x"] + box["width"] for box in (pictures, cells["part"])}
    assert len(right) == 1
    lanes, arm = (visitor.figure(name) for name in ("lanes", "the arm"))
    for edge in ("left", "width", "x0", "x1"):
        assert arm[edge] == pytest.approx(lanes[edge], abs=1e-6)
    assert arm["height"] / (arm["y1"] - arm["y0"]) == pytest.approx(arm["width"] / (arm["x1"] - arm["x0"]))


def test_a_click_in_a_lane_throws_from_there(visitor):
    part = visitor.columns("part")
    visitor.page.mouse.click(*visitor.at("lanes", 21.0, -2.0))
    visitor.changed("part", part)
    expect(visitor.canvas("the arm")).to_have_attribute("aria-label", re.compile("^Throw "))


def test_the_centre_of_mass_can_be_dragged(visitor):
    mark, points = visitor.columns("centre of mass"), visitor.columns("critical points")
    x, y = mark["x"][0], mark["y"][0]
    visitor.drag(visitor.at("the part", x, y), visitor.at("the part", x + 0.1, y + 0.1))
    visitor.changed("critical points", points)
    assert visitor.columns("centre of mass")["x"][0] == pytest.approx(x + 0.1, abs=0.05)


def test_a_part_is_drawn_by_clicking_its_corners(visitor):
    basins = visitor.settled("basins")
    visitor.page.get_by_role("button", name="Draw a part").click()
    field = visitor.page.get_by_label("corners x,y")
    for count, corner in enumerate(((0.5, 0.2), (5.0, 0.2), (5.0, 2.5), (0.5, 2.5)), start=1):
        visitor.page.mouse.click(*visitor.at("the part", *corner))
        expect(field).to_have_value(re.compile(rf"(\S+ ?){{{count}}}"))
        visitor.page.wait_for_timeout(400)  # two clicks at once are a double click
    visitor.page.get_by_role("button", name="Done").click()
    bottoms = visitor.changed("basins", basins)["bottom"]
    assert min(bottoms) == pytest.approx(-3.3)  # of side 3: there are four


def test_what_is_saved_is_what_is_shown(visitor, tmp_path):
    sets = visitor.columns("limit sets")
    field = visitor.page.get_by_label("height of the surface, typed")
    field.fill("-0.3 in")
    field.press("Enter")
    visitor.changed("limit sets", sets)
    with visitor.page.expect_download() as download:
        visitor.page.get_by_text("Save the scene (TOML)").click()
    download.value.save_as(tmp_path / "saved.toml")
    assert ls.load(tmp_path / "saved.toml").surface_height == -0.3


def test_two_visitors_at_once_do_not_disturb_each_other(chromium, address, visitor):
    other = Visitor(chromium, address)
    sets = other.columns("limit sets")
    visitor.slide(SPEED, 60)
    assert rests_at(visitor) > rests_at(other)
    shows_where_it_rests(visitor)
    assert other.columns("limit sets") == sets
    other.slide(SPEED, -60)
    shows_where_it_rests(other)
    shows_where_it_rests(visitor, rounds=1)
    assert other.complaints == []
    other.page.context.close()


def rests_at(visitor):
    return float(visitor.page.locator("input[type=range]").nth(SPEED).input_value())


def shows_where_it_rests(visitor, rounds=600):
    """Wait until the limit sets are those of the speed at which the slider rests: a slow server is behind the hand."""
    scene = ls.load("paper-designed").with_values({"throw.speed": f"{rests_at(visitor)!r} deg/s"})
    sets = [part for each in estimate(scene).sets for parts in each.values() for part in parts]
    for _ in range(rounds):
        shown = visitor.columns("limit sets")
        drawn = list(zip(shown["left"], shown["right"], strict=True))
        if len(drawn) == len(sets) and np.allclose(drawn, sets, rtol=1e-9, atol=0.0):
            return
        visitor.page.wait_for_timeout(100)
    pytest.fail(f"{drawn} is shown, {sets} are at {scene.value('throw.speed')!r}")


def test_a_hostile_scene_does_nothing(visitor, tmp_path):
    sets = visitor.columns("limit sets")
    visitor.page.get_by_role("button", name=re.compile("Scene as text")).click()
    text = visitor.page.get_by_label("the scene as text")
    for hostile in (
        "/etc/passwd",
        "name = '<img src=x onerror=document.title=1>'\n[part]\nfile = '/etc/passwd'",
    ):
        text.fill(hostile)
        visitor.page.get_by_role("button", name="Use this text").click()
        wrong = visitor.page.locator(".wrong")
        wrong.wait_for()
        assert "root:" not in wrong.inner_text()
        assert visitor.page.title() != "1"
    assert visitor.columns("limit sets") == sets


def test_a_phone_shows_it_in_one_column(chromium, address):
    phone = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
    one = Visitor(chromium, address, **phone)
    assert one.page.evaluate("document.documentElement.scrollWidth") == 390
    assert {box["x"] for box in one.cells().values()} == {10}
    boxes = one.canvas("lanes").evaluate("canvas => canvas.boxes")
    assert len(boxes) == 5  # three critical points, the threshold, the goal
    assert all(box["h"] >= 0 and box["h"] + box["wide"] <= 390 for box in boxes)
    for first, second in combinations(boxes, 2):
        beside = first["h"] + first["wide"] <= second["h"] or second["h"] + second["wide"] <= first["h"]
        assert beside or abs(first["v"] - second["v"]) >= first["high"]
    assert one.complaints == []
    one.page.context.close()


def test_a_finger_drags_the_centre_of_mass_and_does_not_scroll(chromium, address):
    phone = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
    one = Visitor(chromium, address, **phone)
    mark = one.columns("centre of mass")
    x, y = one.at("the part", mark["x"][0], mark["y"][0])
    scrolled, finger = one.page.evaluate("scrollY"), one.page.context.new_cdp_session(one.page)
    for kind, far in (("touchStart", 0), *(("touchMove", 3 * k) for k in range(1, 9)), ("touchEnd", None)):
        points = [] if far is None else [{"x": x, "y": y - far}]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    one.changed("centre of mass", mark)
    assert one.settled("centre of mass")["y"][0] > mark["y"][0]
    assert one.page.evaluate("scrollY") == scrolled
    one.page.context.close()


def test_it_listens_on_this_machine_alone(address):
    port = urlsplit(address).port
    assert urlsplit(address).hostname == "127.0.0.1"
    rows = [row.split() for row in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]]
    places = [row[1].split(":") for row in rows if row[3] == "0A"]  # those that listen
    assert {host for host, at in places if int(at, 16) == port} == {"0100007F"}  # 127.0.0.1


def test_a_page_of_elsewhere_gets_no_connection(address):
    port = urlsplit(address).port
    with socket.create_connection(("127.0.0.1", port), 10) as line:
        line.sendall(
            b"GET /ws HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Origin: http://elsewhere.example\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            b"Sec-WebSocket-Version: 13\r\n\r\n"
        )
        assert b"403" in line.recv(200)


def test_a_click_in_the_atlas_opens_that_feeder(visitor):
    sets = visitor.columns("limit sets")
    visitor.page.get_by_role("button", name=re.compile("Atlas")).click()
    visitor.page.get_by_role("button", name=re.compile("Compute")).click()
    visitor.page.get_by_text("estimated, not proved").wait_for(timeout=300_000)
    visitor.page.wait_for_timeout(1000)
    visitor.page.mouse.click(*visitor.at("atlas", 150.0, -0.4))
    sets = visitor.changed("limit sets", sets)
    assert visitor.page.get_by_label("speed, typed").input_value().endswith("deg/s")
    visitor.canvas("atlas").focus()
    for key in ("ArrowRight", "ArrowUp", "Enter"):
        visitor.page.keyboard.press(key)
    visitor.changed("limit sets", sets)


# ----------------------------------------------------------------
# The page in a notebook: a kernel without JupyterLab, and what it sends to a browser.


SHOWN = """
import asyncio
import limitsets as ls

explorer, pages = ls.explore("paper-designed"), []
make = explorer.page
explorer.page = lambda: pages.append(make()) or pages[-1]
explorer
"""
MOVED = """
page = pages[-1]
page.sliders.put({"throw.speed": 150.0})
await asyncio.sleep(0.3)
print(page.scene.kappa > 26)
page.arm.canvas._handle_msg("seen")  # what the browser says of a picture that is there
await asyncio.sleep(1.0)
print(page.scene.kappa > 26)
"""
THREADS = """
import threading
import panel as pn

layout = next(view for view, *_ in pn.state._views.values() if isinstance(view, pn.Column))
taken = []
pn.Column._on_msg = lambda *_: taken.append(threading.current_thread())
threading.Thread(target=lambda: layout._on_msg("ref", None, {})).start()  # as JupyterLab does since 4.4
await asyncio.sleep(0.3)
print(taken == [threading.main_thread()])
"""


def test_a_notebook_shows_it_without_the_internet_and_it_beats_once_it_is_seen():
    nbformat = pytest.importorskip("nbformat", reason="notebooks")
    nbclient = pytest.importorskip("nbclient", reason="notebooks")
    pytest.importorskip("ipykernel", reason="notebooks")
    cells = [nbformat.v4.new_code_cell(cell) for cell in (SHOWN, MOVED, THREADS)]
    book = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(book, timeout=600, kernel_name="python3").execute()
    shown, moved, threads = (cell.outputs for cell in book.cells)
    assert not [each for each in shown if each.output_type == "stream"]  # no warning
    bundles = [each["data"] for each in shown if "data" in each]
    assert any("Bokeh" in data.get("text/html", "") for data in bundles)
    scripts = "".join(data.get("application/javascript", "") for data in bundles)
    assert len(scripts) > 1_000_000  # they come along
    assert set(re.findall(r"js_urls = (\[.*\])", scripts)) == {"[]"}
    assert "".join(each["text"] for each in moved) == "False\nTrue\n"
    assert threads[0]["text"] == "True\n"
