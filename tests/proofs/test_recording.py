"""Recorded formulas: their operations against the functions in Python and compiled, their text, and what is refused."""

import functools
import math
import random
import re
import types
from math import exp, sqrt as root
from typing import NamedTuple

import numpy as np
import pytest
from flint import arb

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError
from limitsets.checker.program import Program, read_formulas
from limitsets.proofs.prover.programs import Formulas, evaluate, recorded_map, require_same
from limitsets.proofs.prover.recording import MOST, recorded
from limitsets.systems.cells import Domain
from limitsets.systems.maps.derived import UNKNOWN, branch_boxes
from tests.maps_of_tests import Tent, TwoState

# ----------------------------------------------------------------
# Functions of params, x, side in all the ways in which they may be written.


class Arm(NamedTuple):
    length: float
    tip: None = None


class Robot(NamedTuple):
    arm: Arm
    k: np.ndarray
    n: float = 2.0


ROBOT = Robot(Arm(1.25), np.array([0.5, 3.0]))
TABLE, SMALL = (2.0, -3.0), np.float32(0.1)
ARRAY = np.array([1.0, 5.0])


def twice(x):
    return 2 * exp(x)


helpers = types.ModuleType("helpers")
exec("import math\ndef f(x): return inner(x) + 1\ndef inner(x): return math.tanh(x)", vars(helpers))  # noqa: S102  # a module of helpers


def inner_function(p, x, side):
    def shifted(y, by=math.tau):
        return math.cos(y) + by

    return shifted(x) * shifted(-x)


def loop(p, x, side):
    for k in range(4):
        x = x + 0.1 * math.sin(x + k) / (1 + side)
    return x


def defaults(p, x, side, sine=math.sin):
    return sine(x)


def around(function):
    @functools.wraps(function)
    def inside(x):
        return function(x) + math.exp(x)

    return inside


@around
def decorated(x):
    return math.sin(x)


WRITTEN = {
    "helper": lambda p, x, side: twice(x),
    "helper in a module": lambda p, x, side: helpers.f(x),
    "decorated helper": lambda p, x, side: decorated(x),
    "inner function": inner_function,
    "default": defaults,
    "by name": lambda p, x, side: root(1 + x**2) - exp(x),
    "numpy": lambda p, x, side: np.exp(x) - np.abs(x) * np.tanh(x) + np.arctan2(x, 2.0) - np.power(x, 3),
    "plain numbers": lambda p, x, side: x * math.hypot(3, 4) + math.pi + np.cbrt(8.0),
    "powers": lambda p, x, side: math.pow(x, 2) + x**2.0 - x**-1 + x**0 + pow(x, 3) + (+x) + x ** np.int64(2),
    "extremes": lambda p, x, side: (
        max(x, 0.1, p.n * x) + min((x, 1 - x)) - np.maximum(x, 0) + np.minimum(1, x)
    ),
    "floors": lambda p, x, side: math.floor(3 * x) + np.floor(x) - math.fabs(x) + abs(x),
    "condition on the side": lambda p, x, side: x * (side == 0) + (1 if side else -x),
    "generator": lambda p, x, side: sum(math.exp(k * x) for k in (1, 2)),
    "table": lambda p, x, side: TABLE[side] * x + ARRAY[side] + SMALL * x,
    "tangent": lambda p, x, side: math.tan(x) / math.log(2 + abs(x)) + math.atan2(1.0, x) + 2**side,
    "parameters": lambda p, x, side: (
        p.k[side] * x - p.arm.length + (0 if p.arm.tip is None else p.arm.tip) + p.k[-1]
    ),
    "from the left": lambda p, x, side: 3 - x + 2 / x - (1 - 4 * x),
    "loop": loop,
    "constant": lambda p, x, side: 0.1,
    "identity": lambda p, x, side: x,
}


@pytest.mark.parametrize("case", WRITTEN)
def test_programs_are_the_functions(case):
    """Against Python's own floats."""
    f = WRITTEN[case]
    numbers = {"arm.length": 1.25, "k.0": 0.5, "k.1": 3.0, "n": 2.0}
    for side in (0, 1):
        program = recorded(f, ROBOT, 1, side)
        x = np.array([-1.7, -0.3, 0.2, 0.9, 2.6])
        expected = [f(ROBOT, at, side) for at in x]
        np.testing.assert_allclose(
            evaluate(program, x[:, None], numbers)[:, 0], expected, rtol=1e-13, atol=1e-15
        )


