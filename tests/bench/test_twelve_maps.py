"""Twelve maps: what is found, proved and refused, against theory, and beside CMGDB's Morse sets of the same boxes.

Lines for each map are printed at the end; docs/twelve_maps.md has them as a table.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import erf

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from tests.bench.leslie_rivals import morse_by_cmgdb
from tests.bench.measure import take_turns, versus
from tests.bench.twelve_maps import (
    above_zero,
    beetles,
    circle,
    delayed_logistic,
    duffing,
    gap_above,
    gap_below,
    henon_in_space,
    ikeda,
    pull,
    ricker,
    saturating,
    standard,
    tent_above,
    tent_below,
    torus,
    two_species,
)

pytestmark = pytest.mark.bench
HAS_CMGDB, RIVAL = find_spec("CMGDB") is not None, "CMGDB 1.5.2"

# ----------------------------------------------------------------
# What is asked of each, and what is learnt.


@dataclass
class Answers:
    """What came out: graphs, what is found, verdicts by claim, refusals by door, seconds."""

    attractors: Any = ()
    basins: Any = None
    cycles: Any = ()
    verdicts: dict[str, str] = field(default_factory=dict)
    proofs: list[Any] = field(default_factory=list)
    printed: list[str] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    rechecked: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)

    def ask(self, door: str, question: Callable[[], Any]) -> Any:
        """Answer of a door; None where it refuses, and why."""
        begin = perf_counter()
        try:
            return question()
        except LimitsetsError as error:
            self.refused[door] = str(error)
            return None
        finally:
            self.seconds[door] = perf_counter() - begin


Box = tuple[float, float]


@dataclass(frozen=True)
class Case:
    """A map, its cells, what is claimed of it, and what theory says."""

    map: Any
    domain: Sequence[Box]
    cells: int | tuple[int, ...]
    depth: int  # of the cells that CMGDB takes too
    theory: Callable[[Answers], None]
    claims: tuple[tuple[str, ...], ...]
    ends: Any = None
    up_to: int = 4
    periodic: bool = False
    arrays: Callable[..., Any] | None = None  # for CMGDB: the map, if it is not `ls.map` of one function


def near(value: float) -> Any:
    return pytest.approx(value, abs=1e-8)


def periods(cycles: Any) -> Counter[int]:
    return Counter(cycle.period for cycle in cycles)


# ----------------------------------------------------------------
# Theory, by map.


def of_gap(answers: Answers) -> None:
    """x -> 1.4 x + 0.9, then - 1: the 2-cycle solves 1.96 x + 0.26 = x; all slopes are 1.4."""
    (two,) = (cycle for cycle in answers.cycles if cycle.period == 2)
    assert two.x[0] == near(-13 / 48)
    assert two.multiplier == near(1.96)
    (attractor,) = answers.attractors
    assert attractor.lyapunov == near(math.log(1.4))
    ((lo, hi),) = attractor.extents[0]
    assert lo <= -1.0 <= lo + 0.0051
    assert hi - 0.0051 <= 0.9 <= hi  # the two images of the jump


def of_tent(answers: Answers) -> None:
    """With a = b / (b^2 - 1) the parts [1 - b, 0], [0, x*], [x*, 1] are a Markov partition: all is known."""
    a, b = 1.2, 1.5
    fixed = 1.0 / (1.0 + b)
    assert 1.0 + a * (1.0 - b) == near(fixed)
    (attractor,) = answers.attractors
    ((lo, hi),) = attractor.extents[0]
    assert (lo, hi) == (pytest.approx(1.0 - b, abs=0.005), pytest.approx(1.0, abs=0.005))
    left = (b - 1.0) / (b - 1.0 + fixed)  # of the time below x*, that below 0: the density is even there
    exponent = 0.5 * math.log(b) + 0.5 * (left * math.log(a) + (1.0 - left) * math.log(b))
    assert attractor.lyapunov == pytest.approx(exponent, abs=2e-3)
    # traces of the partition's matrix, 2 * 2^(n/2) for even n, count x* twice
    points = {n: 2 * 2 ** (n // 2) - 1 if n % 2 == 0 else 1 for n in range(1, 9)}
    per = periods(answers.cycles)
    assert {n: sum(d * per[d] for d in range(1, n + 1) if n % d == 0) for n in points} == points


def of_ricker(answers: Answers) -> None:
    """Points of the 2-cycle add up to 2: with x = 1 - u, log((1 + u) / (1 - u)) = r u."""
    r = 2.3
    u = brentq(lambda u: math.log((1 + u) / (1 - u)) - r * u, 0.3, 0.9, xtol=1e-14)
    fixed, two = sorted(answers.cycles, key=lambda cycle: cycle.period)
    assert (float(fixed.x[0]), fixed.multiplier) == (near(1.0), near(1.0 - r))
    assert sorted(two.x.tolist()) == [near(1.0 - u), near(1.0 + u)]
    assert two.multiplier == near((1.0 - r * (1.0 - u)) * (1.0 - r * (1.0 + u)))
    balls = [cycle for proof in answers.proofs for cycle in proof.cycles if cycle.ball is not None]
    assert balls
    assert all(cycle.lo[0, 0] < 1.0 - u < cycle.hi[0, 0] for cycle in balls)


def of_two_species(answers: Answers) -> None:
    """A competitive map that is symmetric: one species alone at birth - 1, basins on the two sides of x = y."""
    birth, rivalry = 3.0, 2.0
    alone = birth - 1.0
    together = alone / (1.0 + rivalry)
    points = sorted(tuple(cycle.x[0].round(8)) for cycle in answers.cycles if cycle.period == 1)
    assert np.allclose(points, [(0.0, 0.0), (0.0, alone), (together, together), (alone, 0.0)], atol=1e-8)
    first, second = answers.basins.attractors
    assert first == second < 0.5 < first + answers.basins.undecided_between
    grid = answers.basins.grid
    lo, hi, _ = grid.corners(np.arange(grid.n_cells))
    for attractor, label in zip(answers.attractors, range(2), strict=True):
        ((box,),) = attractor.extents.values()
        own = answers.basins.labels == label
        inside = lo[own, 0] >= hi[own, 1] if box[0][0] > 1.0 else lo[own, 1] >= hi[own, 0]
        assert inside.all()  # no decided cell lies on the wrong side of the diagonal


def of_ikeda(answers: Answers) -> None:
    """z -> 1 + u z e^(i angle): the disc of radius 1 / (1 - u) takes all in; areas shrink by u^2."""
    (attractor,) = answers.attractors
    for (lo, hi), (bottom, top) in attractor.extents[0]:
        assert max(abs(lo), abs(hi), abs(bottom), abs(top)) < 1.0 / 0.3
    assert 0.0 < attractor.lyapunov < -2.0 * math.log(0.7)  # chaos, on a set of dimension below 2
    (fixed,) = (cycle for cycle in answers.cycles if cycle.period == 1)
    assert np.allclose(ikeda(*fixed.x[0], 0.7), fixed.x[0], atol=1e-12)
    z = fsolve(lambda p: np.array(ikeda(*p, 0.7)) - p, (0.6, 0.2), xtol=1e-13)
    assert np.allclose(fixed.x[0], z, atol=1e-9)


def of_delayed_logistic(answers: Answers) -> None:
    """At 1 - 1/a multipliers have the modulus sqrt(a - 1): unstable beyond a = 2, where a curve was born."""
    a = 2.1
    at = {tuple(cycle.x[0].round(9)): abs(cycle.multiplier) for cycle in answers.cycles if cycle.period == 1}
    inner = 1.0 - 1.0 / a
    (found,) = (modulus for point, modulus in at.items() if np.allclose(point, inner, atol=1e-8))
    assert found == near(math.sqrt(a - 1.0))
    (attractor,) = answers.attractors
    assert abs(attractor.lyapunov) < 1e-3  # along a curve that is turned
    assert not attractor.cells.holds(np.array([[inner, inner]]), 0)[0]


def of_henon_in_space(answers: Answers) -> None:
    """On the cube of half width w = 1.65 x' lies between 1.4 - w^2 - w / 10 = -1.4875 and 1.4 + w / 10 = 1.565."""
    assert answers.verdicts["attracts-all"] == "proved"
    (attractor,) = answers.attractors
    inner = (-1.1 + math.sqrt(1.21 + 4.0 * 1.4)) / 2.0  # x = a - x^2 - b x
    assert attractor.cells.holds(np.array([[inner] * 3]), 0)[0]
    assert 0.05 < attractor.lyapunov < 0.15  # 0.098 by QR, in numpy
    assert "cycles" in answers.refused


