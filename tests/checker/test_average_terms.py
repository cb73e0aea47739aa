"""The inequalities of the claim `average`, term by term, and second derivatives: what the checker asks for, by a second
computation.

For numbers u and w that solve nothing the checker accepts an end from some number on, and weights from some factor on.
Both are computed here from docs/certificates.md in plain floats, on maps whose slopes are known in closed form.
"""

import math

import mpmath
import numpy as np
import pytest
from flint import arb

import limitsets as ls
from limitsets.checker.program import Formulas, Program, read_operation
from limitsets.proofs.prover.averages_of_map import averaged
from tests.proofs.forge import opened, section_of_average

LEFT, RIGHT, BEND, TOP = 1.62, 1.55, 0.11, 0.87
STRETCH, MORE = 2.35, 0.12


def lower_piece(x, left, bend, right, top):
    return left * x + bend * x * x


def upper_piece(x, left, bend, right, top):
    return top - right * (x - 0.5) - bend * (x - 0.5) * (x - 0.5)


def above_half(x, left, bend, right, top):
    return x - 0.5


def lifted(x, b, c):
    return b * x + c * x * x


def square(x):
    return x * x


FOLD = ls.map(
    pieces=(lower_piece, upper_piece), margin=above_half, left=LEFT, bend=BEND, right=RIGHT, top=TOP
)
CIRCLE = ls.map(lifted, b=STRETCH, c=MORE)


class Piece:
    """A formula on an interval, with its slope, half its second derivative, and what happens at borders."""

    def __init__(self, value, slope, bend):
        self.value, self.slope, self.bend = value, slope, bend


FIRST = Piece(lambda x: LEFT * x + BEND * x * x, lambda x: LEFT + 2 * BEND * x, 2 * BEND)
SECOND = Piece(
    lambda x: TOP - RIGHT * (x - 0.5) - BEND * (x - 0.5) ** 2,
    lambda x: -RIGHT - 2 * BEND * (x - 0.5),
    -2 * BEND,
)
LIFT = Piece(lambda x: STRETCH * x + MORE * x * x, lambda x: STRETCH + 2 * MORE * x, 2 * MORE)


def met(edges, own, lo, hi):
    """The cells that an interval meets, borders with both neighbours, and how much of it lies in each."""
    near = 1e-11
    cells = [k for k in own if edges[k] <= hi + near and lo - near <= edges[k + 1]]
    return cells, np.array([max(0.0, min(hi, edges[k + 1]) - max(lo, edges[k])) for k in cells])


def rows_of(edges, cell, own, closes, targets):
    """The pieces of a cell: formula, the image, the cells that it meets; one more where it holds a change."""
    a, b = edges[cell], edges[cell + 1]
    if closes:
        lo, hi = LIFT.value(a), LIFT.value(b)
        turn = math.floor((lo + hi) / 2)
        lo, hi = lo - turn, hi - turn
        if lo < -1e-14:
            lo, hi = lo + 1, hi + 1
        if hi <= 1 + 1e-14:
            return [(LIFT, *met(edges, own, lo, hi))]
        return [(LIFT, *met(edges, own, lo, 1.0)), (LIFT, *met(edges, own, 0.0, hi - 1.0))]
    if b <= 0.5 or a > 0.5:
        piece = FIRST if b <= 0.5 else SECOND
        return [(piece, *met(edges, own, *sorted((piece.value(a), piece.value(b)))))]
    rows = []
    for piece, target in zip((FIRST, SECOND), targets, strict=True):
        cells = [k for k in range(target[cell, 0] - 1, target[cell, 1] + 2) if k in own]
        rows.append((piece, cells, None))
    return rows


