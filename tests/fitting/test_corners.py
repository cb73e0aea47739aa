"""Films that show corners: the part's geometry is fitted too, so that along and above enter through the rest places."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import limitsets as ls
from limitsets.base.errors import DataError
from limitsets.face.report.pages import lines_of
from limitsets.parameters.fitting import bootstrap, read_throws, simulated_throws
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, KAPPA, RADIUS, film, machine
from tests.fitting.test_fit import LANDING, PLACES, SPEED, aimed_at, repeated

FIVE = (*PLACES, RADIUS)
HEAD = "corner_before [mm],side_before,corner_after [mm],side_after"


def read(tmp_path, head, *rows):
    path = tmp_path / "throws.csv"
    path.write_text("\n".join([head, *(rows or ["127,2,130,2"] * 8)]), encoding="utf-8")
    return read_throws(path, ls.load("paper-designed"))


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
    held = covered(20, seed=60)
    for name in FIVE:
        # fewer than this many of 95 % intervals would hold once in ten thousand times
        assert held[name] >= binom.ppf(1e-4, 20, 0.95), name


def test_one_film_of_corners_gives_the_machine(tmp_path):
    draw = np.random.default_rng(61)
    truth = machine(draw)
    seen = film(draw, truth, error=0.0, speed=0.0, landing=0.0, known=False, corner=True)
    columns = (each.tolist() for each in (seen.x_before, seen.side_before, seen.x_after, seen.side_after))
    path = tmp_path / "throws.csv"
    rows = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([HEAD.replace("mm", "in"), *rows]), encoding="utf-8")
    found = ls.fit(aimed_at(), path)
    assert not found.misfit.lacking
    for name in PLACES:
        assert found[name].value == pytest.approx(truth[name], abs=1e-4)
    assert "the left corner at" in lines_of(found)[-1]


def test_x_from_the_nominal_part_misses_where_corners_do_not():
    """What users did before: corner plus the offset of the part as it was meant to be."""
    draw = np.random.default_rng(62)
    truth = machine(draw) | {ALONG: 4.45}
    seen = film(draw, truth, corner=True)
    scene = aimed_at()
    a = scene.sides.a
    nominal = replace(
        seen,
        x_before=seen.x_before + a[seen.side_before],
        x_after=seen.x_after + a[seen.side_after],
        corner=False,
    )
    by_corner, by_x = (ls.fit(scene, each)[ALONG] for each in (seen, nominal))
    assert by_corner.lo <= truth[ALONG] <= by_corner.hi
    assert not by_x.lo <= truth[ALONG] <= by_x.hi


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
    again = bootstrap(found, 12)
    for name in (KAPPA, ALONG, ABOVE, HEIGHT):
        assert again.covered[name] >= binom.ppf(1e-4, 12, 0.95), name


def test_corners_stand_in_columns_of_their_own(tmp_path):
    throws = read(tmp_path, HEAD)
    assert (throws.corner, throws.unit) == (True, "mm")
    assert throws.x_before[0] == 5.0


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("corner_before [mm],side_before,x_after [mm],side_after", "two places of one kind"),
        ("corner_before [mm],side_before,side_after", "corner_after missing"),
        ("corner_befor [mm],side_before,corner_after [mm],side_after", "did you mean 'corner_before [mm]'"),
    ],
)
def test_a_bad_header_of_corners_is_one_line(tmp_path, head, said):
    with pytest.raises(DataError) as caught:
        read(tmp_path, head)
    assert said in str(caught.value)


def test_a_throw_from_the_joint_names_the_row(tmp_path):
    path = tmp_path / "throws.csv"
    path.write_text("\n".join([HEAD, *["127,2,130,2"] * 8, "-1,2,5,2"]), encoding="utf-8")
    with pytest.raises(DataError, match=r"row 10: the place before is '-0\.0393701 in'.*beyond the joint"):
        ls.fit("paper-designed", path)
