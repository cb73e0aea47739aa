"""Certificates of own maps, of some written here and of random ones."""

import inspect
import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError
from limitsets.base.files import as_json, as_plain
from limitsets.numbers.interval import mul
from tests.maps_of_tests import Tent, affine, henon, odd, turned
from tests.proofs.test_of_map import growth
from tests.sets.test_cycles import require_closed

# ----------------------------------------------------------------
# Proofs of own maps: what is refused, of which functions a claim is, and claims that finer cells must not lose.


class Gains(NamedTuple):
    slope: float
    up: bool


class Sort(NamedTuple):
    gains: Gains
    shift: object
    upside: bool


def _sort(p, x, side):
    return p.gains.slope * x, side, 0


class PerSide(NamedTuple):
    slope: np.ndarray


def _per_side(p, x, side):
    return p.slope[side] * x, side, 0


def _slow(p, x, side):
    return p.slope * x, side, 0


class Boxed(NamedTuple):
    """A box by hand that is of the lower corner alone."""

    slope: float


def _box_of_the_lower(low, high, lo, hi, side):
    after = mul((low.slope, low.slope), (lo, hi))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


class Ends(NamedTuple):
    """A box by hand that is of both corners, and of nothing between."""

    power: float


def _ends(p, x, side):
    return 0.4 * x + p.power * (1.0 - p.power), side, 0


def _box_of_ends(low, high, lo, hi, side):
    a, b = low.power * (1.0 - low.power), high.power * (1.0 - high.power)
    slot = (0.4 * lo + min(a, b) - 1e-9, 0.4 * hi + max(a, b) + 1e-9, side, 0)
    return 1, slot, slot, (0.0, 0.0)


class Gathered(NamedTuple):
    slope: float


class Wanders(NamedTuple):
    slope: float


def _gathered(p, side):
    return p


def _wanders(p, start, step):
    return p


ls.register(Sort, image=_sort)
ls.register(PerSide, image=_per_side)
ls.register(Boxed, image=_slow, image_box=_box_of_the_lower)
ls.register(Ends, image=_ends, image_box=_box_of_ends)
ls.register(Gathered, image=_slow, on_side=_gathered)
ls.register(Wanders, image=_slow, scattered=_wanders)

LINE, HALF = ls.grid([(-1.0, 1.0)], cells=64), ls.map(affine, a=0.5, b=0.0)


# ---------------------------------------------------------------- refused


def _three(p, x, side):
    branch = 0 if x <= 0.0 else (1 if x <= 0.5 else 2)
    return p.slope * x - branch, side, branch


def _three_on(p, x, side, branch):
    return p.slope * x - branch, side


def _three_margin(p, x, side):
    return x


@pytest.mark.parametrize("branches", [("only",), ("low", "middle", "high")])
def test_a_margin_is_of_two_branches(branches):
    class Named(NamedTuple):
        slope: float

    with pytest.raises(MapError, match="number of branches of a map with margin") as caught:
        ls.register(Named, image=_three, image_on=_three_on, margin=_three_margin, branches=branches)
    assert f"margin is {len(branches)};" in str(caught.value)
    # the class is not half registered
    ls.register(Named, image=_three, image_on=_three_on, branches=("low", "middle", "high"))


def sort(slope=0.5, up=True, shift=None, upside=False):
    return Sort(Gains(slope, up), shift, upside)


@pytest.mark.parametrize(
    ("lower", "upper", "name"),
    [
        (sort(), sort(upside=True), "upside"),
        (sort(), sort(up=False), "gains.up"),
        (sort(), sort(shift=0.0), "shift"),
        (sort(shift=0.0), sort(), "shift"),
        (sort(0.5), sort(0.4), "gains.slope"),
        (sort(0.5), sort(math.nan), "gains.slope"),
        (sort(shift=0.1), sort(shift=0.0), "shift"),
        (PerSide(np.array([0.5, 0.4])), PerSide(np.array([0.6, 0.3])), "slope"),
        (PerSide(np.array([0.5])), PerSide(np.array([0.6, 0.7])), "slope"),
        (PerSide(np.array([0.5])), PerSide(0.6), "slope"),
        (HALF, growth(1.0), "the parameters"),
        (HALF, 0.6, "the parameters"),
    ],
)
def test_corners_differ_in_numbers_alone(lower, upper, name):
    with pytest.raises(AnswerError, match=f"upper corner of {name}"):
        ls.certify(lower, LINE, ["invariant"], upper=upper)
    with pytest.raises(AnswerError, match=f"upper corner of {name}"):
        ls.transitions(lower, LINE, "boxes", upper=upper)