def asked(edges, own, u, w, runs, sign, closes, targets):
    """By cell what c and w have to be at least, from docs/certificates.md."""
    widths = np.diff(edges)
    of_c, of_w = {}, {}
    holding = []
    for cell in own:
        a, b = edges[cell], edges[cell + 1]
        rows = rows_of(edges, cell, set(own), closes, targets)
        slopes = [min(abs(piece.slope(a)), abs(piece.slope(b))) for piece, _, _ in rows]
        bends = [abs(piece.bend) / slope**2 for (piece, _, _), slope in zip(rows, slopes, strict=True)]
        widest = max(max(w[k] for k in cells) for _, cells, _ in rows)
        width, middle = widths[cell], (a + b) / 2
        change = width * b  # |I| max |g'| / 2 for g = x^2
        g_mean = sign * middle**2 + width**2 / 4
        if len(rows) == 1:
            ((_, cells, parts),) = rows
            mean = (u[cells] * parts).sum() / parts.sum()
            r = np.abs(np.cumsum((u[cells] - mean) * parts)).max()
            s = r * (1 / slopes[0] + 2 * width * bends[0]) + width * 2 * change / 4
            of_c[cell] = g_mean + mean + bends[0] * r - u[cell] + bends[0] * widest
        else:
            holding.append((cell, rows, slopes))
            met_by_all = [k for _, cells, _ in rows for k in cells]
            largest = sign * middle**2 + change
            s = width * (2 * change + np.ptp(u[met_by_all])) / 4
            of_c[cell] = largest + u[met_by_all].max() - u[cell] + max(bends) * widest
        of_w[cell] = [s, widest / min(slopes)]
    for (cell, rows, slopes), counts in zip(holding, runs, strict=True):
        for above, (_, cells, _), slope, count in zip((False, True), rows, slopes, counts, strict=True):
            term = max(w[k] for k in cells) / slope
            beside = range(cell + 1, cell + 1 + count) if above else range(cell - count, cell)
            length = widths[beside].sum()
            far = edges[beside[-1] + 1] if above else edges[beside[0]]
            of_w[cell][1] += term
            for k in beside:
                of_w[k][1] += term * max(abs(far - edges[k]), abs(far - edges[k + 1])) / length
                of_c[k] += term / length
    return max(of_c.values()), of_w


def component_of(forged):
    edges, component = forged.arrays["0.edges.0.0"], forged.arrays["0.component"]
    edges = np.append(edges, 1.0) if len(edges) == len(component) else edges
    return edges, np.flatnonzero(component == 0).tolist()


@pytest.fixture(scope="module", params=["fold", "circle"])
def file(request, tmp_path_factory):
    closes = request.param == "circle"
    path = tmp_path_factory.mktemp("terms") / "own.proof.zip"
    grid = ls.grid([(0.0, 1.0)], cells=37, periodic=True) if closes else ls.grid([(0.0, 1.0)], cells=45)
    # without the small cells that `limitsets.average` makes around a change of branch: there nothing is large
    proof = averaged(ls.certify(CIRCLE if closes else FOLD, grid, ["invariant"]), square)
    assert proof.average is not None
    proof.save(path)
    return path, closes


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.repeats), 2])
def test_the_checker_asks_for_each_term(file, seed, tmp_path):
    path, closes = file
    forged = opened(path)
    edges, own = component_of(forged)
    targets = [forged.arrays[name] for name in sorted(forged.arrays) if name.startswith("0.target")]
    random = np.random.default_rng(seed)
    count = len(edges) - 1
    u = random.uniform(-1.0, 1.0, count)
    forged.arrays["0.average.upper"], forged.arrays["0.average.lower"] = u.copy(), u.copy()
    runs = forged.arrays["0.average.runs"]
    runs[:] = random.integers(1, runs + 1)
    section = section_of_average(forged)["functions"][0]

    def accepted(sign, c, w):
        forged.arrays["0.average.weight"] = w
        section.update(lower=[(-c if sign < 0 else -1e9).hex()], upper=[(c if sign > 0 else 1e9).hex()])
        return ls.recheck(forged.seal().write(tmp_path / "asked.zip")).verdict == "proved"

    def of_both_signs(w):
        return [asked(edges, own, u, w, runs, sign, closes, targets) for sign in (1.0, -1.0)]

    # weights that the inequality of variations lets stand: its solution for the larger s of both signs, and more
    w = np.ones(count)
    for _ in range(400):
        both, before = of_both_signs(w), w.copy()
        for k in own:
            w[k] = (1.0 + 1e-6) * max(sum(of_w[k]) for _, of_w in both)
        if (np.abs(w - before) < 1e-12 * w).all():
            break
    for sign, (c, _) in zip((1.0, -1.0), of_both_signs(w), strict=True):
        off = 1e-5 * max(1.0, abs(c))
        assert [accepted(sign, c + by, w) for by in (-off, off)] == [False, True]
        assert [accepted(sign, 1e6, share * w) for share in (1.0 - 3e-4, 1.0)] == [False, True]
    for k in random.choice(own, 6, replace=False):  # and of single cells
        less = w.copy()
        less[k] *= 0.98
        fits = all(sum(of_w[j]) <= less[j] for _, of_w in of_both_signs(less) for j in own)
        assert accepted(1.0, 1e6, less) is fits


# ----------------------------------------------------------------
# Derivatives in balls, against those that mpmath takes by differences.

