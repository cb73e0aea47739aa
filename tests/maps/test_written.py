"""`limitsets.map`: maps of plain functions through every door, what is compiled again, and what is refused."""

import functools
import importlib
import math
import pickle
import subprocess
import sys
import types
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core import event

import limitsets as ls
from limitsets.base.errors import MapError
from limitsets.parameters.atlas.subjects import MapSubject

# ----------------------------------------------------------------
# Functions as users write them.

SHIFT = WEIGHT = 0.5


def henon(x, y, a, b):
    return 1 - a * x**2 + y, b * x


def left(x, slope=1.8):
    return slope * x


def right(x, slope=1.8):
    return slope * (1 - x)


def beyond(x):
    return x - SHIFT


def odd_names(side, x, count, index):
    return count * x + index, side


def lorenz(x, y, z, h, rho):
    return x + h * 10 * (y - x), y + h * (x * (rho - z) - y), z + h * (x * y - 8 / 3 * z)


def halved(x):
    return helper(x) + 0.25


def helper(x):
    return 0.5 * x


def tent(**values):
    return ls.map(pieces=(left, right), margin=beyond, **values)


def tent_in_python(x):
    return right(x) if beyond(x) > 0 else left(x)


@pytest.mark.parametrize(
    ("params", "step", "start"),
    [
        (ls.map(henon, a=1.4, b=0.3), lambda x, y: henon(x, y, 1.4, 0.3), (0.1, 0.2)),
        (ls.map(odd_names, count=0.5, index=1), lambda x, y: (0.5 * y + 1, x), (0.1, 0.2)),
        (ls.map(henon, a=1.2, b=np.float32(0.25)), lambda x, y: henon(x, y, 1.2, 0.25), (0.1, 0.2)),
        (tent(), tent_in_python, (0.3,)),
        (ls.map(lorenz, h=0.01, rho=28), lambda x, y, z: lorenz(x, y, z, 0.01, 28), (1.0, 2.0, 3.0)),
        (ls.map(halved), halved, (0.7,)),
    ],
    ids=["henon", "odd-names", "other-values", "tent", "three-coordinates", "no-parameters"],
)
def test_orbits_are_those_of_the_functions_in_python(params, step, start):
    orbit = ls.orbit(params, start if len(start) > 1 else start[0], 0, 12)
    expected = [start]
    for _ in range(12):
        after = step(*expected[-1])
        expected.append(after if isinstance(after, tuple) else (after,))
    np.testing.assert_allclose(orbit.x.reshape(13, -1), expected, rtol=1e-9)


def test_the_map_of_the_plane_through_every_door():
    """Henon's attractor, and basins, as of the registered map; x = (b - 1 + sqrt((1 - b)^2 + 4 a)) / (2 a)."""
    params, grid = ls.map(henon, a=1.4, b=0.3), ls.grid([(-1.5, 1.5), (-0.5, 0.5)], cells=512)
    graph, registered = (
        ls.transitions(params, grid, "boxes"),
        ls.transitions(ls.maps.Henon(1.4, 0.3), grid, "boxes"),
    )
    mine, theirs = ls.attractors(graph), ls.attractors(registered)
    assert [a.cells.mask.sum() for a in mine] == [a.cells.mask.sum() for a in theirs]
    assert ls.basins(graph, mine).attractors == ls.basins(registered, theirs).attractors
    fixed = (-0.7 + math.sqrt(0.49 + 5.6)) / 2.8
    assert any(abs(cycle.x[0][0] - fixed) < 1e-9 for cycle in ls.cycles(graph, 1))


def test_two_branches_through_every_door():
    """The tent of slope 1.8: it turns at 1/2, its attractor is [1.8 (1 - 0.9), 0.9], every slope is 1.8 in size."""
    params, grid = tent(), ls.grid([(0.15, 0.93)], cells=1024)
    assert [point.x for point in ls.critical_points(params, grid.domain)[0]] == pytest.approx([0.5])
    ((lo, hi),) = ls.attractors(ls.transitions(params, grid, "boxes"))[0].extents[0]
    assert (lo, hi) == pytest.approx((0.18, 0.9), abs=4 * 0.78 / 1024)
    proof = ls.certify(params, grid, ["invariant", "expanding"], upper=params.with_values(slope=1.8001))
    assert proof.proved
    assert ls.maps.kind_of(params).branches == ("left", "right")
    assert ls.maps.lyapunov(params, 0.3, 0, 1000).exponent == pytest.approx(math.log(1.8))


# ----------------------------------------------------------------
# What is compiled again.


def compilations(run):
    """How many functions numba compiles meanwhile."""
    with event.install_recorder("numba:compile") as recorder:
        run()
    return len(recorder.buffer)


