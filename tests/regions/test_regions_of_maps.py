"""Proved regions of parameters of maps: against bifurcations on paper, and the shares against those of the checker."""

import math
from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.parameters.regions import CODES, CellAxis, certified_map
from limitsets.parameters.regions.of_map import RecordOfMap, RegionsOfMap, _corresponds, _halves
from limitsets.parameters.regions.plane import neighbours, regions
from limitsets.proofs.prover.certificate_of_map import Part
from tests.proofs.forge import opened

UNDECIDED, PROVED, REFUTED = range(3)


def ricker(x, r):
    return x * math.exp(r * (1.0 - x))


def cusp(x, a, b):
    return a * x - x**3 + b


def cube(x, s):
    return s * x**3


def logistic(x, r):
    return r * x * (1.0 - x)


def saved(found, folder):
    return ls.recheck(found.save(folder / "plane.proof.zip"))


def shares_of(report):
    plane = report.map["plane"]
    return {name: Fraction(share) for name, share in plane["shares"].items()}, Fraction(plane["open"])


# The 2-cycle x, 2 - x of Ricker's map leaves the ends where r (1 - x) = ln((2 - x)/x) at x = 0.35; the top
# e^(r - 1)/r lies outside them from 2.35902 on, and starts near there are not proved on cells.
TOP, LEAVES = 2.35902, math.log(1.65 / 0.35) / 0.65


@pytest.fixture(scope="module")
def line():
    lower = ls.map(ricker, r=2.3)
    grid, goal = ls.grid([(0.02, 2.6)], cells=1000), {"ends": [[(0.35, 1.65)]], "starts": [[(0.02, 2.6)]]}
    return certified_map(lower, grid, upper=lower.with_values(r=2.5), depth=5, **goal)


def test_a_goal_is_proved_refuted_and_open_where_paper_says(line, tmp_path):
    (axis,) = line.axes
    ends = np.array([[float(axis.borders[k]) for k in at] for at in line.index.tolist()])
    assert (ends[1:, 0] == ends[:-1, 1]).all()
    assert (ends[0, 0], ends[-1, 1]) == (2.3, 2.5)
    assert ends[line.code == PROVED, 1].max() < TOP
    assert ends[line.code == PROVED, 1].max() > TOP - 0.015
    assert ends[line.code == REFUTED, 0].min() > LEAVES
    assert ends[line.code == REFUTED, 0].min() < LEAVES + 0.015
    assert set(line.region[line.code == PROVED].tolist()) == {0}
    assert set(line.region[line.code != PROVED].tolist()) == {-1}
    shares, open_ = shares_of(saved(line, tmp_path))
    ours = line.shares()
    assert (shares["ends-in"], shares["refuted"], open_) == (
        ours["proved"],
        ours["refuted"],
        ours["undecided"],
    )
    assert sum(ours.values()) == 1
    assert ours["proved"] > Fraction(1, 5)
    assert ours["refuted"] > Fraction(1, 3)


def test_boxes_that_are_stretched_are_denied(line, tmp_path):
    f = opened(line.save(tmp_path / "plane.proof.zip")).copy()
    boxes, axis = f.header["boxes"], f.header["plane"]["axes"][0]
    last = max(k for k, box in enumerate(boxes) if any(c["claim"] == "ends-in" for c in box["claims"]))
    assert not boxes[last + 1]["claims"]
    del boxes[last + 1]
    axis["borders"][last + 1] = axis["borders"][last + 2]
    del axis["borders"][last + 2]
    for box in boxes[last + 1 :]:
        box["at"] = [[k - 1 for k in box["at"][0]]]
    boxes[last]["parameters"]["r"][1] = axis["borders"][last + 1]
    assert ls.recheck(f.seal().write(tmp_path / "x.proof.zip")).verdict == "failed"


@pytest.mark.parametrize("r", [("2.568359375", "2.56953125"), ("2.45", "2.46875"), ("2.4", "2.41")])
def test_a_range_is_told_as_refuted_only_if_the_checker_confirms_it(r, tmp_path):
    """In the boxes of a file, which are wider, the 4-cycle of the first range is not contracted, nor the second's."""
    lower, upper = (ls.map(ricker, r=float(end)) for end in r)
    goal = {"ends": [[(0.35, 1.65)]], "starts": [[(0.02, 2.6)]]}
    proof = ls.certify(lower, ls.grid([(0.02, 2.6)], cells=50), upper=upper, **goal)
    (claim,) = proof.claims
    assert (claim.verdict == "refuted") is (r[0] == "2.4")
    if claim.verdict == "refuted":
        assert ls.recheck(proof.save(tmp_path / "x.zip")).verdict == "refuted"


