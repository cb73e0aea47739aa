"""The file of throws, with the corners that a film shows."""

from collections import Counter

import numpy as np
import pytest
from scipy.stats import binom

import limitsets as ls
from limitsets.base.errors import DataError
from limitsets.face.report.pages import lines_of
from limitsets.parameters.fitting import bootstrap, read_throws, simulated_throws
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, KAPPA, RADIUS, film, machine
from tests.fitting.test_fit import LANDING, PLACES, SPEED, aimed_at, repeated

# ----------------------------------------------------------------
# Films as CSV files: units, and one clear line for whatever is wrong, with its row and column.


HEAD = "x_before [mm],side_before,x_after [mm],side_after"
ROW = "254,2,256.54,2"


@pytest.fixture
def write(tmp_path):
    def written(text, encoding="utf-8"):
        path = tmp_path / "throws.csv"
        path.write_text(text, encoding=encoding, newline="")
        return path

    return written


HEAD_CORNERS = "corner_before [mm],side_before,corner_after [mm],side_after"


def read(path):
    return read_throws(path, ls.load("paper-designed"))


def lines(head, *rows):
    return "\n".join([head, *rows])


def test_places_come_in_the_units_of_the_scene(write):
    rows = "\n".join(
        ["254,2,256.54,2,0.508,a"] * 4 + ["254 ,2, 256.54,2,0.508,b"] * 3 + ["127,1,130,1,0.508,"]
    )
    throws = read(
        write(f"\ufeffx_before [mm], side_before ,x_after [ mm ],side_after,error [mm],run\r\n{rows}\r\n\r\n")
    )
    assert len(throws) == 8
    assert throws.x_before[0] == 10.0
    assert throws.x_after[0] == 10.1
    assert throws.error[0] == 0.02
    assert throws.follows.tolist() == [False, True, True, True, False, True, True, False]
    assert throws.row.tolist() == list(range(2, 10))
    assert throws.side_before.tolist() == [2] * 7 + [1]


def test_columns_may_stand_in_any_order_and_have_units_of_their_own(write):
    throws = read(write(lines("side_after,x_before [cm],side_before,x_after [ft]", *["2,25.4,2,1 "] * 8)))
    assert (throws.x_before[0], throws.x_after[0]) == (10.0, 12.0)
    throws = read(write(lines(HEAD_CORNERS, *["127,2,130,2"] * 8)))
    assert (throws.corner, throws.unit, throws.x_before[0]) == (True, "mm", 5.0)


def test_a_reading_shared_by_two_rows_is_known_by_its_number(write):
    rows = ["254,2,256.54,2,a", "256.54,2,260,2,a", "260.3,2,262,2,a", "262,2,265,2,b"] * 2
    throws = read(write(lines(f"{HEAD},run", *rows)))
    assert throws.shared.tolist() == [False, True, False, False] * 2
    assert throws.read_twice == pytest.approx([0.3 / 25.4] * 2)


@pytest.mark.parametrize(
    ("bad", "place", "said"),
    [
        ("254,2,,2", "row 4, column x_after [mm]", "empty"),
        ("254,3,256,2", "row 4, column side_before", "0 to 2"),
        ("254,-1,256,2", "row 4, column side_before", "0 to 2"),
        ("254,2.0,256,2", "row 4, column side_before", "'2.0'"),
        ("254,2,far,2", "row 4, column x_after [mm]", "'far'"),
        ("254,2,256 in,2", "row 4, column x_after [mm]", "'256 in'"),
        ("nan,2,256,2", "row 4, column x_before [mm]", "'nan'"),
        ("-3,2,256,2", "row 4, column x_before [mm]", "arm's length, 28 in"),
        ("2540,2,256,2", "row 4, column x_before [mm]", "arm's length, 28 in"),
        ("254,2,-3,2", "row 4, column x_after [mm]", "leave out a throw off the arm"),
        ("254,2,2540,2", "row 4, column x_after [mm]", "arm's length, 28 in"),
        ("254,2,256", "row 4", "4, one for each column"),
        ("254,3,2,256,5,2", "row 4", "decimals have a point"),
        ("254,2,256,2,1", "row 4", "4, one for each column"),
        ('254,2,"256,5",2', "row 4, column x_after [mm]", "'256,5'"),
    ],
)
def test_a_bad_cell_is_one_line_with_file_row_and_column(write, bad, place, said):
    path = write(lines(HEAD, ROW, ROW, bad, *[ROW] * 8))
    with pytest.raises(DataError) as caught:
        read(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: {place}: ")
    assert said in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("x_before,side_before,x_after [mm],side_after", 'write it like "x_before [mm]"'),
        ("x_before [mn],side_before,x_after [mm],side_after", "'mn'"),
        ("x_before [deg],side_before,x_after [mm],side_after", "'deg'"),
        ("x_before [mm],side_before [mm],x_after [mm],side_after", "none in this column"),
        ("x_befor [mm],side_before,x_after [mm],side_after", "did you mean 'x_before [mm]'"),
        ("x_before (mm),side_before,x_after [mm],side_after", "did you mean 'x_before [mm]'"),
        ("x_before [mm],sid_before,x_after [mm],side_after", "did you mean 'side_before'"),
        ("x_before [mm],side_before,x_after [mm],x_after [mm]", "each column once"),
        ("x_before [mm],side_before,x_after [mm],run", "side_after missing"),
        ("x_before [mm];side_before;x_after [mm];side_after", "commas separate columns"),
        ("corner_before [mm],side_before,x_after [mm],side_after", "two places of one kind"),
        ("corner_before [mm],side_before,side_after", "corner_after missing"),
        ("corner_befor [mm],side_before,corner_after [mm],side_after", "did you mean 'corner_before [mm]'"),
    ],
)
def test_a_bad_header_is_one_line(write, head, said):
    path = write(lines(head, *[ROW] * 9))
    with pytest.raises(DataError) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}: row 1")
    assert said in str(caught.value)


