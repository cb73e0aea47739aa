"""All periodic orbits of a map in a domain: counted against theory, rechecked, and forged."""

import itertools
from fractions import Fraction
from typing import NamedTuple

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.maps_of_tests import henon, logistic
from tests.proofs import forge
from tests.proofs.test_certificates_of_maps import gap


def cube(x, y, z):
    return 0.25 * y, 2 * z + 0.25, -x


class Switch(NamedTuple):
    slope: float


def switched(p, x, side):
    return (0.5 * x + 0.1 if side == 0 else p.slope * x + 1.0), 1 - side, 0


ls.register(Switch, image=switched)

RECTANGLE = [(-1.5, 1.5), (-0.5, 0.5)]


def counts_of_words(period):
    """Orbits of the map with a gap by period: each word of branches has one point, in fractions; kept if it follows."""
    s, counts = Fraction(7, 5), {}
    for p in range(1, period + 1):
        orbits = set()
        for word in itertools.product((0, 1), repeat=p):
            shifts = [Fraction(9, 10) - Fraction(19, 10) * b for b in word]
            total = sum(c * s ** (p - 1 - k) for k, c in enumerate(shifts))
            points = [total / (1 - s**p)]
            for c in shifts[:-1]:
                points.append(s * points[-1] + c)
            follows = all((x > 0) == bool(b) for x, b in zip(points, word, strict=True))
            if follows and len(set(points)) == p and -1.3 <= min(points) <= max(points) <= 1.2:
                orbits.add(frozenset(points))
        counts[p] = len(orbits)
    return counts


# Map, upper corner's values, box, period, and the number of orbits by period.  Of Henon's map: Galias, "Interval
# methods for rigorous investigations of periodic orbits", 2001, and the fixed point outside the attractor.
# x' = 4 x (1 - x) has 2^p points with F^p(x) = x.
CASES = {
    "henon": (lambda: ls.map(henon, a=1.4, b=0.3), {}, RECTANGLE, 9, (2, 1, 0, 1, 0, 2, 4, 7, 6)),
    "range": (lambda: ls.map(henon, a=1.3999, b=0.3), {"a": 1.4001}, RECTANGLE, 5, (2, 1, 0, 1, 0)),
    "steep": (lambda: ls.map(logistic, r=4.0), {}, [(-0.25, 1.25)], 7, (2, 1, 2, 3, 6, 9, 18)),
    "gap": (gap, {}, [(-1.3, 1.2)], 8, tuple(counts_of_words(8).values())),
    "cube": (lambda: ls.map(cube), {}, [(-2, 2)] * 3, 3, (1, 0, 0)),
    "sides": (lambda: Switch(-1.5), {}, [(-2, 2)], 4, (0, 1, 0, 0)),
    "none": (lambda: ls.map(henon, a=1.4, b=0.3), {}, [(0.7, 1.5), (-0.5, 0.5)], 4, (0, 0, 0, 0)),
}


def certified(name):
    make, upper, box, period, _ = CASES[name]
    lower = make()
    domain = ls.cells.Domain([[-2.0]] * 2, [[2.0]] * 2) if name == "sides" else box
    grid = ls.grid(domain, cells=8)
    corner = lower.with_values(**upper) if upper else None
    return ls.certify(
        lower, grid, ["all-cycles", "cycles"][: 1 + (name == "gap")], upper=corner, period=period
    )


@pytest.mark.parametrize("name", CASES)
def test_the_orbits_are_as_many_as_theory_says_and_the_checker_finds_no_other(name, tmp_path):
    proof, expected = certified(name), CASES[name][4]
    assert proof.claims[0].verdict == "proved"
    assert tuple(sum(c.period == p for c in proof.cycles) for p in range(1, len(expected) + 1)) == expected
    report = ls.recheck(proof.save(tmp_path / "all.proof.zip", recheck=False))
    assert f"all periodic orbits of periods up to {CASES[name][3]} whose points lie in" in str(report.map)
    if name == "gap":
        assert proof.claims[1].section["complete"]
    if name == "sides":  # x = -1.5 (0.5 x + 0.1) + 1 on side 0
        on_zero = int(proof.cycles[0].side[1] == 0)
        assert proof.cycles[0].lo[on_zero, 0] <= 0.85 / 1.75 <= proof.cycles[0].hi[on_zero, 0]


@pytest.mark.parametrize(
    ("make", "box", "reason"),
    [
        (lambda: ls.map(logistic, r=4.0), [(0, 1)], "border"),  # the fixed point 0
        # slope -1 at 2/3, where a 2-cycle is born
        (lambda: ls.map(logistic, r=3.0), [(0.1, 0.9)], "multiplier"),
        (lambda: ls.map(logistic, r=1.0), [(-0.5, 0.5)], "multiplier"),  # a double fixed point
    ],
)
def test_what_cannot_be_told_apart_stays_open(make, box, reason):
    claim = ls.certify(make(), ls.grid(box, cells=8), ["all-cycles"], period=2).claims[0]
    assert claim.verdict == "undecided"
    assert reason in claim.reason


def test_the_period_stands_with_its_claim_alone():
    grid = ls.grid(RECTANGLE, cells=8)
    for claims, period in (
        (["all-cycles"], None),
        (["cycles"], 3),
        (["all-cycles"], 0),
        (["all-cycles"], 201),
    ):
        with pytest.raises(AnswerError, match="the period"):
            ls.certify(ls.map(henon, a=1.4, b=0.3), grid, claims, period=period)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """All orbits of Henon's map in the upper part of the rectangle, which holds one of the fixed points."""
    grid = ls.grid([(-1.0, 1.5), (-0.5, 0.5)], cells=8)
    proof = ls.certify(ls.map(henon, a=1.4, b=0.3), grid, ["all-cycles"], period=4)
    return proof.save(tmp_path_factory.mktemp("orbits") / "all.proof.zip", recheck=False)


def domain(change):
    return lambda s: change(s["all-cycles"]["domain"][0])


def ends(lo, hi):
    return lambda domain: domain["box"].__setitem__(0, [lo.hex(), hi.hex()])


def claimed(**more):
    return lambda s: s["all-cycles"].update(more)


FORGED = {
    "an orbit is left out": (lambda s: s["cycles"]["cycles"].pop(0), "not told apart from the listed"),
    "one more period": (claimed(period=6), "not told apart from the listed"),
    "a domain with another fixed point": (domain(ends(-1.5, 1.5)), "not told apart from the listed"),
    "an orbit of a longer period": (claimed(period=3), "longer period"),
    "a domain without an orbit": (domain(ends(0.5, 1.5)), "lies in the domain is not proved"),
    "a domain that ends before an orbit": (domain(ends(-1.0, 0.5)), "lies in the domain is not proved"),
    # files that are none
    "half a period": (claimed(period=2.5), None),
    "no period": (claimed(period=0), None),
    "no domain": (claimed(domain=[]), None),
    "another side": (domain(lambda each: each.update(side=1)), None),
    "ends exchanged": (domain(lambda each: each["box"][0].reverse()), None),
    "a key too many": (claimed(more=1), None),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_list_that_is_not_complete_is_denied(name, whole, tmp_path):
    change, reason = FORGED[name]

    def of_sections(header):
        change({each["claim"]: each["section"] for each in header["boxes"][0]["claims"]})

    report = ls.recheck(forge.rewritten(whole, tmp_path / "forged.proof.zip", of_sections))
    assert report.verdict == ("failed" if reason else "bad file")
    assert not reason or reason in {claim: text for claim, _, text in report.claims}["all-cycles"]
