"""Periodic orbits on axes with a period: proved, denied, refused; the orbits are counted here in fractions."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.checker.maps_in_files import Example, MapCertificate, cycle, denied, hexed, refused, region
from tests.checker.test_axes_with_a_period import CELLS, arrays_of

BEGIN = Fraction(-5, 16)


def cat(x, *_):
    return 2 * x[0] + x[1], x[0] + x[1]


def doubling(x, *_):
    return (2 * x[0],)


def half_turn(x, *_):
    return (x[0] + 0.5,)


def value(x):
    """Where a state of a circle of length 1 lies in the domain."""
    return x - (x - BEGIN) // 1


def orbits(function, dimension, period, parts):
    """All orbits of a smallest period among the points with a denominator, and how often each step goes round."""
    listed, met = [], set()
    for start in itertools.product(range(parts), repeat=dimension):
        points, turns = [tuple(value(Fraction(k, parts)) for k in start)], []
        for _ in range(period):
            image = [Fraction(v) for v in function(points[-1])]
            points.append(tuple(map(value, image)))
            turns.append([int(y - x) for y, x in zip(image, points[-1], strict=True)])
        smallest = len(set(points[:-1])) == period
        if points[-1] == points[0] and smallest and points[0] not in met:
            met |= set(points)
            listed.append(cycle([[float(v) for v in point] for point in points[:-1]]) | {"turns": turns})
    return listed


def certificate(function, dimension, listed, periods=("1", "1"), begins=(BEGIN, BEGIN), **more):
    """A certificate of cycles alone."""
    section = {"cycles": listed, "begins": [hexed([float(v) for v in begins[:dimension]])]}
    example = Example(dimension, "", lambda x, *_: function(x))
    made = MapCertificate(example, [({}, {"cycles": section}, None)], **more)
    made.header["map"]["periodic"] = [list(periods[:dimension])]
    return made


def two_orbits():
    return certificate(cat, 2, orbits(cat, 2, 2, 5))


# Arnold's map has |det(A^p - 1)| = 1, 5, 16 points with f^p(x) = x, in fifths and quarters; doubling 2^p - 1.
@pytest.mark.parametrize(
    ("function", "dimension", "period", "parts", "count"),
    [
        (cat, 2, 1, 1, 1),
        (cat, 2, 2, 5, 2),
        (cat, 2, 3, 4, 5),
        (doubling, 1, 4, 15, 3),
    ],
)
def test_every_orbit_is_proved(function, dimension, period, parts, count, tmp_path):
    listed = orbits(function, dimension, period, parts)
    assert len(listed) == count
    report = certificate(function, dimension, listed).recheck(tmp_path)
    assert report.verdict == "proved", report


# ---------------------------------------------------------------- false


def shifted(listed, *by):
    """An orbit of the cat map so many turns on: the formula leads 2 x + y and x + y turns on."""
    boxes = [
        [[(float.fromhex(end) + turn).hex() for end in pair] for pair, turn in zip(box, by, strict=True)]
        for box in listed["boxes"]
    ]
    more = np.array(cat(by)) - by
    return listed | {"boxes": boxes, "turns": (np.array(listed["turns"]) + more).tolist()}


def first(made):
    return made.claims()["cycles"]["cycles"][0]


def add(made, listed):
    made.claims()["cycles"]["cycles"].append(listed)


def turned(made, point, axis, by):
    first(made)["turns"][point][axis] += by


def exchanged(made):
    """The turns of one axis at the other: those of some point differ."""
    assert any(one != other for one, other in first(made)["turns"])
    first(made)["turns"] = [along[::-1] for along in first(made)["turns"]]


def again(listed, parts):
    """An orbit as the orbit that follows several lists of points, one after another."""
    return parts[0] | {
        key: [v for part in parts for v in part[key]] for key in ("boxes", "side", "branch", "turns")
    }


def rolled(listed):
    return listed | {key: listed[key][1:] + listed[key][:1] for key in ("boxes", "side", "branch", "turns")}


def doubled(made, second):
    made.claims()["cycles"]["cycles"] = [again(first(made), [first(made), second])]


FALSE = {
    "a turn too many": (lambda made: turned(made, 0, 0, 1), "interior of X"),
    "a turn too few": (lambda made: turned(made, 1, 1, -1), "interior of X"),
    "very many turns": (lambda made: turned(made, 0, 1, 2**52), "interior of X"),
    "turns of the other axis": (exchanged, "interior of X"),
    "told twice": (lambda made: add(made, first(made)), "differ"),
    "told twice from another point": (lambda made: add(made, rolled(first(made))), "differ"),
    "told twice, a turn on": (lambda made: add(made, shifted(first(made), 1, 0)), "off the seam"),
    "a turn back": (
        lambda made: made.claims()["cycles"].update(cycles=[shifted(first(made), 0, -1)]),
        "off the seam",
    ),
    "period doubled": (lambda made: doubled(made, first(made)), "period is not 2"),
    "domain that begins behind a point": (
        lambda made: made.claims()["cycles"].update(begins=[hexed([-0.1, -0.3125])]),
        "off the seam",
    ),
    "attracts": (
        lambda made: first(made).update(attracts=True, frames=[hexed(np.eye(2))] * 2),
        "attracts is not proved",
    ),
    "another period": (lambda made: made.header["map"].update(periodic=[["1.01", "1"]]), "interior of X"),
}


@pytest.mark.parametrize("name", FALSE)
def test_false_orbits_are_denied(name, tmp_path):
    made = two_orbits()
    assert made.recheck(tmp_path).verdict == "proved"
    forge, why = FALSE[name]
    forge(made)
    denied(made, tmp_path, why)


def test_a_period_that_is_doubled_by_a_turn_is_denied(tmp_path):
    """A fixed point of doubling at 0 and at 1 is no orbit of period 2: 1 is not a value of the domain."""
    listed = cycle([[0.0], [1.0]]) | {"turns": [[-1], [2]]}
    denied(certificate(doubling, 1, [listed]), tmp_path, "off the seam")


def test_each_orbit_of_a_half_turn_is_undecided(tmp_path):
    listed = cycle([[0.125], [0.625]]) | {"turns": [[0], [1]]}
    denied(certificate(half_turn, 1, [listed]), tmp_path, "singular")


# ---------------------------------------------------------------- the seam


def quartered(x, *_):
    """No lift of a continuous map: just before the seam of [0, 1) it is near 1/4."""
    return (0.25 * x[0],)


ATTRACTS = cycle([[0.0]], frames=[[[1.0]]]) | {"turns": [[0]]}


def test_an_orbit_on_the_seam_is_denied(tmp_path):
    """States just before the seam are sent to 1/4, so that 0 does not attract, though the formula does there."""
    assert certificate(quartered, 1, [ATTRACTS]).recheck(tmp_path).verdict == "proved"
    denied(certificate(quartered, 1, [ATTRACTS], begins=[0.0]), tmp_path, "off the seam")


def converging(radius, begin=-0.25):
    """All cells within 1/64 of 0 tend to it, and all others come there: the map quarters x in [begin, begin + 1)."""
    edges = begin + np.arange(CELLS) / CELLS
    component = np.where((edges >= -1 / 64) & (edges < 1 / 64), 0, -1)
    arrays = arrays_of(edges, 1.0, 0.25 * edges, 0.25 * edges + 0.25 / CELLS, component)
    made = certificate(quartered, 1, [ATTRACTS | {"radius": hexed(radius)}], begins=[begin])
    made.claim("converges", components=[0], cycles=[0]).claim(
        "attracts-all", max_rank=int(arrays["rank"].max())
    )
    made.arrays |= {f"0.{name}": array for name, array in arrays.items()}
    return made


def test_a_ball_that_wraps_is_denied(tmp_path):
    assert converging(0.2).recheck(tmp_path).verdict == "proved"
    denied(converging(0.3), tmp_path, "balls lie in the domain")


def test_a_cell_before_the_seam_is_not_in_a_ball_behind_it(tmp_path):
    made = converging(0.2)
    made.arrays["0.component"][-1] = made.arrays["0.rank"][-1] = 0
    denied(made, tmp_path, "lies in a ball")


@pytest.mark.parametrize(
    ("starts", "ends", "verdict"),
    [
        ((-0.1, 0.1), (0.25, 0.5), "refuted"),
        ((0.1, 0.2), (0.25, 0.5), "failed"),
        ((-0.1, 0.1), (-0.1, 0.5), "failed"),
    ],
)
def test_a_goal_is_refuted_by_an_orbit_that_attracts(starts, ends, verdict, tmp_path):
    goal = {"starts": [region(starts)], "ends": [region(ends)]}
    made = certificate(quartered, 1, [ATTRACTS], goal=goal).claim("refuted")
    assert made.recheck(tmp_path).verdict == verdict


# ---------------------------------------------------------------- odd


def cylinder(made):
    """The second axis ends."""
    made.header["map"]["periodic"] = [["1", None]]
    made.claims()["cycles"]["begins"][0][1] = None


def section(**changed):
    return lambda made: made.claims()["cycles"].update(changed)


def turns(value_of_all):
    return lambda made: first(made).update(turns=value_of_all)


ODD = {
    "turns of an axis that ends": lambda made: cylinder(made),
    "no turns": lambda made: first(made).pop("turns"),
    "turns of too few points": turns([[0, 0]]),
    "turns of too few axes": turns([[0], [0]]),
    "turns that are not whole": turns([[0, 0.0], [0, 0]]),
    "turns that are true": turns([[True, 0], [0, 0]]),
    "turns beyond all numbers": turns([[2**53 + 1, 0], [0, 0]]),
    "no begins": lambda made: made.claims()["cycles"].pop("begins"),
    "begins of too many sides": section(begins=[hexed([0.0, 0.0])] * 2),
    "begins of too few axes": section(begins=[hexed([0.0])]),
    "begins null": section(begins=[[None, hexed(0.0)]]),
    "begins nan": section(begins=[["nan", hexed(0.0)]]),
    "begins of an axis that ends": lambda made: made.header["map"].update(periodic=[["1", None]]),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_orbits_are_refused(name, tmp_path):
    made = two_orbits()
    ODD[name](made)
    refused(made, tmp_path)


def test_boxes_of_parameters_begin_alike(tmp_path):
    made = two_orbits()
    made.header["boxes"].append(made.copy().header["boxes"][0] | {"prefix": "1."})
    assert made.recheck(tmp_path).verdict == "proved"
    made.claims(1)["cycles"]["begins"] = [hexed([-0.3125, -0.25])]
    refused(made, tmp_path)


# ---------------------------------------------------------------- sides


def on_two_sides(periods, points, turns):
    """Side 0 is sent to side 1 by x / 2 + 9 / 4, and back by x / 2 + 3."""
    example = Example(
        1,
        "",
        lambda x, p, side, _: 0.5 * x[0] + (3.0 if side else 2.25),
        sides=2,
        to=lambda side, _: 1 - side,
    )
    listed = cycle([[x] for x in points], sides=[0, 1]) | {"turns": [[k] for k in turns]}
    begins = [[None if period is None else hexed(-0.25)] for period in periods]
    made = MapCertificate(example, [({}, {"cycles": {"cycles": [listed], "begins": begins}}, None)])
    made.header["map"]["periodic"] = [[period] for period in periods]
    return made


@pytest.mark.parametrize(
    ("periods", "points", "turns", "verdict"),
    [
        (("1", "2"), (1 / 6, 1 / 3), (1, 3), "proved"),  # y = x / 2 + 1 / 4, x = y / 2
        (("2", "1"), (1 / 6, 1 / 3), (1, 3), "failed"),
        (("1", "2"), (1 / 6, 1 / 3), (3, 1), "failed"),
        (("1", None), (1 / 6, 7 / 3), (0, 4), "proved"),  # y = x / 2 + 9 / 4, x = y / 2 - 1
        (("1", None), (1 / 6, 7 / 3), (4, 0), "bad file"),
    ],
)
def test_turns_are_of_the_side_that_a_step_leads_to(periods, points, turns, verdict, tmp_path):
    assert on_two_sides(periods, points, turns).recheck(tmp_path).verdict == verdict