def test_equal_operations_once_and_dead_ones_dropped():
    def f(p, x, side):
        np.sin(x)
        a = x * x + 1
        return a / (x * x + 1), side

    assert recorded(f, ROBOT, 1, 0) == {
        "to": 0,
        "ops": [["x", 0], ["mul", 0, 0], ["c", "1"], ["add", 1, 2], ["div", 3, 3]],
        "out": [4],
    }


def test_constants_are_shortest_decimals():
    texts = {0.1: "0.1", 3: "3", -2.0: "-2", 1e-7: "1e-07", 2**53: "9007199254740992.0"}
    texts[np.float64(2.5)] = "2.5"
    for value, text in texts.items():
        assert recorded(lambda p, x, side, value=value: value, ROBOT, 1, 0)["ops"] == [["c", text]]


# ----------------------------------------------------------------
# The table, of maps with sides and branches.


def two_sides(p, x, side):
    return p.k[side] * x + p.arm.length, 1 - side, 0


ls.register(Robot, image=two_sides)


def test_the_table_of_a_map():
    assert recorded_map(ROBOT, 2) == {
        "dimension": 1,
        "sides": 2,
        "branches": 1,
        "parameters": ["arm.length", "k.0", "k.1", "n"],
        "programs": [
            {
                "side": side,
                "branch": 0,
                "to": 1 - side,
                "ops": [["x", 0], ["p", "arm.length"], ["p", f"k.{side}"], ["mul", 2, 0], ["add", 3, 1]],
                "out": [4],
            }
            for side in (0, 1)
        ],
        "margins": [],
        "periodic": [[None], [None]],
    }
    table = recorded_map(Tent(1.8), 1)
    assert (table["branches"], len(table["margins"])) == (2, 1)
    assert [program["branch"] for program in table["programs"]] == [0, 1]


def test_the_textbook():
    """Leslie's formulas as its docstring has them; the exponential by hand is one of the operations."""
    assert str(ls.formulas(ls.maps.Leslie(), [(0, 90), (0, 70)])).splitlines()[1:] == [
        "    x0' = (young * x0 + old * x1) * exp((-crowding) * (x0 + x1))",
        "    x1' = survival * x0",
    ]


def ikeda(x, y, u):
    t = 0.4 - 6 / (1 + x**2 + y**2)
    return 1 + u * (x * math.cos(t) - y * math.sin(t)), u * (x * math.sin(t) + y * math.cos(t))


def below(x, alpha):
    return alpha * x + 0.9


def above(x, alpha):
    return alpha * x - 1


def at_zero(x):
    return x


def test_formulas_of_written_maps():
    assert str(ls.formulas(ls.map(ikeda, u=0.9))) == (
        "side 0, branch 0, to side 0:\n"
        "    t1 = 0.4 - 6 / (1 + x0^2 + x1^2)\n"
        "    t2 = cos(t1)\n"
        "    t3 = sin(t1)\n"
        "    x0' = 1 + u * (x0 * t2 - x1 * t3)\n"
        "    x1' = u * (x0 * t3 + x1 * t2)"
    )
    gap = ls.map(pieces=(below, above), margin=at_zero, alpha=1.4)
    assert str(ls.formulas(gap, ls.grid([(-1.3, 1.2)], cells=8))) == (
        "side 0, branch 0, to side 0:\n    x0' = alpha * x0 + 0.9\n"
        "side 0, branch 1, to side 0:\n    x0' = alpha * x0 - 1\n"
        "side 0: branch 1 if and only if margin > 0, else branch 0\n    margin = x0\n"
        "the proof is of these formulas, not of the function image"
    )


# ----------------------------------------------------------------
# The text.

