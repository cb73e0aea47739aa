"""Arithmetic and formulas of the proof by two throws: against exact rationals and the throw at 50 digits.

The formulas are written here again from the model's text, for the derivatives; for values `tests/thrower/reference.py`
has them, which finds the impact by a scan.
"""

import copy
import math
import operator
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from mpmath import mp, mpf

import limitsets as ls
from limitsets.feeder.thrower import Energy, Exact, Signed, SmallAngle, SmallAngle2
from limitsets.proofs.prover import two_throws
from limitsets.proofs.prover.numbers import Intervals, RationalInterval, root
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.two_throws import (
    FLIP,
    JOG,
    Formulas,
    OneSide,
    ThrowNumbers,
    TwoThrows,
    angle,
    variable,
)
from tests.inverse.exact import feet as plane_feet
from tests.thrower import reference

# ------------------------------------------------------------------------------------------------- the intervals

ENDS = [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e-160, -1e-160, 0.1, 1.0, -1.0, 3.0, -7.3, 1e10, -1e154]
ENDS += [1.7e308, -1.7e308]


def some_intervals(random, count):
    """Intervals of all signs and sizes, zeros, points and subnormal ends among them."""
    sizes = np.where(random.random((2, count)) < 0.3, random.choice(ENDS, (2, count)), 0.0)
    plain = random.normal(size=(2, count)) * 10.0 ** random.integers(-5, 5, (2, count))
    ends = np.where(random.random((2, count)) < 0.7, plain, sizes)
    ends[1] = np.where(random.random(count) < 0.2, ends[0], ends[1])
    return Intervals(ends.min(axis=0), ends.max(axis=0))


def members(random, x, k):
    """Exact numbers of one of them: its ends, and one between."""
    lo, hi = Fraction(float(x.lo[k])), Fraction(float(x.hi[k]))
    return lo, hi, lo + (hi - lo) * Fraction(int(random.integers(0, 1 << 30)), 1 << 30)


def holds(found, k, exact):
    lo, hi = float(found.lo[k]), float(found.hi[k])
    below = lo == -math.inf or (math.isfinite(lo) and Fraction(lo) <= exact)
    return below and (hi == math.inf or (math.isfinite(hi) and exact <= Fraction(hi)))


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_every_operation_holds_the_exact_results():
    random = np.random.default_rng(0)
    x, y = (some_intervals(random, 1500) for _ in range(2))
    two = {
        "+": (x + y, lambda a, b: a + b),
        "-": (x - y, lambda a, b: a - b),
        "*": (x * y, lambda a, b: a * b),
        "/": (x / y, lambda a, b: a / b),
    }
    one = {
        "negative": (-x, lambda a: -a),
        "square": (x.square(), lambda a: a * a),
        "absolute": (x.absolute(), abs),
        "float": (3.5 - x * 0.1, lambda a: Fraction(3.5) - a * Fraction(0.1)),
        "int": (2 * x + 1, lambda a: 2 * a + 1),
    }
    looked = dict.fromkeys([*two, *one], 0)
    for k in range(x.lo.size):
        of_x, of_y = members(random, x, k), members(random, y, k)
        for name, (found, plain) in two.items():
            if math.isnan(found.lo[k]) or math.isnan(found.hi[k]):
                continue
            assert all(holds(found, k, plain(a, b)) for a in of_x for b in of_y), (name, k)
            looked[name] += 1
        for name, (found, plain) in one.items():
            assert all(holds(found, k, plain(a)) for a in of_x), (name, k)
            looked[name] += 1
    assert min(looked.values()) > 400


def test_results_are_hardly_wider_than_the_exact_ones():
    """Else `holds` would be satisfied by anything."""
    random = np.random.default_rng(1)
    at = random.uniform(0.5, 2.0, (2, 200))
    x, y = (Intervals(each, each) for each in at)
    for found in (x + y, x - y, x * y, x / y, x.square(), x.square_root(), x.absolute()):
        assert (found.hi - found.lo < 1e-14).all()