@pytest.mark.sweep
def test_corners_that_differ_in_numbers_are_taken():
    nested = ls.certify(sort(0.4, shift=0.1), LINE, ["invariant"], upper=sort(0.5, shift=0.2))
    assert nested.proved
    sides = ls.certify(PerSide(np.array([0.4])), LINE, ["invariant"], upper=PerSide(np.array([0.5])))
    assert sides.proved


@pytest.mark.parametrize(("params", "name"), [(Gathered(0.5), "on_side"), (Wanders(0.5), "scattered")])
def test_what_an_orbit_gathers_or_draws_is_not_proved(params, name):
    with pytest.raises(AnswerError, match=f"which has {name}.*register the map without {name}"):
        ls.certify(params, LINE, ["invariant"])


def test_the_throw_is_proved_as_a_scene():
    scene = ls.load("paper-designed")
    with pytest.raises(AnswerError, match=r"pass the scene: limitsets\.certify\(scene\)"):
        ls.certify(scene.map, ls.grid(scene.domain, cells=64), ["invariant"])


# ---------------------------------------------------------------- agreement


# p (1 - p) is 0.16 at 0.2 and at 0.8, and 0.25 at 0.5
@pytest.mark.parametrize(("lower", "upper"), [(Boxed(0.5), Boxed(0.6)), (Ends(0.2), Ends(0.8))])
def test_a_box_is_held_against_images_at_both_corners_and_between(lower, upper):
    ls.transitions(lower, LINE, "boxes", upper=lower)
    with pytest.raises(MapError, match=f"proved box of the kernel image_box of {type(lower).__name__}"):
        ls.certify(lower, LINE, ["invariant"], upper=upper)


# ---------------------------------------------------------------- of which functions


def test_a_proof_says_of_which_functions_it_is():
    tent = ls.certify(Tent(1.8), ls.grid([(0.15, 0.93)], cells=512), ["invariant", "expanding"])
    assert "of image_on and margin" in str(tent)
    assert "of image_on and margin" in tent.tables()[0].text()
    assert [row["of"] for row in as_plain(tent)] == ["image_on and margin"] * 2
    one = ls.certify(HALF, LINE, ["invariant"])
    assert "of image\n" in str(one).replace(":", "\n")
    boxed = ls.certify(Boxed(0.5), LINE, ["invariant", "cycles"])
    assert "of image_box" in str(boxed)
    told = boxed.to_json()
    assert [row["of"] for row in told] == ["image_box", "image_box and image"]
    assert told[1]["cycles"][0]["attracts"] is True
    assert told[0]["parameters"] == [{"slope": 0.5}, {"slope": 0.5}]
    assert '"verdict": "proved"' in as_json(boxed)


# ---------------------------------------------------------------- claims


@pytest.mark.parametrize("cells", [1024, 4096])
def test_finer_cells_do_not_lose_attracts_all(cells):
    # one fixed point attracts all, of slope 1 - r in -0.6 .. -0.5
    proof = ls.certify(growth(1.5), ls.grid([(0.01, 2.5)], cells=cells), ["attracts-all"], upper=growth(1.6))
    assert proof.claims[0].verdict == "proved", proof.claims[0].reason
    steps = proof.claims[0].section["max_rank"]
    random = np.random.default_rng(1)
    for r in (1.5, 1.6, *random.uniform(1.5, 1.6, 3)):
        x, _, _, made = ls.maps.advance(growth(float(r)), random.uniform(0.01, 2.5, 4000), 0, steps)
        assert (made == steps).all()
        assert proof.cells.mask[proof.graph.grid.index(x[:, None], 0)].all()


def test_a_repelling_fixed_point_is_not_passed():
    # r = 2.2: the fixed point repels, slope -1.2, so not every start comes to the cycle of period 2
    proof = ls.certify(growth(2.2), ls.grid([(0.02, 1.8)], cells=4096), ["attracts-all"])
    assert proof.claims[0].verdict == "undecided"
    assert "do not attract" in proof.claims[0].reason


@pytest.mark.parametrize(
    ("slope", "verdict"), [(0.5, "refuted"), (-0.999, "refuted"), (1.0, "undecided"), (-1.0, "undecided")]
)
def test_a_slope_below_1_everywhere_refutes_expanding(slope, verdict):
    proof = ls.certify(ls.map(affine, a=slope, b=0.0), LINE, ["expanding"])
    assert proof.claims[0].verdict == verdict
    assert not proof.proved
    if verdict == "refuted":
        assert f"at most {abs(slope):.6g}" in proof.claims[0].reason
        assert proof.claims[0].final