def of_beetles(answers: Answers) -> None:
    """Parameters of Costantino and others (1997), cpa = 0.35: chaos; extinction repels, as b (1 - mul) > mua."""
    assert 6.598 * (1.0 - 0.2055) > 0.96
    (attractor,) = answers.attractors
    assert 0.05 < attractor.lyapunov < 0.15  # 0.103 by QR, in numpy
    state = np.array([70.0, 30.0, 70.0])
    for _ in range(3000):
        state = np.array(beetles(*state, **BEETLES))
        assert (state <= (211.0, 168.0, 175.0)).all()
    assert attractor.cells.holds(state[None], 0)[0]


def of_circle(answers: Answers) -> None:
    """A 2-cycle x, y with y = x + omega - ... and x + 1: one attracts and one repels, and nothing else recurs."""
    omega, k = 0.48, 0.9
    once = lambda x: circle(x, omega, k)  # noqa: E731
    roots = [
        brentq(lambda x: once(once(x)) - x - 1.0, lo, hi, xtol=1e-14)
        for lo, hi in zip(np.linspace(0, 1, 201), np.linspace(0, 1, 201)[1:], strict=False)
        if (once(once(lo)) - lo - 1.0) * (once(once(hi)) - hi - 1.0) < 0
    ]
    assert sorted(float(x) for cycle in answers.cycles for x in cycle.x) == [near(root) for root in roots]
    assert periods(answers.cycles) == {2: 2}
    assert sorted(abs(cycle.multiplier) < 1 for cycle in answers.cycles) == [False, True]
    turn = ls.map(
        circle, omega=(math.sqrt(5.0) - 1.0) / 2.0, k=0.0
    )  # a rotation: no cycle, and nothing but all
    graph = ls.transitions(turn, ls.grid([(0.0, 1.0)], cells=1000, periodic=True), "boxes")
    assert [len(cells) for cells in graph.attracting_sets()] == [1000]
    assert len(ls.cycles(graph, 4)) == 0