@pytest.mark.sweep
def test_cycles_split_where_the_period_doubles(tmp_path):
    lower, grid = ls.map(logistic, r=2.7), ls.grid([(0.1, 0.9)], cells=2048)
    found = certified_map(lower, grid, ["converges", "basin"], upper=lower.with_values(r=3.3), depth=8)
    periods = {}
    for at, record, region in zip(found.index.tolist(), found.records, found.region.tolist(), strict=True):
        low, high = (float(found.axes[0].borders[k]) for k in at)
        assert not (low <= 3.0 <= high and record.blocks)  # the fixed point's slope is 2 - r
        if record.blocks:
            assert record.periods == ((1,) if high < 3.0 else (2,))
            assert not record.exact
            periods.setdefault(region, set()).add(record.periods)
    assert periods == {0: {(1,)}, 1: {(2,)}}
    report = saved(found, tmp_path)
    assert report.verdict == "proved"
    assert shares_of(report)[0]["converges"] == found.shares()["proved"] > Fraction(4, 5)


def test_a_plane_has_two_attractors_within_the_cusp_alone(tmp_path):
    """a x - x^3 + b has two attracting fixed points where |b| < 2 ((a - 1)/3)^(3/2), and one beyond."""
    lower, grid = ls.map(cusp, a=1.2, b=0.0), ls.grid([(-1.4, 1.4)], cells=200)
    upper = lower.with_values(a=1.8, b=0.3)
    found = certified_map(lower, grid, upper=upper, first=6, depth=7, share=0.5)
    for at, record in zip(found.index.tolist(), found.records, strict=True):
        a, b = ([float(axis.borders[n]) for n in at[2 * j : 2 * j + 2]] for j, axis in enumerate(found.axes))
        assert record.blocks < 2 or b[1] < 2 * ((a[0] - 1) / 3) ** 1.5
    numbers = range(found.region.max() + 1)
    blocks = [set(found.blocks[found.region == k].tolist()) for k in numbers]
    assert all(len(each) == 1 for each in blocks)
    sizes = [found.share(found.region == k) for k in numbers]
    assert sum(size > Fraction(1, 4) for size, each in zip(sizes, blocks, strict=True) if each == {2}) == 1
    assert sum(size > Fraction(1, 2) for size, each in zip(sizes, blocks, strict=True) if each == {1}) == 1
    shares, open_ = shares_of(saved(found, tmp_path))
    assert (shares["basin"], open_) == (found.shares()["proved"], found.shares()["undecided"])
    assert (np.bincount(found.raster().ravel(), minlength=len(found.index)) > 0).all()


def test_every_start_tends_to_one_cycle_where_all_cells_lead_there():
    lower = ls.maps.Logistic(2.0)
    found = certified_map(
        lower, ls.grid([(0.1, 0.9)], cells=256), ["converges", "attracts-all"], upper=ls.maps.Logistic(2.5)
    )
    assert {record.exact for record in found.records} == {True}
    assert found.tables()[1].rows[0][3:] == ("1", "1")


def test_the_figure_has_every_box_once_and_lines_between_regions():
    """Four boxes: two proved, of one region, one refuted, one open, so that one line parts the region from none."""
    axis = CellAxis("r", "", tuple(Fraction(k) for k in range(5)))
    index, code = np.array([[k, k + 1] for k in range(4)], np.int32), np.array([1, 1, 2, 0], np.int8)
    records = tuple(record_of([0])._replace(blocks=int(word == 1)) for word in code.tolist())
    region = np.array([0, 0, -1, -1], np.int32)
    found = RegionsOfMap(ls.grid([(0, 1)], cells=1), (axis,), index, records, code, region, None, 0.0)
    figure = ls.plot.regions(found)
    (axes,) = figure.axes
    boxes = sorted((patch.get_x(), patch.get_width()) for patch in axes.patches)
    assert boxes == [(0, 1), (1, 1), (2, 1), (3, 1)]
    assert [line[0].tolist() for line in axes.collections[0].get_segments()] == [[2, 0]]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["undecided: 25 %", "proved, at least 1 attractor: 50 %", "refuted: 25 %"]
    with pytest.raises(AnswerError, match="of 3 parameters"):
        ls.plot.regions(RegionsOfMap(found.grid, (axis,) * 3, index, records, code, region, None, 0.0))


