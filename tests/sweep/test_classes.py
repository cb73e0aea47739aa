"""Classes of an atlas and their boundaries."""

import hashlib
import math
from types import SimpleNamespace

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.parameters.atlas import atlas
from limitsets.parameters.atlas.classes import FIELDS, classes, legend, named_class
from limitsets.parameters.atlas.work import refined
from tests.sweep.stores import Shuffled, bytes_of, flags_of

# ----------------------------------------------------------------
# Classes: written down by hand here; their numbers by hashlib, their examples by theory.


NONE = (0, 0, 0)
# Of two attractors of three sides: bands, order and period of each.
ONE = ([(1, 1, 1), NONE], [(0, 1, 2), (-1, -1, -1)], [0, -1])
TWO = ([(2, 0, 1), (0, 3, 0)], [(0, 2, -1), (1, -1, -1)], [0, 3])
SWAPPED = ([(0, 3, 0), (2, 0, 1)], [(1, -1, -1), (0, 2, -1)], [3, 0])
IRREGULAR = ([(1, 1, 1), NONE], [(-2, -2, -2), (-1, -1, -1)], [0, -1])
NO = ([NONE, NONE], [(-1, -1, -1)] * 2, [-1, -1])
# attractors, undecided, the rest, leaves, collapses
POINTS = {
    "all stay": (1, 0, ONE, 0.0, 0.0),
    "some leave": (1, 0, ONE, 0.25, 0.0),
    "some collapse": (1, 0, ONE, 0.0, 1e-4),
    "two": (2, 0, TWO, 0.0, 0.0),
    "two, in the other places": (2, 0, SWAPPED, 0.0, 0.0),
    "irregular": (1, 0, IRREGULAR, 0.0, 0.0),
    "every start leaves": (0, 0, NO, 1.0 - 1e-14, 0.0),
    "undecided": (1, 3, ONE, 0.0, 0.0),
    "no scene": (-1, -1, NO, np.nan, np.nan),
}
NAMES = {
    "all stay": "bands:1+1+1,order:0-1-2,period:0;leaves:none;collapses:none",
    "some leave": "bands:1+1+1,order:0-1-2,period:0;leaves:some;collapses:none",
    "some collapse": "bands:1+1+1,order:0-1-2,period:0;leaves:none;collapses:some",
    "two": "bands:0+3+0,order:1,period:3;bands:2+0+1,order:0-2,period:0;leaves:none;collapses:none",
    "irregular": "bands:1+1+1,order:changes,period:0;leaves:none;collapses:none",
    "every start leaves": "no-attractor;leaves:all;collapses:none",
    "undecided": "undecided",
}
WORDS = {
    "all stay": "one attractor, 3 bands, 0-1-2",
    "some leave": "one attractor, 3 bands, 0-1-2; some starts leave",
    "some collapse": "one attractor, 3 bands, 0-1-2; some starts collapse",
    "two": "two attractors: a cycle of 3, side 1 alone; 3 bands (2 + 0 + 1), 0-2",
    "irregular": "one attractor, 3 bands, the order changes",
    "every start leaves": "no attractors; every start leaves",
}


def fields_of(points):
    rows = [(n, doubt, *rest, out, back) for n, doubt, rest, out, back in points]
    columns = zip(*rows, strict=True)
    return SimpleNamespace(**{name: np.array(column) for name, column in zip(FIELDS, columns, strict=True)})


def number_of(name):
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:6], "big")


def test_classes_by_hand():
    numbers, names = classes(fields_of(POINTS.values()))
    by_point = dict(zip(POINTS, numbers.tolist(), strict=True))
    for point, name in NAMES.items():
        assert names[by_point[point]] == name
        assert by_point[point] == (0 if name == "undecided" else number_of(name))
    assert by_point["two"] == by_point["two, in the other places"]
    assert by_point["no scene"] == -1
    assert len(set(by_point.values())) == len(POINTS) - 1
    assert {point: named_class(NAMES[point]).words for point in WORDS} == WORDS


