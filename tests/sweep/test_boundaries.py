"""Refinement: pictures of shapes whose every pixel is known, tongues in closed form, stores."""

import math

import numpy as np
import pytest

from limitsets import maps
from limitsets.base.errors import LimitsetsError
from limitsets.parameters.atlas import atlas
from limitsets.parameters.atlas.work import refined
from tests.sweep.stores import Shuffled, bytes_of

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
    return atlas(
        maps.Circle(), "omega=0.01:0.15:57", "coupling=0.05:0.95:41", domain=[(0, 1)], chunk=(41, 57), refine=True,
        variables=["period"],
    )  # fmt: skip


def test_the_main_tongue_of_the_circle_map(tongue):
    data = tongue.dataset
    omega, coupling = data["omega"].values, data["coupling"].values
    locked = omega[None, :] < coupling[:, None] / (2 * math.pi)
    assert np.array_equal(data.period.values[..., 0] == 1, locked)
    computed = data.level.values >= 0
    assert computed.mean() < 0.4
    assert "class" in data  # which it is refined by, though it was not asked for


def test_a_refined_store_is_that_of_its_plan_alone(tmp_path):
    stores = []
    for seed in range(2):
        store = tmp_path / f"{seed}.zarr"
        given = {"domain": [(0, 1)], "chunk": (9, 9), "refine": True, "coarse": 4, "variables": ["period"]}
        atlas(
            maps.Circle(),
            "omega=0.01:0.15:20",
            "coupling=0.05:0.95:20",
            store=store,
            executor=Shuffled(seed),
            **given,
        )
        stores.append(bytes_of(store))
    assert stores[0] == stores[1]
    with pytest.raises(LimitsetsError, match="refine"):
        atlas(
            maps.Circle(),
            "omega=0.01:0.15:20",
            "coupling=0.05:0.95:20",
            store=store,
            **(given | {"refine": False}),
        )


def test_any_variable_of_any_task_may_be_refined_by():
    found = atlas(
        "paper-designed", "throw.speed=-10:200:71", task="tests.sweep.tasks_of_tests:side_of_150", refine="fast",
    ).dataset  # fmt: skip
    speed = found["throw.speed"].values
    assert np.array_equal(found.status.values == 1, speed <= 0)  # where there is no scene is a boundary too
    assert np.array_equal(found.fast.values[speed > 0], (speed > 150)[speed > 0])
    assert (found.level.values >= 0).sum() < 40


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"refine": "nothing"}, "the variable is 'nothing'"),
        ({"refine": True, "coarse": 1}, "the step of the coarse grid is 1"),
    ],
)
def test_what_cannot_be_refined(given, words):
    with pytest.raises(LimitsetsError) as told:
        atlas("paper-designed", "throw.speed=150:160:9", **given)
    assert words in str(told.value)


def test_a_task_without_the_variable_is_told_so():
    with pytest.raises(LimitsetsError, match="the variable by which the atlas is refined"):
        atlas(
            "paper-designed",
            "throw.speed=150:160:9",
            task="tests.sweep.tasks_of_tests:side_of_150",
            refine="slow",
        )


def test_checks_count_once():
    given = {"domain": [(0, 1)], "chunk": (64, 64), "variables": ["checked"]}
    found = atlas(maps.Circle(), "omega=0.2:0.24:64", "coupling=0.05:0.15:64", refine=True, **given).dataset
    none = dict(
        zip(found.checked.attrs["flag_meanings"].split(), found.checked.attrs["flag_values"], strict=True)
    )["not_checked"]
    filled = found.level.values < 0
    assert filled.mean() > 0.8
    assert (found.checked.values[filled] == none).all()