# ----------------------------------------------------------------
# Random own maps: every cycle closes, none is missed on a line, and every proved claim survives random orbits.
# The functions take arrays too: what is asked of them there uses nothing of the package.


ORBITS, CLAIMS = 4000, ["attracts-all", "expanding", "invariant", "trapping", "cycles"]


def low_piece(x, a, b, c, d, at):
    return a * x + b - 0.1 * x**2


def high_piece(x, a, b, c, d, at):
    return c * x + d + 0.1 * x**2


def beyond_change(x, a, b, c, d, at):
    return x - at


def damped(x, y, k, b, push):
    v = b * y + push + k / math.tau * np.sin(math.tau * x)
    u = x + v
    return u - np.floor(u), v


def left_crease(x, y, a, b, step):
    return 1.0 + a * x + y, b * x


def right_crease(x, y, a, b, step):
    return 1.0 - a * x + y - step, b * x


def beyond_crease(x, y, a, b, step):
    return x


class Kind(NamedTuple):
    """A formula, or two pieces and their margin; least and most of each parameter."""

    functions: tuple
    domain: list
    cells: int
    least: tuple
    most: tuple

    def of(self, values):
        first, *others = self.functions
        names = list(inspect.signature(first).parameters)[len(self.domain) :]
        given = dict(zip(names, map(float, values), strict=True))
        return (
            ls.map(pieces=(first, others[0]), margin=others[1], **given) if others else ls.map(first, **given)
        )

    def image(self, p, x):
        """Images of many states, shape (n, d), by numpy alone."""
        one, *others = (np.atleast_2d(f(*x.T, *p)).T for f in self.functions)
        return np.where(others[1] > 0.0, others[0], one) if others else one

    def times(self, p, x, count):
        for _ in range(count):
            x = self.image(p, x)
        return x


WIDEST = (1.7, 0.3, 1.7, 0.3, 0.4)
BROKEN, CREASED = (low_piece, high_piece, beyond_change), (left_crease, right_crease, beyond_crease)
KINDS = {
    "odd": Kind((odd,), [(-2.1, 2.1)], 2048, (0.3, -0.2), (2.5, 0.2)),
    "broken": Kind(BROKEN, [(-1.5, 1.5)], 2048, np.negative(WIDEST), WIDEST),
    "turned": Kind((turned,), [(0.0, 1.0)], 1024, (0.0, 0.2), (1.0, 1.6)),
    "henon": Kind((henon,), [(-1.6, 1.6), (-0.6, 0.6)], 192, (0.2, -0.3), (1.4, 0.3)),
    "damped": Kind((damped,), [(0.0, 1.0), (-1.0, 1.0)], 128, (0.3, 0.1, 0.0), (2.0, 0.5, 0.3)),
    "creased": Kind(CREASED, [(-2.5, 2.5), (-1.2, 1.2)], 128, (0.4, -0.4, -0.1), (1.6, 0.4, 0.3)),
}


def require_none_missed(kind, p, found, up_to):
    """Roots of F^k(x) = x on a line, bisected between samples, are points of the cycles."""
    points = np.concatenate([np.ravel(c.x) for c in found] or [np.zeros(0)])
    ((lo, hi),) = kind.domain
    x = np.linspace(lo, hi, 60_001)[1:-1] + 1e-7
    for period in range(1, up_to + 1):
        a, b = x[:-1], x[1:]
        below = kind.times(p, a[:, None], period)[:, 0] > a
        k = np.flatnonzero(below != (kind.times(p, b[:, None], period)[:, 0] > b))
        a, b, below = a[k], b[k], below[k]
        for _ in range(60):
            middle = 0.5 * (a + b)
            same = (kind.times(p, middle[:, None], period)[:, 0] > middle) == below
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        root = 0.5 * (a + b)
        path = [root[:, None]]
        for _ in range(period):
            path.append(kind.image(p, path[-1]))
        ahead = np.hstack(path)
        inside = ((ahead > lo + 1e-6) & (ahead < hi - 1e-6)).all(axis=1)
        true = root[(np.abs(ahead[:, -1] - root) < 1e-9) & inside]
        for each in true:
            assert np.abs(points - each).min(initial=np.inf) < 1e-6, (period, each)