def test_a_class_has_its_number_whatever_else_is_met():
    together = dict(zip(POINTS, classes(fields_of(POINTS.values()))[0].tolist(), strict=True))
    for seed in range(5):
        rng = np.random.default_rng(seed)
        some = [str(each) for each in rng.permutation(list(POINTS))[: rng.integers(1, len(POINTS))]]
        numbers, names = classes(fields_of([POINTS[each] for each in some]))
        assert numbers.tolist() == [together[each] for each in some]
        assert set(names) == set(numbers.tolist()) - {-1}


def test_shares_of_rounding_are_none_and_all():
    points = [(1, 0, ONE, 1e-12, 0.0), (0, 0, NO, 0.0, 1.0), (1, 0, ONE, 1e-6, 1.0 - 1e-6)]
    _, names = classes(fields_of(points))
    ways = {(each.leaves, each.collapses) for each in map(named_class, names.values())}
    assert ways == {("none", "none"), ("none", "all"), ("some", "some")}


def test_what_names_no_class():
    for name in ("", "undecided", "bands:1;leaves:none;collapses:none", "bands:x,order:0,period:0;a;b"):
        with pytest.raises(AnswerError, match="the name of a class"):
            named_class(name)


def test_a_field_that_is_missing_is_named():
    fields = fields_of(POINTS.values())
    del fields.period
    with pytest.raises(AnswerError, match="the variable period"):
        classes(fields)


FEEDERS = "throw.speed=130:180:12", "arm.surface_height=-1:0.2:9"


@pytest.fixture(scope="module")
def feeders():
    """The scene at 12 x 9 points in one chunk."""
    return atlas("paper-designed", *FEEDERS, chunk=(9, 12))


def test_an_atlas_stores_what_its_fields_say(feeders):
    data = feeders.dataset
    numbers, names = classes(data)
    assert np.array_equal(data["class"].values, numbers)
    assert {code: name for name, code in flags_of(data["class"]).items()} == names
    # docs/physics: h <= 0 and slow throws lose every start, and one attractor holds the paper's design
    assert named_class(names[int(numbers[0, 0])]).words == "no attractors; every start leaves"
    near = data["class"].sel({"throw.speed": 158, "arm.surface_height": -0.2}, method="nearest")
    assert named_class(names[int(near)]).words == "one attractor, 3 bands, 0-1-2"


def test_chunks_and_their_order_leave_no_trace(feeders, tmp_path):
    stores = []
    for seed in range(2):
        store = tmp_path / f"{seed}.zarr"
        given = {"chunk": (4, 5), "variables": ["class"], "store": store, "executor": Shuffled(seed)}
        found = atlas("paper-designed", *FEEDERS, **given)
        assert np.array_equal(found.dataset["class"].values, feeders.dataset["class"].values)
        assert found.dataset["class"].attrs == feeders.dataset["class"].attrs
        stores.append(bytes_of(store))
    assert stores[0] == stores[1]


def test_the_legend_says_jogs_and_shares(feeders):
    entries = legend(feeders.dataset)
    assert [each.share for each in entries] == sorted((each.share for each in entries), reverse=True)
    assert sum(each.share for each in entries) == pytest.approx(1.0)
    first = next(each for each in entries if each.name == NAMES["all stay"])
    here = feeders.dataset["class"].values == first.number
    least, most = (feeders.dataset[name].values[here][:, 0] for name in ("jogs_min", "jogs_max"))
    assert first.words == f"{WORDS['all stay']}; {least.min()} to {most.max()} jogs a visit"


def test_windows_of_the_logistic_map():
    # cycles of 1, 2, 4, 3 and, at 4, the whole of [0, 1] (Feigenbaum; Sharkovsky)
    values = [2.8, 3.2, 3.5, 3.83, 4.0]
    found = atlas(maps.Logistic(3.8), ls.sweep.Axis("r", values), domain=[(0, 1)]).dataset
    numbers, names = classes(found)
    words = [named_class(names[each]).words for each in numbers.tolist()]
    kinds = ["a fixed point", "a cycle of 2", "a cycle of 4", "a cycle of 3", "1 band"]
    assert words == [f"one attractor, {kind}" for kind in kinds]