def test_square_roots():
    random = np.random.default_rng(2)
    lo = 10.0 ** random.uniform(-300, 300, 300)
    x = Intervals(lo, lo * random.uniform(1.0, 3.0, 300))
    found = x.square_root()
    for k in range(300):
        assert 0 <= Fraction(float(found.lo[k])) ** 2 <= Fraction(float(x.lo[k]))
        assert Fraction(float(found.hi[k])) ** 2 >= Fraction(float(x.hi[k]))


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-1.0, 4.0), (-2.0, -1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_what_is_impossible_is_nan_and_every_comparison_with_it_is_false(ends):
    wrong = [Intervals.of(*ends).square_root()]
    if ends[0] <= 0.0 <= ends[1]:
        wrong += [1.0 / Intervals.of(*ends), Intervals.of(1.0, 2.0) / Intervals.of(*ends)]
    for bad in wrong:
        for found in (bad, -bad, bad + 1.0, 2 * bad, bad.square(), bad.absolute(), bad * 0.0, 0.0 / bad):
            assert np.isnan(found.lo).all()
            assert np.isnan(found.hi).all()
            assert not (found.hi <= math.inf).any()
            assert not (found.lo >= -math.inf).any()


def test_spans_are_taken_from_either_side():
    third = RationalInterval(Fraction(1, 3), Fraction(1, 3))
    x = Intervals.of(2.0)
    one, two = Fraction(1, 3), Fraction(2)
    for of in (operator.add, operator.sub, operator.mul, operator.truediv):
        for found, exact in ((of(x, third), of(two, one)), (of(third, x), of(one, two))):
            assert holds(found, 0, exact)
            assert found.hi[0] - found.lo[0] < 1e-14
    with pytest.raises(TypeError):
        x + "1"


# ------------------------------------------------------------------------------------- a throw by its impact angle

FLIGHTS = {"exact": Exact(), "small-angle": SmallAngle(), "small-angle-2": SmallAngle2()}
FLIPS = {"signed": Signed(), "energy": Energy()}
MODELS = list(product(FLIGHTS, FLIPS))


def between(value):
    """The doubles around a number of 50 digits."""
    near = float(value)
    return Intervals.of(math.nextafter(near, -math.inf), math.nextafter(near, math.inf))


def narrow(found, value, width):
    """Whether it holds a number of 50 digits, and hardly more."""
    lo, hi = float(found.lo[0]), float(found.hi[0])
    return mpf(lo) <= value <= mpf(hi) and hi - lo < width


@pytest.mark.parametrize(("flight", "flip"), MODELS)
@pytest.mark.parametrize("name", reference.PAPER)
def test_the_formulas_are_those_of_the_throw_at_50_digits(name, flight, flip):
    facts = reference.paper(name, flight=flight, flip=flip)
    of, random, flips = Formulas(FLIGHTS[flight], FLIPS[flip]), np.random.default_rng(3), set()
    for side, start in product(range(3), random.uniform(0.05, 0.95, 6)):
        a, d = facts.numbers["a"][side], facts.numbers["d"][side]
        after = (side + 1) % 3
        x = a + start * (facts.numbers["arm_length"] - a)
        thrown = reference.throw(facts, side, x)
        shift = Intervals.of(a) + facts.numbers["length"][after] - facts.numbers["a"][after]
        part = OneSide(Intervals.of(a), Intervals.of(d), shift)
        n = ThrowNumbers([part], *(Intervals.of(facts.numbers[key]) for key in KEYS))
        at = angle(between(thrown.phi))
        assert narrow(of.start(n, part, at), mpf(x), 1e-10)
        for branch in (JOG, FLIP):
            landed = reference.land(facts, side, mpf(x), thrown.phi, branch == FLIP)
            assert narrow(of.end(n, part, at, Intervals.of(x), branch), landed, 1e-10)
        margin = of.margin(n, part, at, Intervals.of(x))
        if flip == "energy" and thrown.past:  # then the reference says only that it flips
            assert margin.lo[0] > 0.0
        else:
            assert narrow(margin, thrown.margin, 1e-9)
        flips.add(bool(thrown.margin > 0))
    if (flight, flip) == reference.PAPER[name][:2]:
        assert flips == {False, True}


KEYS = ("radius_of_gyration", "kappa", "surface_height")


# ------------------------------------------------------------------------------- derivatives by what is not known

DESIGNED = {
    "throw.kappa": 25.3778518,
    "arm.surface_height": -0.2,
    "part.sides[0]": 5.75,
    "part.sides[1]": 3.6,
    "part.sides[2]": 6.75,
    "part.mass.center.along": 4.2255778,
    "part.mass.center.above": 0.7082490,
    "part.mass.radius_of_gyration": 1.25,
}


def written(name, model=None):
    tree = copy.deepcopy(ls.load(name).as_dict())
    return tree | ({"model": dict(zip(("flight", "flip"), model, strict=True))} if model else {})


def boxed(tree, widths):
    """A scene and its text, quantities of which are pairs of texts: their values -+ a width [in]."""
    wide = copy.deepcopy(tree)
    for name, width in widths.items():
        *path, last = name.replace("[", ".").replace("]", "").split(".")
        node, last = wide, int(last) if last.isdigit() else last
        for word in path:
            node = node[word]
        value = Fraction(node[last].split()[0])
        node[last] = [f"{float(value - width)!r} in", f"{float(value + width)!r} in"]
    return ls.load(tree), wide


def feet(values):
    """(a, d, L) of every side at 50 digits."""
    return [(*foot, values[f"part.sides[{k}]"]) for k, foot in enumerate(plane_feet(values))]


def by_hand(model, part, shift, values, p):
    """Where a throw with the angle p starts, jogs and flips to, and what decides: from the model's text."""
    (a, d, _), kappa, h = part, values["throw.kappa"], values["arm.surface_height"]
    rho2 = values["part.mass.radius_of_gyration"] ** 2
    flight, flip = model
    inertia = rho2 + a**2 + d**2
    if flight == "exact":
        x = (a * mp.sin(p) - d * (1 - mp.cos(p)) + kappa / 2 * p**2) / p
        right, above = a * mp.cos(p) - d * mp.sin(p), a * mp.sin(p) + d * mp.cos(p)
        omega = (rho2 + right * (x - kappa * p) + above * (h + d)) / inertia
        jog = x - (h + d) * p - right + a
        potential, past = kappa * (mp.hypot(a, d) - above), right < 0
    else:
        x = a + p * (kappa - (d if flight == "small-angle-2" else 0)) / 2
        omega = (rho2 - a * x + 2 * a**2 + d**2 + d * h) / inertia
        jog = x - h * p
        potential, past = kappa * (mp.hypot(a, d) - d) - 2 * a * (x - a), False
    kinetic = inertia * omega**2 / 2
    turned = mp.sign(omega) * kinetic if flip == "signed" else kinetic
    return x, jog, jog - shift, turned - (-potential if past else potential)


def terms_by_hand(model, kind, values, first, second, landed):
    sides = feet(values)
    shifts = [sides[k][0] + sides[(k + 1) % 3][2] - sides[(k + 1) % 3][0] for k in range(3)]
    then = (kind.side + kind.first) % 3
    one = by_hand(model, sides[kind.side], shifts[kind.side], values, first)
    two = by_hand(model, sides[then], shifts[then], values, second)
    signs = [1 if branch == FLIP else -1 for branch in (kind.first, kind.second)]
    away = one[1 + kind.first] + landed - two[0]
    return [two[1 + kind.second], signs[0] * one[3], signs[1] * two[3], away]


WIDTHS = {name: Fraction(1, 200) for name in DESIGNED}


@pytest.mark.parametrize("model", MODELS)
def test_terms_and_their_derivatives_hold_those_at_50_digits(model):
    scene, wide = boxed(written("paper-designed", model), WIDTHS)
    boxes = two_throws._Boxes(parameter_box(scene, tree=wide), scene, 20.0)
    lengths = [f"part.{name}" for name in ("sides[0]", "sides[1]", "sides[2]")]
    lengths += [f"part.mass.{name}" for name in ("center.along", "center.above", "radius_of_gyration")]
    assert sorted(boxes.names) == sorted(lengths)
    names = ["throw.kappa", "arm.surface_height", *boxes.names]
    random = np.random.default_rng(5)
    centre = np.array([0.9, 1.1, 0.0, *(DESIGNED[name] for name in names)])
    kinds = (TwoThrows(*each) for each in product((0, 2), (JOG, FLIP), (JOG, FLIP)))
    for kind, (size, most) in product(kinds, ((0.004, 100.0), (4e-5, 1.0))):
        half = random.uniform(0.0, size, centre.size)
        lo, hi = centre - half, centre + half
        count = centre.size
        ends = [Intervals(lo[k : k + 1], hi[k : k + 1]) for k in range(count)]
        rising = boxes._terms(kind, [variable(each, k, count) for k, each in enumerate(ends)])
        point = random.uniform(lo, hi)
        at = boxes._at(kind, point[:, None])

        def by_one(k, value, kind=kind, point=point):
            moved = [mpf(v) for v in point.tolist()]
            moved[k] = value
            first, second, landed, *others = moved
            values = dict(zip(names, others, strict=True))
            return terms_by_hand(model, kind, values, first, second, landed)

        exact = by_one(0, mpf(point[0]))
        for term, own, value in zip(rising, at, exact, strict=True):
            assert narrow(own, value, 1e-9)
            assert term.value.lo[0] <= value <= term.value.hi[0]
        step = mpf(10) ** -15
        for k in range(count):
            here = mpf(point[k])
            up, down = by_one(k, here + step), by_one(k, here - step)
            for term, above, below in zip(rising, up, down, strict=True):
                slope = term.derivatives[k].rows(1)
                # a central difference at 50 digits is right to some 1e-25
                assert slope.lo[0] - 1e-20 <= (above - below) / (2 * step) <= slope.hi[0] + 1e-20
                assert slope.hi[0] - slope.lo[0] < most


def test_the_root_of_what_may_be_0_is_nan_with_its_derivatives():
    found = root(variable(Intervals.of(-1.0, 1.0), 0, 1))
    for each in (found.value, found.derivatives[0]):
        assert np.isnan(each.lo).all()
        assert np.isnan(each.hi).all()


# --------------------------------------------------------------------- a variable in which G neither rises nor falls


def an_open_box(model, second, names):
    """A box, narrow but for the second angle r, over which G is convex in r and flat in its middle.

    Along r, G = x''(r) + u (x'(p) - P(r)) with u = dx''/dP there; jogs and flips lead the farther on the farther out
    they begin (dx'/dx rises while a sin p - d (1 - cos p) does).  Returns its ends, u, and G in its middle and at the
    higher of its ends.
    """
    values = {name: mpf(value) for name, value in DESIGNED.items()}
    kind, r = TwoThrows(2, JOG, second), mpf("0.8")

    def terms(p, r):
        return terms_by_hand(model, kind, values, p, r, mpf(0))

    p = mp.findroot(lambda p: terms(p, r)[3], (mpf("0.7"), mpf("0.8")))
    up, down = terms(p, r + mpf(10) ** -15), terms(p, r - mpf(10) ** -15)
    u = float(-(up[0] - down[0]) / (up[3] - down[3]))
    bounds = [float(terms(p, at)[0] + u * terms(p, at)[3]) for at in (r, r - mpf("0.05"), r + mpf("0.05"))]
    centre = np.array([float(p), float(r), 0.0, *(DESIGNED[name] for name in names)])
    half = np.where(np.arange(centre.size) == 1, 0.05, 1e-9)
    return kind, centre - half, centre + half, u, bounds[0], max(bounds[1:])


@pytest.mark.parametrize("second", [JOG, FLIP])
def test_what_neither_rises_nor_falls_costs_its_derivative(second):
    model = ("exact", "signed")
    scene, wide = boxed(written("paper-designed", model), WIDTHS)
    boxes = two_throws._Boxes(parameter_box(scene, tree=wide), scene, 20.0)
    names = ["throw.kappa", "arm.surface_height", *boxes.names]
    kind, lo, hi, u, middle, top = an_open_box(model, second, names)
    assert middle < top - 1e-3
    ends = tuple(each[:, None] for each in (lo, 0.5 * (lo + hi), hi))
    rising = [
        variable(Intervals(*each), k, lo.size) for k, each in enumerate(zip(ends[0], ends[2], strict=True))
    ]
    slopes = [[by.rows(1) for by in term.derivatives] for term in boxes._terms(kind, rising)]
    weights = [Intervals.of(each) for each in (0.0, 0.0, u)]
    for x, failed in ((middle + 1e-5, 1), (top - 1e-5, 1), (top + 0.5, 0)):
        boxes.x = x
        left = np.array([0])
        found, along = boxes._weighed(kind, left, slopes, weights, ends, 0.5 * (ends[2] - ends[0]) + 1e-15)
        assert found.size == failed
        assert (along == 1).all()