X, P = ["x", 0], ["p", "a"]
TEXTS = {
    "(x0^2)^3": [X, ["pow", 0, 2], ["pow", 1, 3]],
    "(-2)^2": [["c", "-2"], ["pow", 0, 2]],
    "(2)^(-1)": [["c", "2"], ["pow", 0, -1]],
    "(x0 + a)^2": [X, P, ["add", 0, 1], ["pow", 2, 2]],
    "-x0^2": [X, ["pow", 0, 2], ["neg", 1]],
    "(-x0)^2": [X, ["neg", 0], ["pow", 1, 2]],
    "x0 - (-a)": [X, P, ["neg", 1], ["sub", 0, 2]],
    "x0 - (x0 - a)": [X, P, ["sub", 0, 1], ["sub", 0, 2]],
    "x0 - a - x0": [X, P, ["sub", 0, 1], ["sub", 2, 0]],
    "x0 / (a * x0)": [X, P, ["mul", 1, 0], ["div", 0, 2]],
    "x0 / a / x0": [X, P, ["div", 0, 1], ["div", 2, 0]],
    "exp(a)^2 * (-3)": [P, ["exp", 0], ["pow", 1, 2], ["c", "-3"], ["mul", 2, 3]],
    "max(x0 + a, atan2(x0, 2))": [X, P, ["add", 0, 1], ["c", "2"], ["atan2", 0, 3], ["max", 2, 4]],
}
TEXTS |= {
    f"p.{name} + x0": [["p", name], X, ["add", 0, 1]]
    for name in ("x", "x1", "t2", "exp", "margin", "pi", "p.a")
}


def table_of(ops, out):
    program = {"side": 0, "branch": 0, "to": 0, "ops": ops, "out": out}
    return {"dimension": len(out), "programs": [program], "margins": []}


@pytest.mark.parametrize("text", TEXTS)
def test_text(text):
    ops = TEXTS[text]
    assert str(Formulas(None, table_of(ops, [len(ops) - 1]))).splitlines()[1] == f"    x0' = {text}"


def steps(p, x, side):
    for _ in range(MOST - 2):
        x = 1 - x
    return x, side


def one_more(p, x, side):
    return steps(p, x, side)[0] + 2 + 0 * x, side


def test_the_largest_program():
    """20 000 operations, each on the one before; an even number of 1 - x is the identity."""
    program = recorded(steps, ROBOT, 1, 0)
    assert len(program["ops"]) == MOST == 20_000
    assert evaluate(program, np.array([[0.25]]), {}) == [[0.25]]
    formulas = Formulas(None, table_of(program["ops"], program["out"]))
    assert len(formulas.lines) > 1000
    assert len(str(formulas).splitlines()) == 21
    assert "more lines" in str(formulas)
    with pytest.raises(AnswerError, match=r"is '2000[0-9] operations'; allowed"):
        recorded(one_more, ROBOT, 1, 0)


# ----------------------------------------------------------------
# Random programs: recorded, compiled, in Python, and read back from their text.

OF_ONE = ("-({})", "abs({})", "math.sqrt(abs({}))", "math.exp(-abs({}))", "math.sin({})", "np.cos({})")
OF_ONE += ("np.tanh({})",)
OF_TWO = ("({} + {})", "({} - {})", "({} * {})", "({} / (2.5 + math.cos({})))", "max({}, {})", "min({}, {})",
          "np.arctan2({}, 3 + abs({}))")  # fmt: skip


def random_formula(draw, depth):
    if depth == 0:
        return draw.choice(("x", "y", "z", "a", "b", "0.1", "2", "-3"))
    below = [random_formula(draw, draw.randrange(depth)) for _ in range(2)]
    if draw.random() < 0.2:
        return f"({below[0]})**{draw.choice((2, 3, 0, '2.0'))}"
    return draw.choice(OF_TWO).format(*below) if draw.random() < 0.7 else draw.choice(OF_ONE).format(below[0])


def read_back(lines, x, a, b):
    """Evaluate printed lines by Python's own grammar."""
    names = {name: getattr(np, name) for name in ("sqrt", "exp", "sin", "cos", "tanh", "abs")}
    names |= {"atan2": np.arctan2, "max": np.maximum, "min": np.minimum, "a": a, "b": b}
    names |= {f"x{k}": x[:, k] for k in range(3)}
    for line in lines:
        name, text = line.strip().replace("'", "_after").split(" = ")
        names[name] = eval(re.sub(r"\^", "**", text), {}, names)  # noqa: S307  # our own text
    return np.stack([np.broadcast_to(names[f"x{k}_after"], len(x)) for k in range(3)], axis=1)