def test_starts_of_a_map_do_not_collapse_but_leave_by_its_exit(monkeypatch):
    found = named_class("bands:1,order:0,period:0;leaves:none;collapses:some")
    assert found.words == "one attractor, 1 band; some starts collapse"
    data = ls.atlas(maps.Logistic(3.9), "r=3.9:3.95:2", domain=[(0, 1)]).dataset
    number = found.number
    data["class"].values[:] = number
    data["class"].attrs.update(flag_meanings=found.name, flag_values=[number])
    assert legend(data)[0].words == "one attractor, 1 band; some starts leave over the lower end"
    assert "joint" not in data["collapses"].attrs["long_name"]


def test_the_legend_of_a_map_names_the_ends_of_the_domain():
    # x -> 1.5 x - x^3: the cubic's starts beyond +-sqrt(2.5) leave, over either end; at 3.2 all but a null set do
    found = ls.atlas(maps.Cubic(1.5), "r=1.5:3.2:2", domain=[(-2.1, 2.1)])
    first, last = sorted(legend(found.dataset), key=lambda entry: entry.name)
    ways = "some starts leave over the upper end and some starts leave over the lower end"
    assert first.words.endswith(ways)
    assert last.words == "no attractors; all starts leave, some over either end"
    one_way = named_class("no-attractor;leaves:some;collapses:none")  # the others are undecided
    assert one_way.said(("leave", "leaves"), ("go", "goes"), "all go") == "no attractors; some starts leave"
    # beside 0 two fixed points attract at 1.5: its table has columns for no more
    shares = [name for name in found.to_dataframe().columns if name.startswith("share")]
    assert shares == ["share[0]", "share[1]"]


# ----------------------------------------------------------------
# Refinement: pictures of shapes whose every pixel is known, tongues in closed form, stores.


SHAPE = (97, 130)
ROWS, COLUMNS = np.indices(SHAPE)


def shapes(seed):
    """Half planes and discs wider than a step: classes 0 to 7."""
    rng = np.random.default_rng(seed)
    angle, radius = rng.uniform(0, 2 * math.pi), rng.uniform(12, 40)
    i, j = rng.uniform(0, SHAPE[0]), rng.uniform(0, SHAPE[1])
    half = (ROWS - 48) * math.sin(angle) + (COLUMNS - 60) * math.cos(angle) > rng.uniform(-30, 30)
    disc = (ROWS - i) ** 2 + (COLUMNS - j) ** 2 < radius**2
    return half + 2 * disc


def picture(classes, step):
    """Refine, and fill the classes from the points that were computed."""
    asked = []

    def ask(points):
        asked.extend(points.tolist())
        return classes.ravel()[points]

    found = refined(classes.shape, step, ask)
    assert asked == found.points.tolist()
    assert len(set(asked)) == len(asked)  # none twice
    return found, classes.ravel()[found.points][found.source].reshape(classes.shape)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("step", [2, 5, 8])
def test_boundaries_wider_apart_than_a_step_are_sharp(seed, step):
    classes = shapes(seed)
    found, seen = picture(classes, step)
    # an arc or a corner may pass between two points of the coarse grid and bulge less than a step into a cell
    assert (seen != classes).mean() < 0.002
    if step > 2:
        assert found.points.size < 0.35 * classes.size


def test_a_point_that_was_computed_is_its_own_and_others_have_a_corner_of_their_cell():
    classes = shapes(3)
    found, _ = picture(classes, 8)
    computed = np.zeros(classes.size, bool)
    computed[found.points] = True
    assert np.array_equal(found.points[found.source[computed]], np.flatnonzero(computed))
    assert np.array_equal(found.level >= 0, computed)
    row, column = np.divmod(found.points[found.source], SHAPE[1])
    assert np.abs(row.reshape(SHAPE) - ROWS).max() <= 4
    assert np.abs(column.reshape(SHAPE) - COLUMNS).max() <= 4
    coarse = found.level.reshape(SHAPE)[np.ix_([*range(0, 96, 8), 96], [*range(0, 129, 8), 129])]
    assert (coarse == 0).all()