def of_torus(answers: Answers) -> None:
    """Points of f^n = 1: |det(A^n - 1)|, that is 1, 5, 16, 45; the exponent is log((3 + sqrt 5) / 2)."""
    matrix, per = np.array([[2, 1], [1, 1]]), periods(answers.cycles)
    for n in range(1, 5):
        fixed = abs(round(np.linalg.det(np.linalg.matrix_power(matrix, n) - np.eye(2))))
        assert sum(d * per[d] for d in range(1, n + 1) if n % d == 0) == fixed
    (attractor,) = answers.attractors
    assert len(attractor.cells) == attractor.cells.grid.n_cells
    assert attractor.lyapunov == pytest.approx(math.log((3.0 + math.sqrt(5.0)) / 2.0), abs=1e-6)


def of_standard(answers: Answers) -> None:
    """Areas are kept, so every point is chain recurrent: the whole torus is the one attractor there can be."""
    (attractor,) = answers.attractors
    assert len(attractor.cells) == attractor.cells.grid.n_cells
    fixed = {
        tuple(cycle.x[0].round(6)): abs(cycle.multiplier) for cycle in answers.cycles if cycle.period == 1
    }
    k = 0.5  # traces 2 + k at q = 0, a saddle, and 2 - k at q = 1/2, a centre
    assert fixed == {(0.0, 0.0): near(1.0 + k / 2 + math.sqrt(k + k * k / 4)), (0.0, 0.5): near(1.0)}