@pytest.mark.sweep
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.repeats) for k in range(2, 14))])
def test_random_programs_agree(seed):
    """Three formulas each."""
    draw = random.Random(seed)
    texts = [random_formula(draw, 5) for _ in range(3)]
    scope = {"math": math, "np": np}
    exec(f"def written(x, y, z, a, b):\n    return {', '.join(texts)}", scope)  # noqa: S102  # our own text
    params = ls.map(scope["written"], a=0.7, b=-1.3)
    formulas = ls.formulas(params)
    x = np.random.default_rng(seed).uniform(-2, 2, (2000, 3))
    expected = np.array([scope["written"](*map(float, at), 0.7, -1.3) for at in x], dtype=float)
    program = formulas.table["programs"][0]
    for values in (
        evaluate(program, x, {"a": 0.7, "b": -1.3}),
        ls.maps.images(params, x, 0).x,
        read_back(formulas.lines[1:], x, 0.7, -1.3),
    ):
        np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-9)
    holds(params, program, seed)


def holds(params, program, seed):
    """1e5 images lie in what the prover's compiled intervals enclose of their boxes, and the checker's balls."""
    generator = np.random.default_rng(seed)
    lo = generator.uniform(-2, 1.9, (100, 3))
    hi = lo + 10.0 ** generator.uniform(-4, -1, (100, 3))
    x = lo[:, None] + generator.uniform(0, 1, (100, 1000, 3)) * (hi - lo)[:, None]
    images = evaluate(program, x.reshape(-1, 3), params._asdict()).reshape(x.shape)
    least, most = images.min(axis=1), images.max(axis=1)
    off = 1e-12 * (1 + np.abs(most))  # images are rounded
    boxes = branch_boxes(params, params, 0, 0, lo, hi)
    known = boxes.state != UNKNOWN
    assert known.mean() > 0.9
    assert ((boxes.lo <= least + off) & (most - off <= boxes.hi))[known].all()
    parameters = {name: arb(number) for name, number in params._asdict().items()}
    formulas = read_formulas({key: program[key] for key in ("ops", "out")}, 3, [*parameters], 3, "a test")
    checked = Program(formulas, 3, parameters, [])
    for k in range(100):
        balls = checked.at([arb(float(a)).union(arb(float(b))) for a, b in zip(lo[k], hi[k], strict=True)])
        for axis, ball in enumerate(balls):
            wider = ball + arb(0, off[k, axis])
            assert not ball.is_finite() or all(wider.contains(arb(end[k, axis])) for end in (least, most))


# ----------------------------------------------------------------
# What is refused, and what the comparison stops.

