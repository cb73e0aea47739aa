"""Certified regions: what is proved of a cell holds at parameters drawn in it, and a spoiled certificate is refused."""

from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.end_points import Piece, Throws, unproved_of
from limitsets.checker.region import MOST_CUT
from limitsets.checker.scene import read_scene
from limitsets.parameters.regions import (
    Block,
    CellAxis,
    Record,
    Regions,
    certified,
    certify_cell,
    evenly,
    largest_square,
    roomiest,
)
from limitsets.parameters.regions.plane import regions
from limitsets.parameters.regions.record import Visit, visit
from limitsets.systems.maps import images, orbit
from tests.proofs.forge import Forged, opened, put

X = 20.0


@pytest.fixture(scope="module")
def plane():
    """Part of the border between feeders that have the goal and feeders that do not."""
    speeds = ("155", "155.25", "155.5", "158.25", "158.5")
    speed = CellAxis.of("throw.speed", [f"{each} deg/s" for each in speeds])
    height = evenly("arm.surface_height", "-0.22 in", "-0.2 in", 2)
    return certified("paper-designed", speed, height, depth=1)


@pytest.fixture(scope="module")
def level():
    """Cells that touch the height 0, where nothing is known of starts next to the joint."""
    speed = evenly("throw.speed", "157 deg/s", "157.5 deg/s", 2)
    return certified("paper-designed", speed, evenly("arm.surface_height", "-0.01 in", "0 in", 2), depth=0)


@pytest.fixture(scope="module")
def files(plane, level, tmp_path_factory):
    folder, planes = tmp_path_factory.mktemp("planes"), {"plane": plane, "level": level}
    return {name: held.save(folder / f"{name}.proof.zip") for name, held in planes.items()}


def set_at(f, name, at, value):
    f.arrays[name][at] = value


def drawn(found: Regions, k: int, rng):
    """A scene with parameters drawn in a cell."""
    a, b, c, d = found.index[k].tolist()
    values = {
        axis.quantity: f"{rng.uniform(float(axis.borders[lo]), float(axis.borders[hi]))!r} {axis.unit}"
        for axis, lo, hi in ((found.axes[0], a, b), (found.axes[1], c, d))
    }
    return found.scene.with_values(values)


# ------------------------------------------------------------------------------------------------- the records


def test_proved_refuted_and_undecided_are_all_there_and_make_up_the_plane(plane):
    assert set(plane.code.tolist()) == {0, 1, 2}
    assert sum(plane.shares().values()) == pytest.approx(1.0, abs=1e-12)
    assert (np.bincount(plane.raster().ravel(), minlength=len(plane.index)) > 0).all()
    # only what stays undecided is halved
    wide = plane.index[:, 1] - plane.index[:, 0] == 2
    assert (plane.code[wide] > 0).all()
    assert (plane.code[~wide] == 0).any()


def test_orbits_of_parameters_drawn_in_a_cell_do_what_its_record_says(plane):
    rng = np.random.default_rng(3)
    for k, record in enumerate(plane.records):
        scene = drawn(plane, k, rng)
        settled = orbit(scene.map, 15.0, 2, 3000)
        path = orbit(scene.map, float(settled.x[-1]), int(settled.side[-1]), 20_000)
        (block,) = record.blocks
        for side, parts in block.extents.items():
            x = path.x[path.side == side]
            assert np.any([(lo <= x) & (x <= hi) for lo, hi in parts], axis=0).all()
        beyond = ((path.x > X) & (path.side != 2)).any()
        assert not (beyond and record.goal == "proved")
        assert beyond or record.goal != "refuted"
        flips = np.flatnonzero(path.code == 1)
        visits, sides = np.diff(flips) - 1, path.side[flips[1:]]
        for side in range(3):
            own = visits[sides == side]
            assert block.jogs[side].least <= own.min()
            assert own.max() <= block.jogs[side].most
        assert block.flip_order == (0, 1, 2)