def of_duffing(answers: Answers) -> None:
    """Two periodic motions, by the flow itself; below Melnikov's threshold no orbits tangle; areas shrink alike."""
    damping, push = 0.25, 0.1
    threshold = 4.0 * damping * math.cosh(math.pi / 2.0) / (3.0 * math.sqrt(2.0) * math.pi)
    assert push < threshold

    def flow(start):
        def field_of(t, s):
            return s[1], pull(s[0], s[1], t, damping, push)

        return solve_ivp(field_of, (0.0, 2.0 * math.pi), start, rtol=1e-11, atol=1e-12).y[:, -1]

    assert len(answers.attractors) == 2
    for attractor, guess in zip(
        sorted(answers.attractors, key=lambda each: each.extents[0][0][0][0]),
        ((-0.9, 0.0), (1.1, 0.0)),
        strict=True,
    ):
        point = fsolve(lambda s: flow(s) - s, guess)
        assert attractor.cells.holds(point[None], 0)[0]
        assert attractor.lyapunov == pytest.approx(-damping * math.pi, abs=0.02)  # det = e^(-2 pi damping)


def of_saturating(answers: Answers) -> None:
    """erf(1.5 x) has the slope 1.69 at 0: 0 repels, +-x* attract, each the starts on its side."""
    point = brentq(lambda x: erf(1.5 * x) - x, 0.5, 1.0)
    assert 2.0 * 1.5 / math.sqrt(math.pi) > 1.0
    ends = sorted(interval for each in answers.attractors for interval in each.extents[0])
    assert len(ends) == 2
    for (lo, hi), at in zip(ends, (-point, point), strict=True):
        assert lo <= at <= hi
    shares = answers.basins.attractors
    assert shares == (pytest.approx(0.5, abs=0.02), pytest.approx(0.5, abs=0.02))
    assert {"formulas", "cycles", "certify trapping, basin"} <= set(answers.refused)


# ----------------------------------------------------------------
# The table.


BEETLES = {"b": 6.598, "cel": 0.01209, "cea": 0.01155, "cpa": 0.35, "mul": 0.2055, "mua": 0.96}
PLANE = (("trapping", "basin"), ("attracts-all",), ("cycles",), ("converges", "basin"))
LINE = (*PLANE, ("expanding",), ("almost-every", "converges"))


def gap_on_arrays(x, slope):
    return np.where(x > 0, gap_above(x, slope), gap_below(x, slope))


def tent_on_arrays(x, a, b):
    return np.where(x > 0, tent_above(x, a, b), tent_below(x, a, b))