def test_files_that_are_none(write, tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(DataError, match="could not be opened"):
            read(path)
    for text, encoding, said in (
        ("", "utf-8", "empty"),
        (lines(HEAD, *[ROW] * 7), "utf-8", "8 at least"),
        (lines(HEAD, ROW, "\u00e9"), "latin-1", "UTF-8"),
        (lines(HEAD, ROW, '"254,2'), "utf-8", "separated by commas"),
    ):
        with pytest.raises(DataError, match=said):
            read(write(text, encoding=encoding))


SCATTERED = [f"{150 + k * 37 % 400},{k % 3},{100 + k * 91 % 500},{k * 7 % 3}" for k in range(40)]
NO_FLIGHT = r"row 10: the place before is '1.574\S* in'.*beyond the left vertex of side 2"
AT_THE_JOINT = r"row 10: the place before is '-0\.0393701 in'.*beyond the joint"


@pytest.mark.parametrize(
    ("head", "rows", "error", "said"),
    [
        (f"{HEAD},error [mm]", [f"{ROW},0"] * 8, None, r"row 2, column error \[mm\]"),
        (f"{HEAD},error [mm]", [f"{ROW},0.5"] * 8, "0.5 mm", "given twice"),
        (HEAD, [*[ROW] * 8, "40,2,41,2"], None, NO_FLIGHT),
        (HEAD_CORNERS, [*["127,2,130,2"] * 8, "-1,2,5,2"], None, AT_THE_JOINT),
        (HEAD, SCATTERED, "0.5 mm", "check units and sides"),
    ],
    ids=["no error", "two errors", "no flight", "at the joint", "landings that tell nothing"],
)
def test_films_that_are_no_throws_of_the_part(write, head, rows, error, said):
    with pytest.raises(DataError, match=said):
        ls.fit("paper-designed", write(lines(head, *rows)), error=error)


def test_one_throw_again_and_again_tells_no_quantity_from_the_others(write):
    found = ls.fit("paper-designed", write(lines(HEAD, *[ROW] * 20)), error="0.5 mm")
    assert not any(np.isfinite(each.half) for each in found.quantities)
    assert len(found.held) == 4
    assert [each.name for each in found.quantities] == list(found.undetermined)
    assert not found.misfit.lacking


# ----------------------------------------------------------------
# Films that show corners: the part's geometry is fitted too, so that along and above enter through the rest places.


FIVE = (*PLACES, RADIUS)


def covered(count, seed):
    """Count for each quantity the films whose interval holds the truth, or that say it has none."""
    held = Counter()
    for truth, found in repeated(count, seed, corner=True):
        for name in FIVE:
            told = name not in found.held and name not in found.undetermined
            held[name] += not told or found[name].lo <= truth[name] <= found[name].hi
    return held


@pytest.mark.sweep
def test_intervals_from_corners_hold_the_truth():
    held = covered(10, seed=60)
    for name in FIVE:
        # fewer than this many of 95 % intervals would hold once in ten thousand times
        assert held[name] >= binom.ppf(1e-4, 10, 0.95), name


def test_one_film_of_corners_gives_the_machine(write):
    draw = np.random.default_rng(61)
    truth = machine(draw)
    seen = film(draw, truth, error=0.0, speed=0.0, landing=0.0, known=False, corner=True)
    columns = (each.tolist() for each in (seen.x_before, seen.side_before, seen.x_after, seen.side_after))
    rows = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
    found = ls.fit(aimed_at(), write(lines(HEAD_CORNERS.replace("mm", "in"), *rows)))
    assert not found.misfit.lacking
    for name in PLACES:
        assert found[name].value == pytest.approx(truth[name], abs=1e-4)
    assert "the left corner at" in lines_of(found)[-1]


def test_films_of_corners_can_be_simulated():
    scene = ls.load("paper-designed")
    x, side = np.array([8.0, 21.0]), np.array([2, 2])
    marked, seen = (simulated_throws(scene, x, side, corner=corner) for corner in (False, True))
    assert (seen.corner, marked.corner) == (True, False)
    assert seen.x_before == pytest.approx(marked.x_before - scene.sides.a[side])
    assert seen.x_after == pytest.approx(marked.x_after - scene.sides.a[marked.side_after])


@pytest.mark.sweep
def test_the_bootstrap_films_what_the_film_showed():
    draw = np.random.default_rng(63)
    found = ls.fit(aimed_at(), film(draw, machine(draw), speed=SPEED, landing=LANDING, corner=True))
    again = bootstrap(found, 8)
    for name in (KAPPA, ALONG, ABOVE, HEIGHT):
        assert again.covered[name] >= binom.ppf(1e-4, 8, 0.95), name
