"""Operations of formulas in the checker: balls and gradients hold what mpmath computes; kinks, cuts, poles; print."""

import operator
import random

import mpmath
import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import flint
from flint import arb

from limitsets.checker.any_map import CellPiece, Map, map_in_words, read_map, slopes_unless
from limitsets.checker.balls import PRECISION, UnprovedError, reason_of
from limitsets.checker.file import BadFileError
from limitsets.checker.program import Program, in_words, number, read_formulas
from tests.checker.maps_in_files import Example

EXACT = {  # each operation by mpmath; pow has its exponent behind the colon
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
    "min": min,
    "max": max,
    "atan2": mpmath.atan2,
    "neg": lambda x: -x,
    "abs": abs,
    "sqrt": mpmath.sqrt,
    "cbrt": lambda x: mpmath.sign(x) * mpmath.cbrt(abs(x)),
    "exp": mpmath.exp,
    "log": mpmath.log,
    "sin": mpmath.sin,
    "cos": mpmath.cos,
    "tan": mpmath.tan,
    "tanh": mpmath.tanh,
    "floor": mpmath.floor,
    **{f"pow:{n}": lambda x, n=n: x**n for n in (1, 2, 3, 4, 7, 200, -1, -2, -5)},
}
TWO = ("add", "sub", "mul", "div", "min", "max", "atan2")


@pytest.fixture(autouse=True)
def precision(monkeypatch):
    monkeypatch.setattr(flint.ctx, "prec", PRECISION)
    with mpmath.workdps(60):
        yield


def program_of(word, names=()):
    """One operation on x0, or on x0 and x1."""
    name, _, exponent = word.partition(":")
    last = [name, 0, int(exponent)] if exponent else [name, 0, 1] if name in TWO else [name, 0]
    raw = {"ops": [["x", 0], ["x", 1], last], "out": [2]}
    return Program(read_formulas(raw, 2, list(names), 1, "a test"), 2, {}, [])


def hull(lo, hi):
    return arb(lo).union(arb(hi))


def close(value):
    """A ball around a number of mpmath, as wide as its rounding."""
    middle = arb(mpmath.nstr(value, 55))
    return middle + arb(0, abs(float(value)) * 1e-50)


@pytest.mark.parametrize("word", EXACT)
def test_ball_and_gradient_hold_values_and_difference_quotients(word):
    generator = random.Random(word)
    program, known = program_of(word), 0
    for _ in range(60):
        scale = 10.0 ** generator.uniform(-3, 1.2)
        box = []
        for _ in range(2):
            at = generator.choice((0.0, generator.uniform(-3, 3)))
            box.append((at - scale * generator.random(), at + scale * generator.random()))
        balls = [hull(*ends) for ends in box]
        (value,), (slopes,) = program.at(balls), program.gradients(balls)
        points = [[mpmath.mpf(generator.uniform(*ends)) for ends in box] for _ in range(5)]
        points.append([mpmath.mpf(ends[generator.randrange(2)]) for ends in box])
        if not value.is_finite():
            assert not any(s.is_finite() for s in slopes[: 2 if word in TWO else 1])
            continue
        known += 1
        results = [EXACT[word](*(point if word in TWO else point[:1])) for point in points]
        assert all(value.overlaps(close(result)) for result in results)
        for first, one in zip(points, results, strict=True):
            for second, other in zip(points, results, strict=True):
                off = [close(u - v) for u, v in zip(first, second, strict=True)]
                change = sum((g * d for g, d in zip(slopes, off, strict=True)), arb(0))
                assert not change.is_finite() or change.overlaps(close(one) - close(other))
    assert known >= 10


HALF = (0.5, 0.5)