REFUSED = {
    "<": lambda p, x, side: 1 if x < 0 else 0,
    "==": lambda p, x, side: x * (x == 0),
    "the truth": lambda p, x, side: 1 if x else 0,
    "%": lambda p, x, side: x % 1,
    "//": lambda p, x, side: 1 // x,
    "divmod": lambda p, x, side: divmod(x, 1)[1],
    "the power 0.5": lambda p, x, side: x**0.5,
    "the power 201": lambda p, x, side: x**201,
    "a power by x or a parameter": lambda p, x, side: x**p.n,
    "a power of": lambda p, x, side: 2**x,
    "float": lambda p, x, side: float(x),
    "int": lambda p, x, side: int(x),
    "round": lambda p, x, side: round(x),
    "clip": lambda p, x, side: np.clip(x, 0, 1),
    "sign": lambda p, x, side: np.sign(x),
    "lgamma": lambda p, x, side: math.lgamma(x),
    "norm": lambda p, x, side: np.linalg.norm([x, 1.0]),
    "array": lambda p, x, side: np.array([x, 2.0]),
    "an array": lambda p, x, side: np.ones(2) * x,
    "an index": lambda p, x, side: TABLE[x],
    "an entry": lambda p, x, side: x[0],
    "the number": lambda p, x, side: x * 10**400,
    "the number nan": lambda p, x, side: x + math.nan,
    "the number 1e-120": lambda p, x, side: x + 1e-120,
    "ZeroDivisionError": lambda p, x, side: x / (1 / side),
    "a side that depends on x": lambda p, x, side: (x, x),
    "a text": lambda p, x, side: "x",
    "NameError": lambda p, x, side: undefined,  # noqa: F821
    "AttributeError": lambda p, x, side: p.width * x,
    "more than 200000 operations": lambda p, x, side: sum(x for _ in range(10**9)),
}  # fmt: skip
NAMED = {"an array": "ndarray", "a text": "'x'"} | {
    name: f"{name} of x" for name in ("array", "clip", "sign", "norm")
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_one_line(case):
    with pytest.raises(AnswerError) as error:
        recorded(REFUSED[case], ROBOT, 1, 0)
    message = str(error.value)
    assert NAMED.get(case, case) in message
    assert re.search(r"what the function <lambda> of Robot does", message)
    assert "\n" not in message


def test_no_handler_of_the_function_hides_a_refusal():
    def hides(p, x, side):
        try:
            return x if x < 0 else 2 * x
        except Exception:  # noqa: BLE001
            return x

    with pytest.raises(
        AnswerError, match=r"\(hides, line \d+ of test_recording.py\) is '< of x or a parameter'"
    ):
        recorded(hides, ROBOT, 1, 0)


class Flagged(NamedTuple):
    flag: bool


class ThreeNames(NamedTuple):
    größe: float


class TwoFormulas(NamedTuple):
    a: float


def step(p, x, side):
    return 0.5 * x, side, 0


def two_formulas_on(p, x, side, branch):
    return p.a * x * (1 + branch), side


ls.register(TwoFormulas, image=step, image_on=two_formulas_on, branches=("one", "two"))
ls.register(Flagged, image=step)
ls.register(ThreeNames, image=step)


@pytest.mark.parametrize(
    ("params", "words"),
    [
        (Flagged(True), "the parameter flag is True"),
        (ThreeNames(1.0), "the parameter is 'größe'"),
        (TwoState(), "'>= of x or a parameter'"),
        (TwoFormulas(0.5), "TwoFormulas, of 2 branches, without margin"),
        (ls.load("paper-designed").map, "which has on_side"),
    ],
)
def test_maps_that_no_certificate_speaks_of(params, words):
    with pytest.raises((AnswerError, MapError), match=re.escape(words)):
        recorded_map(params, 1)


def test_branches_that_are_names_alone_are_one_in_the_file():
    table = recorded_map(ls.maps.Logistic(3.2), 1)
    assert (table["branches"], len(table["programs"]), table["margins"]) == (1, 1, [])


def asks_its_kind(x, a):
    return a * x if isinstance(x, float) else 2 * a * x


class Wide(NamedTuple):
    a: float


def beyond_64_bits(p, x, side):
    return p.a + x * ((side + 1) * 2**62 * 4), side, 0


ls.register(Wide, image=beyond_64_bits)


@pytest.mark.parametrize("params", [ls.map(asks_its_kind, a=1.5), Wide(1.0)], ids=["isinstance", "64 bits"])
def test_the_comparison_stops_what_is_recorded_wrongly(params):
    with pytest.raises(
        AnswerError, match=r"the recorded formula of image of .* as it is compiled; write it without"
    ):
        ls.formulas(params)


def test_the_comparison_notices_every_part():
    """A table with one part changed: constant, side, margin; and parameters between the corners."""
    params, line = ls.map(pieces=(below, above), margin=at_zero, alpha=1.4), Domain([[-1.0]], [[1.0]])
    upper = params.with_values(alpha=1.5)
    require_same(params, upper, recorded_map(params, 1), line)
    for change in (
        lambda t: t["programs"][1]["ops"][-2].__setitem__(1, "1.00001"),
        lambda t: t["programs"][0].__setitem__("to", 1),
        lambda t: t["programs"][0]["out"].__setitem__(0, 0),
        lambda t: t["margins"][0]["ops"].__setitem__(0, ["c", "0.5"]),
        lambda t: t["programs"][0]["ops"].__setitem__(1, ["c", "1.4"]),
    ):
        table = recorded_map(params, 1)
        change(table)
        with pytest.raises(AnswerError, match="the recorded formula of"):
            require_same(params, upper, table, line)