def test_the_same_functions_compile_once():
    orbit = functools.partial(ls.orbit, x=(0.1, 0.2), side=0, count=3)
    params = ls.map(henon, a=1.4, b=0.3)
    orbit(params)
    for again in (params.with_values(a=1.2), ls.map(henon, a=1, b=0.1), ls.map(henon, b=0.3, a=1.3)):
        assert type(again) is type(params)
        assert compilations(lambda again=again: orbit(again)) == 0
    assert type(tent(slope=1.7)) is type(tent())
    assert pickle.loads(pickle.dumps(params)) == params
    assert type(pickle.loads(pickle.dumps(tent()))) is type(tent())


CELL = """
SCALE = 2.0
def inner(x):
    return SCALE * x
def outer(x, a):
    return a * inner(x)
"""


def test_a_cell_of_a_notebook_that_runs_again():
    """Unchanged it is the same map, also beside a change of what it does not read; a changed helper makes another."""
    cell = types.ModuleType("notebook")
    sys.modules["notebook"] = cell  # as a kernel has its own
    try:
        exec(CELL, vars(cell))  # noqa: S102  # as a notebook does
        first = ls.map(cell.outer, a=3.0)
        assert ls.orbit(first, 1.0, 0, 1).x[1] == 6.0
        exec(CELL + "\nother = 5", vars(cell))  # noqa: S102  # as a notebook does
        assert type(ls.map(cell.outer, a=3.0)) is type(first)
        for edit, after in (
            ("SCALE = 4.0", 12.0),
            ("SCALE = 5.0", 15.0),
            ("def inner(x): return x + 7", 24.0),
            (CELL, 6.0),
        ):
            exec(edit, vars(cell))  # noqa: S102  # as a notebook does
            assert ls.orbit(ls.map(cell.outer, a=3.0), 1.0, 0, 1).x[1] == after
        assert type(ls.map(cell.outer, a=3.0)) is type(first)
        assert ls.orbit(first, 1.0, 0, 1).x[1] == 6.0
    finally:
        del sys.modules["notebook"]


class Before(NamedTuple):
    a: float


class After(NamedTuple):
    a: float


def scaled(x):
    return WEIGHT * x


def image(params, x, side):
    return params.a + scaled(x), side, 0


def test_a_helper_of_a_registered_map_reads_its_globals_anew(monkeypatch):
    for cls, weight in ((Before, 2.0), (After, 4.0)):
        monkeypatch.setitem(globals(), "WEIGHT", weight)
        assert ls.orbit(ls.register(cls, image=image)(1.0), 1.0, 0, 1).x[1] == 1.0 + weight


SCRIPT = """
import pickle, sys
import limitsets as ls
from numba.core import event
import mine, other
if edit := sys.argv[2:]:
    open("helpers.py", "w").write(edit[0])
with event.install_recorder("numba:compile") as recorder:
    params = ls.map(mine.grown, a=2.0)
    print(float(ls.orbit(params, 1.0, 0, 1).x[1]), float(ls.orbit(ls.map(other.grown, a=2.0), 1.0, 0, 1).x[1]))
print(len(recorder.buffer))
print(pickle.loads(bytes.fromhex(sys.argv[1])) if sys.argv[1:2] else pickle.dumps(params).hex())
"""
MINE = "import helpers\ndef grown(x, a):\n    return helpers.push(a * x)\n"


def test_an_edited_helper_never_gives_an_old_number(tmp_path):
    """In processes one after another: nothing is compiled in the second, all that was edited in the third."""
    env = {"PYTHONPATH": f"{Path.cwd()}:{tmp_path}", "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PATH": ""}

    def run(*arguments):
        command = [sys.executable, "-B", str(tmp_path / "script.py"), *arguments]
        answer = subprocess.run(command, env=env, capture_output=True, text=True, check=True, cwd=tmp_path)
        numbers, count, rest = answer.stdout.splitlines()
        return [float(number) for number in numbers.split()], int(count), rest

    (tmp_path / "script.py").write_text(SCRIPT)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "other.py").write_text("def grown(x, a):\n    return a * x - 5.0\n")
    (tmp_path / "helpers.py").write_text("def push(x):\n    return x + 1.0\n")
    numbers, count, pickled = run()
    assert (numbers, count > 0) == ([3.0, -3.0], True)
    assert run(pickled) == ([3.0, -3.0], 0, "grown(a=2.0)")
    push = "def push(x):\n    return x + {}\n"
    (tmp_path / "helpers.py").write_text(push.format(2.0))
    numbers, count, _ = run()
    assert (numbers, count > 0) == ([4.0, -3.0], True)
    # edited between import and use: what is kept under the new text is never the old code
    assert run(pickled, push.format(3.0))[0] == [4.0, -3.0]
    assert run()[0] == [5.0, -3.0]


def test_an_atlas_knows_the_file_of_the_functions():
    assert list(MapSubject(tent(), None).sources) == [__name__]
    assert importlib.import_module(__name__).left is left


# ----------------------------------------------------------------
# What is refused.


def nested():
    rate = 3.0

    def closed(x):
        return rate * x

    return closed