@pytest.mark.parametrize(
    (
        "word",
        "x",
        "y",
        "image",
        "slope",
    ),  # on x and y: None where nothing may be known, ... where it is not asked
    [
        ("pow:2", (-1, 2), HALF, (0, 4), ...),
        ("pow:4", (-1, 2), HALF, (0, 16), ...),
        ("pow:2", (0, 0), HALF, (0, 0), ...),
        ("pow:3", (-1, 2), HALF, (-6, 8), ...),  # x times the ball of x^2
        ("pow:1", (-1, 1), HALF, ..., (1, 1)),
        ("abs", (-1, 2), HALF, (0, 2), ...),
        ("abs", (-2, -1), HALF, (1, 2), ...),
        ("abs", (-1, 1), HALF, ..., (-1, 1)),
        ("abs", (0, 1), HALF, ..., (-1, 1)),
        ("min", (-1, 2), HALF, (-1, 0.5), (0, 1)),
        ("max", (-1, 2), HALF, (0.5, 2), ...),
        ("max", (1, 2), HALF, ..., (1, 1)),
        ("max", (-1, 0), HALF, ..., (0, 0)),
        ("floor", (1.25, 1.5), HALF, (1, 1), (0, 0)),
        ("floor", (0.5, 1), HALF, (0, 1), None),
        ("floor", (0.5, 1.5), HALF, ..., None),
        ("atan2", (-1, 1), (-2, -1), ..., None),
        ("atan2", (0, 1), (0, 1), ..., None),
        ("div", (1, 2), (-1, 1), None, None),
        ("div", (0, 0), (0, 0), None, None),
        ("pow:-1", (0, 0), (1, 1), None, None),
        ("pow:-2", (-1, 1), (1, 1), None, None),
        ("log", (0, 1), (1, 1), None, None),
        ("log", (-2, -1), (1, 1), None, None),
        ("sqrt", (-1, 1), (1, 1), None, None),
        ("tan", (1, 2), (1, 1), None, None),
    ],
)
def test_images_and_slopes_at_kinks_jumps_and_poles(word, x, y, image, slope):
    """Balls are hardly wider than the image and all slopes between; beyond a domain or at a jump nothing is proved."""
    balls = [hull(*map(float, ends)) for ends in (x, y)]
    (value,), ((by_x, _),) = program_of(word).at(balls), program_of(word).gradients(balls)
    for found, ends, near in ((value, image, 1e-6), (by_x, slope, 1e-8)):
        if ends is None:
            assert not any((found.is_finite(), found >= 0, found <= 0))
        elif ends is not ...:
            assert found.contains(hull(*map(float, ends)))
            assert ends[0] - near <= float(found.lower()) <= float(found.upper()) <= ends[1] + near


def test_sqrt_at_the_end_of_its_domain_has_a_value_and_no_slope():
    assert program_of("sqrt").at([arb(0), arb(0)])[0].is_zero()
    assert not program_of("sqrt").gradients([arb(0), arb(0)])[0][0].is_finite()


def test_a_value_that_is_lost_stays_lost():
    for ops in (
        [["c", "0"], ["log", 0], ["mul", 1, 2]],
        [["c", "2"], ["log", 0], ["min", 1, 2]],
        [["c", "2"], ["log", 0], ["max", 2, 1]],
        [["c", "2"], ["log", 0], ["floor", 2]],
    ):
        raw = {"ops": [["x", 0], *ops], "out": [3]}
        program = Program(read_formulas(raw, 1, [], 1, "a test"), 1, {}, [])
        (value,), ((slope,),) = program.at([hull(-1.0, 1.0)]), program.gradients([hull(-1.0, 1.0)])
        assert not any((value <= 9, value >= -9, slope <= 9, slope >= -9))


def test_the_decimal_and_the_double_next_to_it():
    tenth = number("0.1", "a test")
    assert tenth.contains(arb(1) / 10)
    assert tenth.contains(arb(0.1))
    off = arb(0.1) - tenth
    assert not any((off > 0, off < 0, off == 0))
    assert number("-25e-1", "a test") == -2.5


def test_a_range_is_an_input_and_a_value_is_not():
    example = Example(1, "a b", lambda x, p, *_: p.a * x[0] + p.b)
    shape = read_map(example.header())
    wide = Map(shape, {"a": ("0.5", "0.6"), "b": ("2", "2")})
    piece = wide.piece([(1.0, 2.0)])
    ((by_x, by_a),) = wide.image[0, 0].gradients(piece.balls)
    assert by_x.contains(hull(0.5, 0.6))
    assert by_a.contains(hull(1.0, 2.0))
    assert len(wide.piece([(1.0, 2.0)]).balls) == 2


def test_deep_programs_are_evaluated_and_printed_without_recursion():
    deep = {"ops": [["x", 0], *(["neg", k] for k in range(19_999))], "out": [19_999]}
    formulas = read_formulas(deep, 1, [], 1, "a test")
    program = Program(formulas, 1, {}, [])
    assert program.at([arb(3)])[0] == -3
    assert program.gradients([arb(3)])[0][0] == -1
    assert len(in_words(formulas, ["x0'"])) > 100
    with pytest.raises(BadFileError):
        read_formulas({"ops": [*deep["ops"], ["neg", 0]], "out": [0]}, 1, [], 1, "a test")


def random_formulas(generator):
    """A program of twelve operations on two coordinates, a parameter and a constant."""
    ops = [["x", 0], ["x", 1], ["p", "a"], ["c", generator.choice(("0.1", "-2", "3.7"))]]
    for _ in range(12):
        name, _, exponent = generator.choice(list(EXACT)).partition(":")
        entries = [generator.randrange(max(0, len(ops) - 6), len(ops)) for _ in range(1 + (name in TWO))]
        ops.append([name, *entries, *([max(-3, min(3, int(exponent)))] if exponent else [])])
    return ops