@pytest.mark.sweep
def test_every_parameter_has_the_periodic_orbit_that_refutes(plane):
    """The orbit of a parameter is found by going backward along the chain, which contracts: 15 times round it."""
    rng = np.random.default_rng(4)
    refuted = [k for k, record in enumerate(plane.records) if record.goal == "refuted"]
    for k in refuted[:: max(1, len(refuted) // 3)]:
        chain, scene = plane.records[k].chain, drawn(plane, k, rng)
        size, x = chain.side.size, float(chain.lo[0] + chain.hi[0]) / 2
        for step in range(15 * size, 0, -1):
            j = (step - 1) % size
            lo, hi = float(chain.lo[j]), float(chain.hi[j])
            for _ in range(60):
                mid = 0.5 * (lo + hi)
                got = images(scene.map, [mid], int(chain.side[j]))
                assert got.code[0] == chain.branches[j]
                lo, hi = (mid, hi) if got.x[0] < x else (lo, mid)
            x = 0.5 * (lo + hi)
        assert x > X
        assert chain.side[0] != 2
        again, side = x, int(chain.side[0])
        for _ in range(size):
            got = images(scene.map, [again], side)
            again, side = float(got.x[0]), int(got.side[0])
        assert side == chain.side[0]
        assert again == pytest.approx(x, abs=1e-6)


def test_a_cell_with_height_0_claims_starts_from_some_x_on(level):
    tops = [record for record in level.records if record.spans["arm.surface_height"][1] == 0]
    assert len(tops) == 2
    for record in tops:
        assert set(record.starts) == {"from"}
        assert record.goal == "proved"
        assert 0.0 < record.shares["open"] < 0.01
    others = [record for record in level.records if record.spans["arm.surface_height"][1] < 0]
    assert {record.starts for record in others} == {"every"}


def test_a_cell_of_a_single_parameter_is_proved_like_the_scene():
    scene = ls.load("paper-designed").with_values({"throw.speed": "158.02 deg/s"})
    speed = Fraction("158.02")
    record = certify_cell(scene, {"throw.speed": (speed, speed)})
    assert (record.goal, record.starts, len(record.blocks)) == ("proved", "every", 1)
    assert record.blocks[0].jogs[2].least <= 3
    assert record.blocks[0].jogs[2].most >= 11  # measured: 3 to 11


def test_a_scene_without_a_goal_has_regions_by_its_starts():
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    speed = evenly("throw.speed", "157 deg/s", "158 deg/s", 1)
    found = certified(ls.load(tree), speed, evenly("arm.surface_height", "-0.3 in", "-0.2 in", 2))
    assert found.code.tolist() == [1, 1]
    assert {record.goal for record in found.records} == {""}


def test_other_quantities_of_the_part_are_axes_too():
    x = evenly("part.mass.center.along", "4.225 in", "4.226 in", 1)
    y = evenly("throw.kappa", "25.37 in", "25.38 in", 1)
    assert certified("paper-designed", x, y, depth=0).shares()["proved"] == 1.0


# ------------------------------------------------------------------------------------------------- visits and glue


def test_jogs_of_a_visit_by_hand():
    """Cells 0 to 3 on one side, entered at 0 or 1; jogs lead up by one, and 3 flips to cell 4 of another."""
    none = [-1, -1]
    jog = np.array([[1, 1], [2, 2], [3, 3], none, none], dtype=np.int32)
    flip = np.array([none, none, [4, 4], [4, 4], [0, 1]], dtype=np.int32)
    block, side = np.ones(5, dtype=bool), np.array([True] * 4 + [False])
    assert visit(jog, flip, block, side) == Visit(1, 3)
    assert visit(jog, flip, block, ~side) == Visit(0, 0)
    jog[3] = [3, 3]
    assert visit(jog, flip, block, side) == Visit(1, -1)
    flip[4] = none
    assert visit(jog, flip, block, side) is None


def record_of(*blocks):
    """A record with blocks on one side, on cells of unit length from 0 to 10, of which 9 to 10 is open."""
    rank = np.array([0] * 9 + [-1], dtype=np.int32)
    arrays = {"edges.0": np.arange(11.0), "rank": rank}
    return Record({}, blocks=tuple(Block({0: [each]}, {}, {}, ()) for each in blocks), arrays=arrays)


@pytest.mark.parametrize(
    ("one", "other", "numbers"),
    [
        ([(1, 3), (5, 7)], [(2, 4), (6, 8)], [0, 0]),
        ([(1, 3), (5, 7)], [(1, 7), (8, 9)], [0, 1]),  # both lie in one
        ([(1, 3), (5, 7)], [(2, 6)], [0, 1]),
        ([(1, 3)], [(3, 5)], [0, 1]),  # they touch only
        ([(1, 3)], [(2, 10)], [0, 1]),  # into cells of which nothing is claimed
        ([(1, 3)], [], [0, -1]),
    ],
)
def test_cells_are_one_region_where_their_blocks_intersect_one_to_one(one, other, numbers):
    found = regions([record_of(*one), record_of(*other)], np.array([[0, 1]]))
    assert found.tolist() == numbers


def test_regions_go_round_corners_but_not_across():
    a, b = record_of((1, 3)), record_of((5, 7))
    assert regions([a, b, b, a], np.array([[0, 1], [2, 3]])).tolist() == [0, 1, 2, 3]
    assert regions([a, a, b, a], np.array([[0, 1], [2, 3]])).tolist() == [0, 0, 1, 0]


# ------------------------------------------------------------------------------------------------- margins


def test_the_roomiest_point_is_that_of_an_exhaustive_search():
    rng = np.random.default_rng(5)
    speed, height = ("throw.speed", "0 deg/s", "8 deg/s"), ("arm.surface_height", "-0.8 in", "0 in")
    axes = tuple(evenly(*span, 8) for span in (speed, height))
    cells = [(i, i + 1, j, j + 1) for i in range(8) for j in range(8)]
    for _ in range(20):
        code = (rng.random(64) < 0.8).astype(np.int8)
        found = Regions(ls.load("paper-designed"), axes, np.array(cells, np.int32), (), code, code * 0)
        good = code.reshape(8, 8) == 1
        most = max(
            n for i in range(1, 8) for j in range(1, 8) for n in range(5)
            if min(i, j, 8 - i, 8 - j) >= n and good[i - n : i + n, j - n : j + n].all()
        )  # fmt: skip
        if not most:
            continue
        pick = roomiest(found, {"throw.speed": "1 deg/s", "arm.surface_height": "0.1 in"})
        assert pick.factor == pytest.approx(most, rel=1e-6)
        assert pick.factor < most


def test_a_square_around_a_point_is_bracketed(plane):
    scales = {"throw.speed": "0.1 deg/s", "arm.surface_height": "0.01 in"}
    pick = roomiest(plane, scales)
    square = largest_square(ls.load("paper-designed"), pick.values, scales, width=0.2)
    assert pick.factor <= square.refuted
    assert 0.8 * pick.factor <= square.proved <= square.refuted


# ------------------------------------------------------------------------------------------------- the certificate


def test_the_checker_confirms_a_copy_with_the_same_shares(plane, files, tmp_path):
    """An unspoiled one, written as the spoiled ones below."""
    report = ls.recheck(opened(files["plane"]).copy().seal().write(tmp_path / "x.proof.zip"))
    assert report.verdict == "proved"
    assert report.area == pytest.approx(plane.shares(), abs=1e-12)
    assert ls.recheck(files["level"]).verdict == "proved"


def cell_with(f: Forged, code: int) -> int:
    return int(np.flatnonzero(f.arrays["goal"] == code)[0])


def rows_of(f: Forged, k: int) -> slice:
    sizes = [sum(f.arrays[f"edges.{g}.{s}"].size - 1 for s in range(3)) for g in f.arrays["grid"].tolist()]
    return slice(sum(sizes[:k]), sum(sizes[: k + 1]))


def coded(was, now):
    """Another code of a cell."""
    return lambda f: set_at(f, "goal", cell_with(f, was), now)


SECTION = ("claims", 0, "section")


def forgotten_chain(f):
    k = cell_with(f, 2)
    keep = f.arrays["chain"][:, 0] != k
    f.arrays["chain"], f.arrays["chain.ends"] = f.arrays["chain"][keep], f.arrays["chain.ends"][keep]


def wide_target(f):
    """Of the cells from which only jogs are possible, the one with the widest image."""
    here = rows_of(f, cell_with(f, 1))
    ends = f.arrays["jog"][here]
    return here.start + int(np.where(f.arrays["flip"][here, 0] < 0, ends[:, 1] - ends[:, 0], -1).argmax())


def narrowed(f):
    k = wide_target(f)
    f.arrays["jog"][k, 1] = f.arrays["jog"][k].sum() // 2


def rank_of(f, value):
    here = rows_of(f, cell_with(f, 1))
    off = np.flatnonzero(f.arrays["component"][here] < 0)
    f.arrays["rank"][here.start + off[-1]] = value


def dropped(f):
    here = rows_of(f, cell_with(f, 1))
    inside = here.start + np.flatnonzero(f.arrays["component"][here] >= 0)
    f.arrays["component"][inside[inside.size // 2]] = -1


FORGERIES = {
    "undecided is called proved": coded(0, 1),
    "undecided is called refuted": coded(0, 2),
    "refuted is called proved": coded(2, 1),
    "refuted is called undecided": coded(2, 0),
    "an orbit is missing": forgotten_chain,
    "an orbit is shifted": lambda f: set_at(f, "chain.ends", (1, slice(None)), f.arrays["chain.ends"][1] + 0.5),
    "an interval of an orbit is wider": lambda f: set_at(f, "chain.ends", (2, 1), f.arrays["chain.ends"][2, 1] + 0.5),
    "an orbit starts where it violates nothing": lambda f: set_at(f, "chain.ends", (0, 0), 19.9),
    "an orbit takes another branch": lambda f: set_at(f, "chain", (0, 2), 1 - f.arrays["chain"][0, 2]),
    "a cell lies over another": lambda f: set_at(f, "cells", (0, 1), f.arrays["cells"][0, 1] + 1),
    "the cells leave a gap": lambda f: set_at(f, "cells", (0, 1), f.arrays["cells"][0, 1] - 1),
    "a border lies elsewhere": put(*SECTION, "axes", 0, "borders", 0, "150 deg/s"),
    "a border is no border": put(*SECTION, "axes", 0, "borders", 1, "156 deg/s"),
    "the goal asks for more": put(*SECTION, "scene", "goal", "oriented_beyond", "x", "18 in"),
    "another part": put(*SECTION, "scene", "part", "mass", "center", "along", "4.2 in"),
    "another arm": put(*SECTION, "scene", "arm", "length", "28.1 in"),
    "a target is forgotten": narrowed,
    "a rank is too low": lambda f: rank_of(f, 0),
    "nothing is claimed where all starts are": lambda f: rank_of(f, -1),
    "an attracting cell is forgotten": dropped,
    "the angles are too small": lambda f: f.arrays["phi"].__imul__(np.float32(0.999)),
    "fewer jogs": lambda f: set_at(f, "blocks", (0, 11), f.arrays["blocks"][0, 11] - 1),
    "more jogs at least": lambda f: set_at(f, "blocks", (0, 10), f.arrays["blocks"][0, 10] + 1),
    "more bands": lambda f: set_at(f, "blocks", (0, 3), 2),
    "a block is missing": lambda f: f.arrays.__setitem__("blocks", f.arrays["blocks"][1:]),
    "a region of its own": lambda f: set_at(f, "region", 1, 1),
    "a factor near the joint is too large": lambda f: set_at(f, "joint", (0, 0), 1.5),
    "a factor is no number": lambda f: set_at(f, "joint", (0, 0), np.nan),
    "a grid that is none": lambda f: set_at(f, "grid", 0, -7),
    "a border that is none": lambda f: set_at(f, "cells", (0, 0), -1),
    "a block of no cell": lambda f: set_at(f, "blocks", (0, 0), 10_000),
    "a code that is none": lambda f: set_at(f, "goal", 0, 3),
    "noise": put("noise", {"throw.speed": "1 %"}),
    "one more array": lambda f: f.arrays.__setitem__("edges.9.0", np.arange(3.0)),
}  # fmt: skip


@pytest.mark.sweep
def test_an_orbit_close_to_a_switch_is_confirmed_by_halves_in_kappa(tmp_path):
    """The decision on one interval of this cell needs pieces of kappa as well: pieces of x alone do not prove it."""
    speed = evenly("throw.speed", "150 deg/s", "151 deg/s", 1)
    height = evenly("arm.surface_height", "-0.375 in", "-0.34375 in", 1)
    found = certified("paper-designed", speed, height, depth=0)
    assert found.shares()["refuted"] == 1.0
    found.save(tmp_path / "cell.zip")


@pytest.mark.parametrize("name", FORGERIES)
def test_a_spoiled_certificate_is_refused(files, tmp_path, name):
    f = opened(files["plane"]).copy()
    FORGERIES[name](f)
    report = ls.recheck(f.seal().write(tmp_path / "x.proof.zip"))
    assert report.verdict in ("failed", "bad file")
    assert report.reason


@pytest.mark.parametrize("starts", [0, 1])
def test_starts_next_to_the_joint_cannot_be_claimed_at_height_0(files, tmp_path, starts):
    f = opened(files["level"]).copy()
    f.arrays["starts"][f.arrays["starts"] == 2] = starts
    assert ls.recheck(f.seal().write(tmp_path / "x.proof.zip")).verdict in ("failed", "bad file")


# ------------------------------------------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    "borders",
    [["150 deg/s"], ["151 deg/s", "150 deg/s"], ["150 deg/s", "3 rad/s"], ["150 deg/s", "150 deg/s"]],
)
def test_borders_ascend_in_one_unit(borders):
    with pytest.raises(AnswerError, match=r"borders of throw\.speed"):
        CellAxis.of("throw.speed", borders)


def test_effects_and_axes_that_are_one_are_refused():
    x = evenly("throw.speed", "150 deg/s", "151 deg/s", 1)
    with pytest.raises(AnswerError, match="the axes"):
        certified("paper-designed", x, x)
    tree = ls.load("paper-designed").as_dict() | {"effects": {"landing": True}}
    with pytest.raises(AnswerError, match="effects"):
        certified(ls.load(tree), x, evenly("arm.surface_height", "-0.2 in", "-0.1 in", 1))


@pytest.mark.parametrize(
    ("branch", "lo", "hi", "proved"),
    [(0, 15.0, 19.9, True), (1, 20.1, 23.0, True), (0, 19.0, 21.0, False), (1, 19.0, 21.0, False)],
)
def test_a_decision_is_proved_on_either_side_of_its_switch_and_not_across(branch, lo, hi, proved):
    """On side 2 of paper-designed the throw flips from r_2 = 20 in on."""
    given = ls.load("paper-designed").as_dict()
    raw = {word: given[word] for word in ("name", "part", "arm", "throw", "gravity") if word in given}
    scene = read_scene(raw | {"model": {"flight": "exact", "flip": "signed"}}, None)
    unproved = unproved_of(Throws(scene), Piece(2, lo, hi, branch, 0), MOST_CUT)
    assert unproved == ("" if proved else "branch")