# A formula of x0 and the parameter p = 0.7 for each operation.
FORMULAS = {
    "add": ([["x", 0], ["pow", 0, 3], ["add", 0, 1]], lambda x: x + x**3),
    "sub": ([["x", 0], ["pow", 0, 2], ["c", "2"], ["sub", 2, 1]], lambda x: 2 - x**2),
    "mul": ([["x", 0], ["exp", 0], ["mul", 0, 1], ["mul", 2, 1]], lambda x: x * mpmath.exp(x) ** 2),
    "div": (
        [["x", 0], ["p", "p"], ["pow", 0, 2], ["add", 1, 2], ["div", 0, 3]],
        lambda x: x / (mpmath.mpf("0.7") + x**2),
    ),
    "division of a number": ([["x", 0], ["c", "3"], ["div", 1, 0]], lambda x: 3 / x),
    "neg": ([["x", 0], ["pow", 0, 4], ["neg", 1]], lambda x: -(x**4)),
    "abs": ([["x", 0], ["c", "2"], ["sub", 0, 1], ["abs", 2], ["pow", 3, 3]], lambda x: abs(x - 2) ** 3),
    "sqrt": (
        [["x", 0], ["pow", 0, 2], ["c", "1"], ["add", 1, 2], ["sqrt", 3]],
        lambda x: mpmath.sqrt(x**2 + 1),
    ),
    "cbrt": ([["x", 0], ["pow", 0, 2], ["cbrt", 1]], lambda x: mpmath.cbrt(x**2)),
    "exp": ([["x", 0], ["pow", 0, 2], ["exp", 1]], lambda x: mpmath.exp(x**2)),
    "log": ([["x", 0], ["pow", 0, 3], ["log", 1], ["mul", 0, 2]], lambda x: x * mpmath.log(x**3)),
    "sin": ([["x", 0], ["c", "3"], ["mul", 0, 1], ["sin", 2]], lambda x: mpmath.sin(3 * x)),
    "cos": ([["x", 0], ["c", "3"], ["mul", 0, 1], ["cos", 2]], lambda x: mpmath.cos(3 * x)),
    "tan": ([["x", 0], ["pow", 0, 2], ["tan", 1]], lambda x: mpmath.tan(x**2)),
    "tanh": ([["x", 0], ["pow", 0, 2], ["tanh", 1]], lambda x: mpmath.tanh(x**2)),
    "powers below 0": ([["x", 0], ["pow", 0, -2]], lambda x: x**-2),
    "the first power": ([["x", 0], ["pow", 0, 1], ["exp", 1]], mpmath.exp),
    "min": ([["x", 0], ["pow", 0, 2], ["min", 0, 1]], lambda x: x**2),
    "max": ([["x", 0], ["pow", 0, 2], ["max", 1, 0], ["pow", 2, 3]], lambda x: x**3),
    "atan2": (
        [["x", 0], ["pow", 0, 2], ["c", "1"], ["add", 1, 2], ["atan2", 0, 3]],
        lambda x: mpmath.atan2(x, x**2 + 1),
    ),
    "atan2 to the left": (
        [["x", 0], ["neg", 0], ["pow", 0, 2], ["atan2", 2, 1]],
        lambda x: mpmath.atan2(x**2, -x),
    ),
    "floor": ([["x", 0], ["floor", 0], ["add", 0, 1], ["pow", 2, 2]], lambda x: (x + mpmath.floor(x)) ** 2),
}


def program(operations):
    read = [read_operation(raw, at, 1, ["p"], "here") for at, raw in enumerate(operations)]
    return Program(Formulas(read, [len(read) - 1]), 1, {"p": arb("0.7")}, [])


@pytest.mark.parametrize("name", FORMULAS)
def test_derivatives_hold_those_of_mpmath(name):
    operations, function = FORMULAS[name]
    with mpmath.workdps(60):
        for middle, radius in ((0.6, 0.0), (0.6, 1e-3), (0.83, 1e-6)):
            ball = arb(middle, radius)
            answer = program(operations).bend([ball])
            for order, enclosed in enumerate(answer):
                for at in (middle - radius, middle, middle + radius):
                    exact = mpmath.diff(function, mpmath.mpf(at), order)
                    near = arb(mpmath.nstr(exact, 40), 1e-20)
                    assert enclosed.overlaps(near), (name, order, enclosed, exact)
                assert enclosed.rad() < 1000 * radius + 1e-12


KINKS = {
    "abs": [["x", 0], ["abs", 0]],
    "min": [["x", 0], ["c", "0"], ["min", 0, 1]],
    "max": [["x", 0], ["neg", 0], ["max", 0, 1]],
    "floor": [["x", 0], ["floor", 0]],
    "root of 0": [["x", 0], ["sqrt", 0]],
    "the cut of atan2": [["x", 0], ["c", "-1"], ["atan2", 0, 1]],
    "division by 0": [["x", 0], ["c", "1"], ["div", 1, 0]],
}


@pytest.mark.parametrize("name", KINKS)
def test_nothing_is_claimed_where_a_kink_or_jump_may_lie(name):
    _, slope, second = program(KINKS[name]).bend([arb(0, 1e-3)])
    assert not (slope.is_finite() and second.is_finite())