def value_of(ops, x, a):
    """Evaluate a program by mpmath; None where it is not defined over the reals."""
    values = []
    for name, *rest in ops:
        if name in ("x", "p", "c"):
            values.append(x[rest[0]] if name == "x" else a if name == "p" else mpmath.mpf(rest[0]))
        elif name == "pow":
            if values[rest[0]] == 0 and rest[1] < 0:
                return None
            values.append(values[rest[0]] ** rest[1])
        else:
            numbers = [values[k] for k in rest]
            defined = {"sqrt": numbers[0] >= 0, "log": numbers[0] > 0, "div": numbers[-1] != 0}.get(
                name, True
            )
            if not defined or abs(numbers[0]) > 1e4:
                return None
            values.append(EXACT[name](*numbers))
    return values[-1]


def test_bounds_that_are_proved_hold_at_random_places():
    """Ends just inside the sampled range are never proved, ends some way outside often are, by each enclosure."""
    generator, proved, tried = random.Random(3), 0, 0
    while tried < 150:
        ops = random_formulas(generator)
        formulas = read_formulas({"ops": ops, "out": [len(ops) - 1]}, 2, ["a"], 1, "a test")
        box = [
            (v, v + 10.0 ** generator.uniform(-3, 0)) for v in (generator.uniform(-2, 2) for _ in range(3))
        ]
        places = [[mpmath.mpf(generator.uniform(*ends)) for ends in box] for _ in range(12)]
        places += [[mpmath.mpf(ends[generator.randrange(2)]) for ends in box] for _ in range(4)]
        values = [value_of(ops, place[:2], place[2]) for place in places]
        if any(v is None or abs(v) > 1e9 for v in values):
            continue
        tried += 1
        program, piece = Program(formulas, 2, {"a": hull(*box[2])}, ["a"]), CellPiece(box)
        low, high = min(values), max(values)
        off = (high - low) * 0.3 + abs(high) * 1e-6 + mpmath.mpf(10) ** -9
        for relation, end, beyond in ((operator.le, high, -1), (operator.ge, low, 1)):
            inside = close(end) + beyond * arb(1e-12) * (1 + abs(close(end)))
            if low < high:
                assert slopes_unless(program, piece, [(0, relation, inside)]) is not None
            outside = close(end - beyond * off)
            proved += slopes_unless(program, piece, [(0, relation, outside)]) is None
    assert proved > 100


# ----------------------------------------------------------------- the printed formulas


def printed(function, names="", dimension=2):
    shape = read_map(Example(dimension, names, function).header())
    return [line.strip() for line in map_in_words(shape)][1:]


def test_printed_formulas_cannot_mislead():
    assert printed(lambda x, *_: ((x[0] ** 2) ** 3, x[1])) == ["x0' = (x0^2)^3", "x1' = x1"]
    once = {"ops": [["c", "-2"], ["pow", 0, 2]], "out": [1]}
    assert in_words(read_formulas(once, 1, [], 1, "a test"), ["x0'"]) == ["x0' = (-2)^2"]
    assert printed(lambda x, p, *_: (p.x1 * x[0], x[1] - (x[0] - 1)), "x1")[0] == "x0' = p.x1 * x0"
    for name in ("t2", "exp", "Margin", "pi", "p.x", "x0.y", "e"):
        assert printed(lambda x, p, *_: (vars(p)[name] + x[0], x[1]), name)[0] == f"x0' = p.{name} + x0"  # noqa: B023
    assert printed(lambda x, p, *_: (vars(p)["k.0"] + x[0], x[1]), "k.0")[0] == "x0' = k.0 + x0"
    assert printed(lambda x, *_: (x[0] - (x[1] - 1), x[0] / (x[1] / 2)))[0] == "x0' = x0 - (x1 - 1)"
    assert printed(lambda x, *_: (np.exp(-x[0]), (-x[1]) ** 2)) == ["x0' = exp(-x0)", "x1' = (-x1)^2"]
    twice = {"ops": [["c", "-2"], ["neg", 0], ["pow", 1, 2]], "out": [2]}
    assert in_words(read_formulas(twice, 1, [], 1, "a test"), ["x0'"]) == ["x0' = (-(-2))^2"]


def test_what_is_used_twice_has_a_line_of_its_own():
    def twice(x, *_):
        r = np.sqrt(x[0] ** 2 + x[1] ** 2)
        return r * x[0], r**2

    assert printed(twice) == ["t1 = sqrt(x0^2 + x1^2)", "x0' = t1 * x0", "x1' = t1^2"]


def test_long_formulas_are_cut_into_lines():
    def long(x, *_):
        value = x[0]
        for k in range(1, 60):
            value = value + x[1] ** (k % 9 + 1) / k
        return value, x[1]

    lines = printed(long)
    assert max(map(len, lines)) < 200
    assert len(lines) > 5


def test_a_check_that_gives_no_reason_is_not_taken_for_proved():
    def silent():
        raise UnprovedError("")

    assert reason_of(silent)
    assert reason_of(lambda: None) == ""