# ------------------------------------------------------------------------------------------------- cuts and glue


@pytest.mark.parametrize(
    ("box", "halves"),
    [
        ((0, 4, 0, 4), [(0, 2, 0, 4), (2, 4, 0, 4)]),
        ((0, 2, 0, 4), [(0, 2, 0, 2), (0, 2, 2, 4)]),
        ((4, 5, 0, 2, 6, 10), [(4, 5, 0, 2, 6, 8), (4, 5, 0, 2, 8, 10)]),
    ],
)
def test_a_box_is_halved_in_its_widest_direction(box, halves):
    assert list(_halves(box)) == halves


def record_of(component, rank=None):
    arrays = {"component": np.array(component), "rank": np.array(rank or [0] * len(component))}
    return RecordOfMap("proved", "", Part((), {}, arrays), max(component) + 1)


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        (record_of([0, 0, -1, 1]), record_of([-1, 0, -1, 1]), True),
        (record_of([0, 0, -1, 1]), record_of([1, 1, -1, 0]), True),  # they are numbered otherwise
        (record_of([0, 0, -1, 1]), record_of([0, 0, 0, 0]), False),
        (record_of([0, 0, 0, 1]), record_of([0, 1, 1, 1]), False),  # two meet one
        (record_of([0, 0, -1]), record_of([-1, -1, 0]), False),
        (
            record_of([0, 0, -1]),
            record_of([-1, 0, 0], [-1, 0, 0]),
            False,
        ),  # into cells that may lead elsewhere
        (record_of([0, 0, -1], [0, 0, -1]), record_of([-1, 0, 0]), False),
    ],
)
def test_neighbours_are_alike_where_components_meet_one_to_one(one, other, alike):
    assert _corresponds(one, other) is _corresponds(other, one) is alike


def test_cells_that_tend_to_a_cycle_need_no_more_than_a_common_one():
    one, other = record_of([0, 0, -1], [0, 0, -1]), record_of([-1, 0, 0])
    assert _corresponds(one._replace(periods=(1,)), other._replace(periods=(1,)))
    assert not _corresponds(one._replace(periods=(1,)), other)


def test_neighbours_share_a_face_in_every_direction():
    raster = np.arange(8).reshape(2, 2, 2)
    assert len(neighbours(raster)) == 12  # the edges of a cube
    assert not {(0, 3), (0, 7)} & set(map(tuple, neighbours(raster).tolist()))
    alike = regions([record_of([0])] * 8, raster, lambda one, other: one is other)
    assert alike.tolist() == [0] * 8


# ------------------------------------------------------------------------------------------------- what is refused


def asked(**changed):
    lower = ls.map(ricker, r=2.3)
    given = {"upper": lower.with_values(r=2.35), "ends": [[(0.35, 1.65)]]} | changed
    return certified_map(lower, ls.grid([(0.02, 2.6)], cells=100), **given)


def test_where_the_time_is_over_boxes_stay_undecided(tmp_path):
    found = asked(seconds=0.0)
    assert [CODES[code] for code in found.code] == ["undecided"]
    assert found.records[0].reason == "the 0 seconds were over"
    assert found.shares() == {"undecided": 1, "proved": 0, "refuted": 0}
    with pytest.raises(AnswerError, match="undecided everywhere"):
        found.save(tmp_path / "x.zip")


def test_a_share_of_the_domain_is_asked_for():
    """Of s x^3 in [-2, 2] the starts below 1/sqrt(s) come to 0, the others leave: half of the domain, or less."""
    lower = ls.map(cube, s=1.0)
    given = lower, ls.grid([(-2.0, 2.0)], cells=400)
    shares = [
        certified_map(*given, upper=lower.with_values(s=1.01), depth=0, share=share).shares()["proved"]
        for share in (0.45, 0.5)
    ]
    assert shares == [1, 0]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"upper": ls.map(ricker, r=2.3)}, "the parameters that vary is 'none'"),
        ({"upper": ls.map(ricker, r=2.2)}, "the upper corner of r"),
        ({"upper": ls.map(ricker, r=math.nextafter(2.3, 3.0))}, "the range of r"),
        ({"depth": 40}, "the argument depth of certified_map"),
        ({"first": 9}, "the argument first of certified_map"),
        ({"share": 1.5}, "the argument share of certified_map"),
        ({"claims": ["basin"]}, "the claims"),
    ],
)
def test_what_cannot_be_asked(changed, words):
    with pytest.raises(AnswerError) as error:
        asked(**changed)
    assert words in str(error.value)