SQUARE = [(0.0, 1.0), (0.0, 1.0)]
CASES = {
    "gap": Case(
        ls.map(pieces=(gap_below, gap_above), margin=above_zero, slope=1.4),
        [(-1.3, 1.2)],
        1000,
        10,
        of_gap,
        LINE,
        arrays=gap_on_arrays,
    ),
    "skew tent": Case(
        ls.map(pieces=(tent_below, tent_above), margin=above_zero, a=1.2, b=1.5),
        [(-1.0, 1.3)],
        1000,
        10,
        of_tent,
        LINE,
        up_to=8,
        arrays=tent_on_arrays,
    ),
    "Ricker": Case(ls.map(ricker, r=2.3), [(0.02, 2.6)], 1000, 10, of_ricker, LINE),
    "two species": Case(
        ls.map(two_species, birth=3.0, rivalry=2.0),
        [(0.0, 3.0), (0.0, 3.0)],
        256,
        16,
        of_two_species,
        (("invariant",), *PLANE),
        ends=[[(0.0, 0.1), (1.9, 2.1)], [(1.9, 2.1), (0.0, 0.1)]],
        up_to=1,
    ),
    "Ikeda": Case(
        ls.map(ikeda, u=0.7),
        [(-3.4, 3.4), (-3.4, 3.4)],
        256,
        16,
        of_ikeda,
        PLANE,
        ends=[[(-0.6, 2.2), (-1.6, 1.2)]],
    ),
    "delayed logistic": Case(
        ls.map(delayed_logistic, a=2.1),
        [(0.0, 1.1), (0.0, 1.1)],
        512,
        16,
        of_delayed_logistic,
        (("trapping", "basin"), ("attracts-all",), ("cycles",), ("converges",)),
    ),
    "Hénon in space": Case(
        ls.map(henon_in_space, a=1.4, b=0.1),
        [(-1.65, 1.65)] * 3,
        64,
        15,
        of_henon_in_space,
        (("trapping", "basin", "attracts-all"), ("cycles",)),
    ),
    "beetles": Case(
        ls.map(beetles, **BEETLES),
        [(0.0, 211.0), (0.0, 168.0), (0.0, 175.0)],
        (32, 32, 128),
        15,
        of_beetles,
        (("invariant", "basin", "attracts-all"), ("trapping",), ("cycles",)),
    ),
    "circle": Case(
        ls.map(circle, omega=0.48, k=0.9),
        [(0.0, 1.0)],
        1000,
        10,
        of_circle,
        LINE,
        ends=[[(0.44, 0.5)], [(0.9, 0.95)]],
        periodic=True,
    ),
    "torus": Case(
        ls.map(torus), SQUARE, 128, 14, of_torus, (("trapping", "attracts-all"), ("cycles",)), periodic=True
    ),
    "standard map": Case(
        ls.map(standard, k=0.5),
        SQUARE,
        128,
        14,
        of_standard,
        (("trapping", "attracts-all"), ("cycles",)),
        periodic=True,
    ),
    "Duffing": Case(
        ls.map(duffing, damping=0.25, push=0.1),
        [(-2.0, 2.0), (-2.0, 2.0)],
        64,
        16,
        of_duffing,
        (("trapping", "basin"), ("converges",)),
        up_to=1,
    ),
    "scipy's erf": Case(
        ls.map(saturating, vectorised=True, gain=1.5),
        [(-1.2, 1.2)],
        1000,
        10,
        of_saturating,
        (("trapping", "basin"),),
    ),
}


@pytest.fixture(scope="module")
def lines(request):
    told: list[str] = []
    yield told
    capture = request.config.pluginmanager.getplugin("capturemanager")
    with capture.global_and_fixture_disabled():
        print("", *told, sep="\n")


def ours(case: Case) -> tuple[list[int], int]:
    """Sizes of the recurrent components on CMGDB's cells, images by its rule; how many attract."""
    grid = ls.grid(case.domain, depth=case.depth, periodic=case.periodic)
    morse = ls.morse_graph(ls.transitions(case.map, grid, "corners-padded"))
    return sorted(morse.nodes[k]["cells"] for k in morse), sum(morse.nodes[k]["attracting"] for k in morse)


def cmgdb(case: Case, function: Callable[..., Any]) -> tuple[list[int], int]:
    """The same by CMGDB, which does not count what leaves the domain."""

    def images(points: np.ndarray) -> np.ndarray:
        after = function(*points.T, *case.map)
        return np.column_stack(after if isinstance(after, tuple) else (after,))

    ends = tuple(zip(*case.domain, strict=True))
    morse, _ = morse_by_cmgdb(images, ends, case.depth, periodic=case.periodic)
    above = {v for v, _ in morse.edges()}
    return sorted(len(morse.morse_set(v)) for v in morse.vertices()), sum(
        v not in above for v in morse.vertices()
    )


