"""Cavities and depressions by polygon, against width and depth, and against points on the part's outline."""

import itertools
import math
import tomllib
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.feeding import clear_beyond, proposed_cavity
from limitsets.cell.feeding.crowd import after_next_throw
from limitsets.cell.feeding.falling import arm_end_of, farthest_clear, first_contact
from limitsets.cell.trays.passing import passes_of
from limitsets.checker.scene import read_end
from limitsets.face.animation.picture import cavity_pieces
from limitsets.face.plot.throwing import about_centre, turned
from limitsets.feeder.engine.depression import seat_of, way_down
from limitsets.feeder.engine.member import ground_of
from limitsets.feeder.geometry import side_ends
from limitsets.feeder.scene.arrays import throw_stack
from tests.feeding.scenes import with_cavity

TRAY = {"pitch": "14.04 in", "agitation": "0.4 in", "wash": "1 in"}
RECTANGLE = TRAY | {"depression_width": "7.02 in", "depression_depth": "1.53 in"}
# a bump on the floor, a step in the far wall, the last edge aslant
BUMPY = ((0.0, 0.0), (4.0, -3.0), (5.0, -6.0), (6.5, -3.5), (8.0, -6.0), (8.5, -6.0), (8.5, -2.0), (9.5, 1.0))
# a step at the foot of the ramp, over which a part's front may lean
STEPPED = ((0.0, 0.0), (6.0, -4.5), (6.0, -3.5), (9.5, -3.5), (9.5, 0.0))


def texts(corners):
    """Write corners as a scene does, every digit."""
    return [[f"{x!r} in", f"{y!r} in"] for x, y in corners]


def by_polygon(corners, name="paper-designed", **tables):
    """Give a built-in scene with a cavity of that outline."""
    cavity = {"position": "20 in", "vertices": texts(corners)}
    return ls.load({**ls.load(name).as_dict(), "cavity": cavity, **tables})


def on_side(scene, side):
    """Corners of the part on a side, from the foot of the centre of mass."""
    left, right = side_ends(len(scene.vertices), side)
    along, up = scene.vertices[right] - scene.vertices[left]
    return turned(about_centre(scene), -math.atan2(up, along)) + np.array([0.0, float(scene.sides.d[side])])


def along(corners, count=400):
    """Points on the outline of a part."""
    closed = np.vstack([corners, corners[:1]])
    share = np.linspace(0.0, 1.0, count, endpoint=False)[:, None]
    return np.vstack([one + share * (two - one) for one, two in itertools.pairwise(closed)])


def depth_in(points, outline):
    """How deep points are below a ground without overhangs; its wall goes on upwards."""
    x, y = np.array(outline).T
    ground = np.interp(points[:, 0], x, y)
    ground[(points[:, 0] < 0.0) | (points[:, 0] > x[-1])] = 0.0
    inside = np.where(points[:, 0] > x[-1], points[:, 0] - x[-1], ground - points[:, 1])
    return float(inside[points[:, 0] > 1e-9].max())


# ----------------------------------------------------------------
# The same cavity by its corners.