def in_cells(grid, mask, x):
    """Whether each state lies in one of some cells, by their edges; on a border in any that meets there."""
    held = np.zeros(len(x), dtype=bool)
    for nudge in (0.0, 1e-12, -1e-12):
        number = np.zeros(len(x), dtype=np.int64)
        good = np.ones(len(x), dtype=bool)
        for axis, edges in enumerate(grid.edges[0]):
            at = np.searchsorted(edges, x[:, axis] + nudge, side="right") - 1
            at = np.where(x[:, axis] == edges[-1], edges.size - 2, at)
            good &= (at >= 0) & (at < edges.size - 1)
            number = number * (edges.size - 1) + np.clip(at, 0, edges.size - 2)
        held |= good & mask[number]
    return held


def slopes(kind, p, x):
    """Derivative of the step at states (n, d) by central differences, nan across a switch or a seam."""
    n, d = x.shape
    found = np.empty((n, d, d))
    for axis in range(d):
        h = np.zeros(d)
        h[axis] = 1e-6
        found[:, :, axis] = (kind.image(p, x + h) - kind.image(p, x - h)) / 2e-6
    found[(np.abs(found) > 1e3).any(axis=(1, 2))] = np.nan
    return found


def require_true(kind, proof, ends, random):
    """Hold what is proved against random orbits, of random maps between two."""
    grid, verdict = proof.graph.grid, {claim.claim: claim for claim in proof.claims}
    low, high = np.array(kind.domain).T
    for _ in range(3):
        p, kept = random.uniform(*ends), proof.cells.numbers()
        numbers = random.choice(kept, ORBITS) if kept.size else kept
        x, mine = random.uniform(*grid.boxes(numbers, 0)), proof.component[numbers]
        if verdict["expanding"].verdict in ("proved", "refuted"):
            size = np.abs(slopes(kind, p, x)[:, 0, 0])
            size = size[np.isfinite(size)]
            grows = verdict["expanding"].verdict == "proved"
            assert (size > 1.0 - 1e-5).all() if grows else (size < 1.0 + 1e-5).all()
        if verdict["invariant"].verdict == "proved":
            for _ in range(20):
                x = kind.image(p, x)
                assert all(in_cells(grid, proof.component == k, x[mine == k]).all() for k in np.unique(mine))
        everywhere = random.uniform(low, high, (ORBITS, grid.dimension))
        if verdict["attracts-all"].verdict == "proved":
            x = kind.times(p, everywhere, verdict["attracts-all"].section["max_rank"])
            assert in_cells(grid, proof.cells.mask, x).all()
        enters = in_cells(grid, proof.enters.mask, everywhere)
        x = kind.times(p, everywhere[enters], 3000 if grid.dimension == 1 else 600)
        assert in_cells(grid, proof.cells.mask, x).all()
        for cycle in proof.cycles[:: max(1, len(proof.cycles) // 20)]:
            require_orbit(kind, p, cycle)


def require_orbit(kind, p, cycle):
    """Find the cycle of one map that a box promises, by Newton's method at all points, and hold it against the box."""
    x = 0.5 * (cycle.lo + cycle.hi)
    period, d = x.shape
    shift = np.kron(np.roll(np.eye(period), 1, axis=1), np.eye(d))
    for _ in range(30):
        step = slopes(kind, p, x)
        matrix = -shift
        for j in range(period):
            matrix[d * j : d * j + d, d * j : d * j + d] += step[j]
        move = np.linalg.solve(matrix, (kind.image(p, x) - np.roll(x, -1, axis=0)).ravel())
        x = x - move.reshape(x.shape)
    assert np.abs(kind.image(p, x) - np.roll(x, -1, axis=0)).max() < 1e-9
    assert ((cycle.lo - 1e-9 <= x) & (x <= cycle.hi + 1e-9)).all()
    total = np.eye(d)
    for one in step:
        total = one @ total
    size = np.abs(np.linalg.eigvals(total)).max()
    assert cycle.attracts is None or (size < 1.0 + 1e-6 if cycle.attracts else size > 1.0 - 1e-6)


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", KINDS)
def test_random_own_maps(name, seed):
    kind, random = KINDS[name], np.random.default_rng([seed, len(name)])
    values, width = random.uniform(kind.least, kind.most), np.subtract(kind.most, kind.least)
    grid, p = ls.grid(kind.domain, cells=kind.cells), kind.of(values)
    found = ls.cycles(ls.transitions(p, grid), 5)
    require_closed(p, found)
    if grid.dimension == 1:
        require_none_missed(kind, values, found, 4)
    ends = values, values + random.choice([0.0, 1e-4]) * width
    require_true(kind, ls.certify(p, grid, CLAIMS, upper=kind.of(ends[1])), ends, random)