def asked(case: Case, folder: Any) -> Answers:
    """Ask every door."""
    answers = Answers()
    grid = ls.grid(case.domain, cells=case.cells, periodic=case.periodic)
    graph = answers.ask("boxes", lambda: ls.transitions(case.map, grid, "boxes"))
    graph = graph or ls.transitions(case.map, grid)
    if not graph.attracting_sets():
        answers.refused["boxes"] = "nothing attracts for certain: what is found is sampled, on CMGDB's cells"
        graph = ls.transitions(case.map, ls.grid(case.domain, depth=case.depth))
    answers.attractors = answers.ask("attractors", lambda: ls.attractors(graph))
    answers.basins = ls.basins(graph, answers.attractors)
    answers.cycles = answers.ask("cycles", lambda: ls.cycles(graph, case.up_to)) or ()
    answers.ask("limit_set", lambda: ls.limit_set(graph))
    answers.ask("formulas", lambda: ls.formulas(case.map, grid))
    asks: list[tuple[Any, dict[str, Any]]] = [(claims, {}) for claims in case.claims]
    asks += [(["ends-in"], {"ends": case.ends})] if case.ends else []
    for claims, more in asks:
        words = ", ".join(claims)
        proof = answers.ask(f"certify {words}", lambda c=claims, m=more: ls.certify(case.map, grid, c, **m))
        if proof is None:
            continue
        answers.proofs.append(proof)
        answers.printed.append(f"{words}: basin as printed {len(proof.enters) / grid.n_cells:.4f}")
        answers.verdicts |= {
            each.claim: each.verdict if each.verdict == "proved" else f"{each.verdict}: {each.reason}"
            for each in proof.claims
        }
        if any(each.verdict == "proved" for each in proof.claims):
            path = answers.ask(f"save {words}", lambda p=proof: p.save(folder / "map.proof.zip"))
            if path is not None:
                report, ranked = ls.recheck(path), (proof.arrays["rank"] >= 0).mean()
                answers.rechecked.append(
                    f"{words}: rechecked as {report.verdict} in {report.seconds:.1f} s, file of "
                    f"{path.stat().st_size / 1e6:.2f} MB, basin in the file {ranked:.4f}"
                )
    return answers


def told(answers: Answers) -> Iterator[str]:
    """Say what came out, line by line."""
    for attractor in answers.attractors:
        yield f"found: {len(attractor.cells)} cells in {attractor.extents}, exponent {attractor.lyapunov}"
    shares = answers.basins
    yield f"basins: {shares.attractors}, undecided {shares.undecided_between:.4f}, leave {shares.exits}"
    yield f"cycles by period: {dict(periods(answers.cycles))}"
    for claim, verdict in answers.verdicts.items():
        yield f"{claim}: {verdict}"
    for proof, words in zip(answers.proofs, answers.printed, strict=True):
        yield f"{words}: attracting {len(proof.cells)}, cycles by period {dict(periods(proof.cycles))}"
    yield from answers.rechecked
    for door, reason in answers.refused.items():
        yield f"{door} refuses: {reason}"
    yield f"seconds: { {door: round(spent, 1) for door, spent in answers.seconds.items() if spent >= 0.1} }"


@pytest.mark.parametrize("name", CASES)
def test_map(name, benchmark, table, lines, tmp_path):
    case = CASES[name]
    function = case.arrays or case.map.__reduce__()[1][0].popitem()[1]
    rivals = {RIVAL: lambda: cmgdb(case, function)} if HAS_CMGDB else {}
    turns = take_turns(benchmark, lambda: ours(case), rivals, 3)
    answers = asked(case, tmp_path)
    case.theory(answers)
    sizes, attracting = turns.answer
    lines += [f"## {name}: {case.map}, {case.domain}, {case.cells} cells along each axis", *told(answers)]
    lines.append(f"Morse sets on 2^{case.depth} cells: {len(sizes)}, attracting {attracting}")
    if rivals:
        theirs, ends = turns.answers[RIVAL]
        # ours cut cells at the border of two pieces, and hold a few more there
        assert case.arrays or (theirs, ends) == turns.answer
        lines.append(f"by CMGDB: {len(theirs)}, attracting {ends}; the same sizes: {theirs == sizes}")
        table.append(versus(f"{name}: Morse sets on 2^{case.depth} cells", turns, RIVAL, unit="ms"))