def two_defaults(x, slope=2.0):
    return slope * x


def worded(x, mode="fast"):
    return x


def late(x, a, y):
    return a * x, y


def many(x, y, z, w):
    return x, y, z, w


def starred(*x):
    return x


def keywords(x, *, a=1.0):
    return a * x


def underscored(x, _a=1.0):
    return _a * x


def compared(x):
    return x > 0.5


def listed(x, y):
    return [x, y]


def words(x, y):
    return x, "y"


def single(x):
    return (x,)


def misspelt(x):
    return xx  # noqa: F821


def taken(x, with_values=1.0):
    return with_values * x


REFUSED = {
    "many": (lambda: ls.map(many), "the coordinates of many is 'x, y, z, w'; allowed: one to three"),
    "none": (lambda: ls.map(helper, x=1.0), "the coordinates of helper is 'none'; allowed: one to three"),
    "without a value": (lambda: ls.map(henon), "the coordinates of henon is 'x, y, a, b'"),
    "a coordinate too many": (
        lambda: ls.map(henon, b=0.3),
        "what henon returns is 'a tuple of 2'; allowed: a tuple of 3 numbers, one for each of x, y, a",
    ),
    "a parameter before": (lambda: ls.map(late, a=1.0), "the parameter y of late is 'without a value'"),
    "unknown": (lambda: ls.map(henon, a=1.0, b=0.3, c=2.0), "a value is 'c=...'; allowed: values of a, b"),
    "unknown in with_values": (
        lambda: tent().with_values(a=1.0),
        "a value is 'a=...'; allowed: values of slope",
    ),
    "text": (lambda: ls.map(henon, a="1.4", b=0.3), "the value of a is '1.4'; allowed: a finite number"),
    "nan": (lambda: tent().with_values(slope=math.nan), "the value of slope is 'nan'"),
    "bool": (lambda: ls.map(henon, a=True, b=0.3), "the value of a is True"),
    "lambda": (lambda: ls.map(lambda x: x), "a function of the map is '<lambda>'"),
    "builtin": (lambda: ls.map(math.sin), "a function of the map is 'a builtin_function_or_method'"),
    "nothing": (lambda: ls.map(), "a function of the map is None"),
    "partial": (lambda: ls.map(functools.partial(helper)), "a function of the map is 'a partial'"),
    "closure": (lambda: ls.map(nested()), "give it rate as a parameter"),
    "starred": (lambda: ls.map(starred), "an argument of starred is '*x'"),
    "by keyword alone": (lambda: ls.map(keywords), "an argument of keywords is 'a=1.0'"),
    "underscore": (lambda: ls.map(underscored), "an argument of underscored is '_a'"),
    "name taken": (lambda: ls.map(taken), "an argument of taken is 'with_values'"),
    "comparison": (
        lambda: ls.map(compared),
        "what compared returns is False; allowed: a number; of a comparison a > b return the difference",
    ),
    "list": (lambda: ls.map(listed), "what listed returns is 'a list of 2'; allowed: a tuple of 2 numbers"),
    "words": (lambda: ls.map(words), "what words returns is 'y'"),
    "tuple of one": (lambda: ls.map(single), "what single returns is 'a tuple of 1'; allowed: one number"),
    "misspelt": (lambda: ls.map(misspelt), "NameError: name 'xx' is not defined"),
    "pieces alone": (lambda: ls.map(pieces=(left, right)), "the functions of a map of two branches"),
    "margin alone": (lambda: ls.map(helper, margin=beyond), "the functions of a map of two branches"),
    "a number as margin": (lambda: ls.map(pieces=(left, right), margin=0.5), "a function of the map is 0.5"),
    "three pieces": (
        lambda: ls.map(pieces=(left,) * 3, margin=beyond),
        "the functions of a map of two branches",
    ),
    "other coordinates": (
        lambda: ls.map(pieces=(left, henon), margin=beyond, a=1.0, b=1.0),
        "the coordinates of henon is 'x, y'; allowed: x, as of left",
    ),
    "other default": (
        lambda: ls.map(pieces=(left, two_defaults), margin=beyond),
        "the default of slope in two_defaults is 2.0; allowed: 1.8",
    ),
    "a default that is no number": (lambda: ls.map(worded), "the value of mode is 'fast'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_one_line(case):
    call, words = REFUSED[case]
    with pytest.raises(MapError) as error:
        call()
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def clipped(x):
    return x if x < 0.5 else 1.0 - x


def test_a_branch_within_a_function_is_sampled_and_not_enclosed():
    params, grid = ls.map(clipped), ls.grid([(0.0, 1.0)], cells=64)
    assert ls.transitions(params, grid).grid.n_cells == 64
    with pytest.raises(
        MapError, match=r"what clipped of clipped .* 'return x if x < 0.5 .*pieces=\(f, g\), margin=m"
    ):
        ls.transitions(params, grid, "boxes")