@pytest.mark.parametrize(
    "changes", [{}, {"depth": "5 in"}, {"width": "8.5 in", "depth": "6 in", "angle": "40 deg"}]
)
def test_the_corners_of_a_cavity_say_what_its_sizes_say(changes):
    scene = with_cavity(**changes)
    same = by_polygon(scene.cavity.line)
    for name in ("position", "width", "depth", "angle"):
        assert getattr(same.cavity, name) == pytest.approx(getattr(scene.cavity, name), rel=1e-12)
    for one, two in zip(ground_of(scene).pieces, ground_of(same).pieces, strict=True):
        assert one.name == two.name
        np.testing.assert_allclose(two.corners, one.corners, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(seat_of(same, 2), seat_of(scene, 2), atol=1e-9)
    for side in range(3):
        np.testing.assert_allclose(clear_beyond(same, side), clear_beyond(scene, side), atol=1e-9)
    for one, two in zip(cavity_pieces(scene, 2.0), cavity_pieces(same, 2.0), strict=True):
        np.testing.assert_allclose(two, one, atol=1e-12)


@pytest.mark.parametrize("sizes", [("7.5 in", "6 in", "45 deg"), ("30 in", "2.5 in", "45 deg")])
def test_a_part_meets_wall_and_floor_where_the_formula_says(sizes):
    """The formula has no ground: it follows each corner's circle to the wall and to the floor."""
    width, depth, angle = sizes
    scene = with_cavity("paper-quadrilateral", width=width, depth=depth, angle=angle)
    same = by_polygon(scene.cavity.line, "paper-quadrilateral")
    formula = [farthest_clear(scene, scene.cavity, k) for k in range(4)]
    most = np.clip(formula, 0.0, scene.sides.a)
    assert [farthest_clear(same, same.cavity, k) for k in range(4)] == pytest.approx(most.tolist(), abs=1e-9)
    assert (most < 0.9 * scene.sides.a).any()  # some part meets something


# ----------------------------------------------------------------
# A bumpy ground, against points on the part.


@pytest.mark.parametrize("side", range(3))
def test_the_first_contact_is_where_points_of_the_part_come_to_the_ground(side):
    scene = by_polygon(BUMPY)
    angle = scene.cavity.angle
    met = []
    for e in (0.2, 1.0, 2.0, 3.0, 4.0):
        corners = on_side(scene, side) + np.array([e, 0.0])
        contact = first_contact(scene.cavity, corners)
        points = along(corners)
        assert depth_in(turned(points, -(contact - 0.01)), BUMPY) < 0.0
        if contact < angle * (1.0 - 1e-9):
            assert depth_in(turned(points, -(contact + 0.01)), BUMPY) > 0.0
            met.append(e)
    most = farthest_clear(scene, scene.cavity, side)
    assert all(e > most for e in met)
    if most < float(scene.sides.a[side]):
        just = [on_side(scene, side) + np.array([most + off, 0.0]) for off in (-1e-6, 1e-6)]
        assert first_contact(scene.cavity, just[0]) > angle - 1e-6 > 0.0
        assert first_contact(scene.cavity, just[1]) < angle


@pytest.mark.parametrize("side", range(3))
@pytest.mark.parametrize("ground", [BUMPY, STEPPED])
def test_a_part_slides_until_its_points_come_to_the_ground(side, ground):
    scene = by_polygon(ground)
    angle = scene.cavity.angle
    down = np.array([math.cos(angle), -math.sin(angle)])
    corners = turned(on_side(scene, side), -angle)
    way = way_down(scene.cavity, corners)
    points = along(corners)
    assert depth_in(points + (way - 0.02) * down + np.array([0.0, 1e-6]), ground) < 0.0
    assert depth_in(points + (way + 0.02) * down + np.array([0.0, 1e-6]), ground) > 0.0


def test_a_ground_is_cut_into_convex_pieces_that_are_all_of_it():
    scene = by_polygon(BUMPY)
    ground = ground_of(scene)
    assert [piece.name for piece in ground.pieces] == ["arm", "ramp", *["floor"] * 4, "wall", "wall"]
    top = {}
    for piece in ground.pieces:
        ways = np.roll(piece.corners, -1, axis=0) - piece.corners
        after = np.roll(ways, -1, axis=0)
        assert (ways[:, 0] * after[:, 1] > ways[:, 1] * after[:, 0]).all()
        for x, y in piece.corners[2:]:
            top.setdefault(round(x - 20.0, 9), set()).add(round(y - ground.height, 9))
    assert all(y in top[x] for x, y in BUMPY)


# ----------------------------------------------------------------
# The room that a part needs.


@pytest.mark.parametrize("name", ["paper-designed", "paper-quadrilateral"])
@pytest.mark.parametrize("side", range(3))
def test_a_cavity_of_the_parts_outline_leaves_the_play(name, side):
    play, angle = 0.3, math.radians(32.0)
    cavity = {"position": "20 in", "outline": "part", "play": "0.3 in", "angle": "32 deg", "side": side}
    scene = ls.load({**ls.load(name).as_dict(), "cavity": cavity})
    outline = np.array(scene.cavity.outline)
    assert scene.cavity.angle == pytest.approx(angle)
    # where the lines beside the part's sides meet, the play outside of them
    corners = turned(on_side(scene, side), -angle)
    ways = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([ways[:, 1], -ways[:, 0]], axis=1) / np.hypot(*ways.T)[:, None]
    offsets = (normals * corners).sum(axis=1) + play
    before = np.roll(np.arange(len(corners)), 1)
    room = np.array([np.linalg.solve(normals[[k, j]], offsets[[k, j]]) for j, k in enumerate(before)])
    room += outline[1] - room[side_ends(len(corners), side)[1]]
    assert room[:, 1].max() == pytest.approx(0.0, abs=1e-9)
    for corner in outline[1:-1]:
        assert np.hypot(*(room - corner).T).min() < 1e-9
    assert tuple(outline[-1]) == pytest.approx((room[:, 0].max(), 0.0), abs=1e-9)
    middle = room.mean(axis=0)
    assert depth_in(along(middle + (1.0 - 1e-6) * (room - middle)), outline) < 0.0
    assert seat_of(scene, side)[:, 1].max() < scene.surface_height


def test_a_depression_of_the_parts_outline_leaves_the_play():
    """A trapezoid on its short side: the walls are as aslant as its legs, the play away from them."""
    corners = [["0 in", "0 in"], ["4 in", "0 in"], ["6 in", "3 in"], ["-1 in", "3 in"]]
    mass = {"center": {"side": 0, "along": "2 in", "above": "1.4 in"}, "radius_of_gyration": "1.5 in"}
    tray = TRAY | {"outline": "part", "play": "0.25 in", "side": 0, "depression_depth": "1.2 in"}
    tables = {"part": {"vertices": corners, "mass": mass}, "tray": tray, "goal": {"stays_on_arm": True}}
    scene = ls.load({**ls.load("paper-designed").as_dict(), **tables})
    outline = np.array(scene.tray.outline)
    assert outline[:, 1].tolist() == pytest.approx([0.0, -1.2, -1.2, 0.0])
    ways = np.diff(outline, axis=0)
    assert (ways[[0, 2], 1] / ways[[0, 2], 0]).tolist() == pytest.approx([-3.0, 1.5])
    # a leg's wall is 0.25 off along its normal; the floor is 0.25 below the side
    foot = 4.0 + 0.25 * math.hypot(3.0, 2.0) / 3.0 - 0.25 * 2.0 / 3.0
    other = -0.25 * math.hypot(3.0, 1.0) / 3.0 + 0.25 / 3.0
    assert outline[2, 0] - outline[1, 0] == pytest.approx(foot - other)


# ----------------------------------------------------------------
# Trays, deviations, files.


def with_tray(**tray):
    tables = {"tray": tray, "world": {"friction": 0.3, "restitution": 0.3}, "effects": {"contact": True}}
    return ls.load({**ls.load("paper-designed").as_dict(), **tables})


def test_the_corners_of_a_depression_say_what_its_sizes_say():
    corners = texts([(0.0, 0.0), (0.0, -1.53), (7.02, -1.53), (7.02, 0.0)])
    one, two = (passes_of(with_tray(**each), 2, 4e-3) for each in (RECTANGLE, TRAY | {"vertices": corners}))
    for before, after in zip(one.plate.ground(), two.plate.ground(), strict=True):
        np.testing.assert_array_equal(after, before)
    assert (two.tray.floor, two.to_json()) == (one.tray.floor, one.to_json())


@pytest.mark.parametrize("side", range(3))
def test_a_depression_of_the_parts_outline_has_a_level_floor_for_it(side):
    """Turned onto a side, both of its ends have the same height, in spite of rounding."""
    tray = TRAY | {"outline": "part", "play": "0.1 in", "depression_depth": "1.5 in", "side": side}
    scene = ls.load({**ls.load("paper-designed").as_dict(), "tray": tray, "goal": {"attracts_all": True}})
    lo, hi = scene.tray.floor
    assert hi - lo > float(scene.sides.length[side])


def test_a_part_stays_in_a_depression_with_slanted_walls():
    corners = texts([(0.0, 0.0), (1.5, -1.5), (8.4, -1.5), (8.6, 0.0)])
    passes = passes_of(with_tray(**TRAY, vertices=corners), 2, 4e-3)
    middle = 0.5 * (1.5 + 8.4) - 4.3
    seated = passes.plate.seated(2, middle)
    rest = passes.plate.settle(
        seated, passes.kick(np.random.default_rng(0))._replace(up=0.0, along=0.0, turning=0.0)
    )
    assert rest.state == passes.right
    assert rest.pose.x == pytest.approx(seated.x, abs=1e-3)


def test_an_outline_follows_the_part_in_deviations():
    """A cavity of the part's own room fits a longer part too; one of a width does not."""
    room = {"position": "20 in", "outline": "part", "play": "0.1 in", "angle": "32 deg"}
    longer = {"part.sides[2]": np.array([6.75, 7.2])}
    scenes = [
        with_cavity(width="7 in", depth="4 in"),
        ls.load({**ls.load("paper-designed").as_dict(), "cavity": room}),
    ]
    assert [throw_stack(scene, longer).possible.tolist() for scene in scenes] == [[True, False], [True, True]]


@pytest.mark.parametrize(
    "cavity", [{"vertices": texts(BUMPY)}, {"outline": "part", "play": "1 mm", "angle": "30 deg"}]
)
def test_the_checker_reads_where_the_arm_ends(cavity):
    assert read_end({"position": "20 in", **cavity}, Fraction(254, 10000)) == 20


# ----------------------------------------------------------------
# The next throw, and a cavity that is proposed.


@pytest.mark.parametrize(
    ("kappa", "height", "word"), [("1000 in", "-0.2 in", "seated"), ("10 in", "7 in", "left")]
)
def test_whether_a_seated_part_stays_at_the_next_throw(kappa, height, word):
    """It rises by x^2/(2 kappa), 0.3 in or 30 in, and drifts inward by 2 x y/kappa, not at all or 17 in."""
    tree = with_cavity(tables={"throw": {"kappa": kappa}}).as_dict()
    scene = ls.load({**tree, "arm": tree["arm"] | {"surface_height": height}})
    assert after_next_throw(arm_end_of(scene)) == word


def test_without_a_seat_nothing_is_said_of_the_next_throw():
    assert after_next_throw(arm_end_of(with_cavity(depth="2 in"))) is None


@pytest.mark.parametrize("name", ["paper-designed", "paper-triangle", "paper-quadrilateral"])
def test_a_proposed_cavity_feeds_and_is_hardly_wider_than_it_has_to_be(name):
    plain = {key: value for key, value in ls.load(name).as_dict().items() if key != "cavity"}
    text = proposed_cavity(ls.load(plain))
    cavity = tomllib.loads(text)["cavity"]
    scene = ls.load({**plain, "cavity": cavity})
    end = arm_end_of(scene)
    a = float(scene.sides.a[end.side])
    assert end.clear == ((0.0, pytest.approx(min(a, scene.arm_length - end.x))),)
    assert seat_of(scene, end.side)[:, 1].max() <= scene.surface_height
    counts = ls.feed(scene, trials=300, prove=False).trials.counts
    assert counts["right"] > 150
    assert counts["wrong"] == counts["wall"] == 0
    # 4 % narrower (2 %, and three digits) a part meets the wall, or stands out of its seat
    cavity = replace(scene.cavity, width=0.96 * scene.cavity.width, depth=0.96 * scene.cavity.depth)
    if farthest_clear(scene, cavity, end.side) >= end.clear[0][1]:
        with pytest.raises(AnswerError, match="standing out"):
            seat_of(replace(scene, cavity=cavity), end.side)