def test_an_island_between_the_points_of_the_coarse_grid_is_missed_and_one_on_them_is_not():
    small = np.zeros(SHAPE, int)
    small[25:32, 41:48] = 1  # 7 x 7 points, between multiples of 8
    found, seen = picture(small, 8)
    assert not seen.any()
    assert found.points.size == 13 * 18  # the coarse grid, and no more: 0, 8, ... 96 and 0, 8, ... 128, 129
    small[25:33, 41:48] = 1  # now beyond a line of the grid, still between its points
    assert not picture(small, 8)[1].any()
    small[32, 48] = 1
    assert np.array_equal(picture(small, 8)[1], small)


def test_a_strip_is_followed_once_it_is_met():
    strip = (np.abs(COLUMNS - 40 - ROWS // 3) < 2).astype(int)  # three points wide, aslant
    _, seen = picture(strip, 8)
    assert np.array_equal(seen, strip)


@pytest.mark.parametrize("shape", [(1,), (2,), (17,), (1, 1), (1, 9), (3, 200)])
def test_grids_of_every_shape_end(shape):
    size = math.prod(shape)
    found = refined(shape, 8, lambda points: points * 2 // size)
    assert np.array_equal((found.points * 2 // size)[found.source], np.arange(size) * 2 // size)


@pytest.fixture(scope="module")
def tongue():
    """The main tongue of the circle map, refined: fixed points where omega <= coupling / (2 pi)."""
    given = {"domain": [(0, 1)], "chunk": (41, 57), "refine": True, "variables": ["period"]}
    return atlas(maps.Circle(), "omega=0.01:0.15:57", "coupling=0.05:0.95:41", **given)


def test_the_main_tongue_of_the_circle_map(tongue):
    data = tongue.dataset
    omega, coupling = data["omega"].values, data["coupling"].values
    locked = omega[None, :] < coupling[:, None] / (2 * math.pi)
    assert np.array_equal(data.period.values[..., 0] == 1, locked)
    computed = data.level.values >= 0
    assert computed.mean() < 0.4
    assert "class" in data  # which it is refined by, though it was not asked for


def test_a_refined_store_is_that_of_its_plan_alone(tmp_path):
    stores, axes = [], ("omega=0.01:0.15:20", "coupling=0.05:0.95:20")
    given = {"domain": [(0, 1)], "chunk": (9, 9), "refine": True, "coarse": 4, "variables": ["period"]}
    for seed in range(2):
        store = tmp_path / f"{seed}.zarr"
        atlas(maps.Circle(), *axes, store=store, executor=Shuffled(seed), **given)
        stores.append(bytes_of(store))
    assert stores[0] == stores[1]
    with pytest.raises(LimitsetsError, match="refine"):
        atlas(maps.Circle(), *axes, store=store, **(given | {"refine": False}))


FAST = "tests.sweep.tasks_of_tests:side_of_150"


def test_any_variable_of_any_task_may_be_refined_by():
    found = atlas("paper-designed", "throw.speed=-10:200:71", task=FAST, refine="fast").dataset
    speed = found["throw.speed"].values
    assert np.array_equal(found.status.values == 1, speed <= 0)  # where there is no scene is a boundary too
    assert np.array_equal(found.fast.values[speed > 0], (speed > 150)[speed > 0])
    assert (found.level.values >= 0).sum() < 40


def test_what_cannot_be_refined():
    for given, words in (
        ({"refine": "nothing"}, "the variable is 'nothing'"),
        ({"refine": True, "coarse": 1}, "the step of the coarse grid is 1"),
        ({"refine": "slow", "task": FAST}, "the variable by which the atlas is refined"),
    ):
        with pytest.raises(LimitsetsError, match=words):
            atlas("paper-designed", "throw.speed=150:160:9", **given)


def test_checks_count_once():
    given = {"domain": [(0, 1)], "chunk": (64, 64), "variables": ["checked"]}
    found = atlas(maps.Circle(), "omega=0.2:0.24:64", "coupling=0.05:0.15:64", refine=True, **given).dataset
    filled = found.level.values < 0
    assert filled.mean() > 0.8
    assert (found.checked.values[filled] == flags_of(found.checked)["not_checked"]).all()
