"""What a beginner passes in the wrong place: every public function says which argument is wrong, and what to pass."""

import inspect
import math

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError, GridError, LimitsetsError, MapError, SceneError
from limitsets.parameters.margins.of_map import margins_of_map
from limitsets.parameters.margins.single import margin_scene
from limitsets.parameters.regions import evenly
from limitsets.proofs.prover.certifying import certify_scene
from limitsets.proofs.prover.of_map import certify_map
from limitsets.systems.graph import building as memory
from tests.maps_of_tests import Contraction
from tests.sweep.tasks_of_tests import of_map

SCENE = ls.load("paper-designed")
GRID = ls.grid(SCENE.domain, cells=64)
SQUARE = [(0, 1), (0, 1)]
LINE, MAP = ls.grid([(0.0, 1.0)], cells=64), maps.Logistic(3.5)
GRAPH = ls.transitions(SCENE.map, GRID)
FOUND = ls.attractors(GRAPH, throws=100)

WRONG = {
    "nothing": None,
    "text": "nonsense",
    "whole number": 3,
    "number": -0.5,
    "nan": math.nan,
    "empty list": [],
}
WRONG |= {"pair": (1, 2), "array": np.array([1.0, 2.0]), "object": object()}
WRONG |= {"scene": SCENE, "map": SCENE.map, "graph": GRAPH, "grid": GRID, "attractors": FOUND}

# Values of WRONG that an annotation lets pass, by the words in it.
FITS = {
    "None": {"nothing"},
    "str": {"text"},
    "Path": {"text"},
    "int": {"whole number"},
    "float": {"whole number", "number"},
    "Scene": {"scene"},
    "TransitionGraph": {"graph"},
    "Grid": {"grid"},
    "tuple[Attractor, ...]": {"attractors", "empty list"},
    "tuple[float, int]": {"pair"},
    "tuple[str, ...]": {"empty list"},
    "Sequence": {"empty list"},
    "Sequence[int]": {"empty list", "pair"},
    "Sequence[float]": {"empty list", "pair", "array"},
}

# What the annotation does not say: `Any`, and the words that stand for several kinds.
FITS_OF = {
    ("orbit", "x"): {"whole number", "number"},
    ("orbit", "params"): {"map"},
    ("transitions", "map"): {"map"},
    ("cycles", "within"): {"nothing"},
    ("critical_points", "params"): {"map"},
    ("critical_points", "domain"): set(),
    ("limit_set", "attractor"): {"nothing"},
    ("grid", "domain"): {"pair", "array"},
    ("grid", "cells"): {"whole number"},
    ("load", "source"): {"scene", "text"},
    ("atlas", "x"): {"text"},
    ("design", "critical_points"): {"empty list", "pair", "array"},
    ("atlas", "subject"): {"scene", "map", "text"},
    ("continuation", "path"): set(),
    ("plot.basins", "source"): {"scene", "map", "graph", "grid"},
    ("plot.basins", "found"): {"nothing", "attractors", "empty list"},
    ("plot.limit_set", "found"): {"attractors", "empty list"},
    ("plot.map", "found"): {"nothing", "attractors", "empty list"},
}

# Words in an annotation of which nothing is known here, so that only the parameters in FITS_OF are asked.
OPEN = ("Any", "Axis", "Curve", "GoalLike", "Bounds", "Starts", "Sensor", "Executor", "ArrayLike", "Sides", "Goal",
        "HasExtents", "Start", "Extents", "Axes", "type", "Throws", "Levels", "Points")  # fmt: skip

GOOD = dict.fromkeys(("scene", "scene2", "source", "subject"), SCENE)
GOOD |= {
    "graph": GRAPH,
    "found": FOUND,
    "map": SCENE.map,
    "params": SCENE.map,
    "grid": GRID,
    "domain": SCENE.domain,
}
GOOD |= {"x": 20.0, "side": 0, "count": 3, "up_to": 2, "shares": ls.basins(GRAPH, FOUND), "orbit": []}
GOOD |= {
    "critical_points": [10.0, 10.0, 20.0],
    "vary": ["throw.speed"],
    "variable": "class",
    "at": {"level": 1.0},
}
GOOD |= {"corners": [(0.0, 0.0)], "seat": np.zeros((3, 2)), "file": "none.gif", "throws": "none.csv"}
GOOD |= {"path": {"throw.speed": ("2 rad/s", "3 rad/s")}}


def _public():
    rooms = {"": ls, "plot.": ls.plot, "resilience.": ls.resilience, "engine.": ls.engine}
    for prefix, room in rooms.items():
        for name in room.__all__:
            function = getattr(room, name)
            if inspect.isfunction(function) and name not in ("scenes", "register"):
                # these ask their first argument whether a scene or a map is meant
                yield prefix + name, {"certify": certify_scene, "margin": margin_scene}.get(name, function)
    yield "certify_map", certify_map
    yield "margins_of_map", margins_of_map


def _words(annotation):
    tail = annotation.replace(" ", "")
    for mark in "[]|,":
        tail = tail.replace(mark, " ")
    return [word.rpartition(".")[2] for word in tail.split()]


def _fitting(name, parameter):
    """Names of the values that fit; None where neither the annotation nor the table above tells."""
    if (name, parameter.name) in FITS_OF:
        return FITS_OF[name, parameter.name]
    annotation = parameter.annotation
    if set(_words(annotation)) & set(OPEN):
        return None
    return set().union(*(FITS.get(part.strip(), set()) | FITS.get(part.partition("[")[0].strip(), set())
                         for part in annotation.split(" | ")))  # fmt: skip


CASES = [
    (name, function, parameter.name, fitting)
    for name, function in _public()
    for parameter in inspect.signature(function).parameters.values()
    if parameter.kind != inspect.Parameter.VAR_KEYWORD and (fitting := _fitting(name, parameter)) is not None
]


ANSWERS = ("found", "levels", "margin")


def _good(parameter):
    """Give a value that fits: of an answer that would take long, an empty one of its class."""
    if parameter.annotation.isidentifier() and parameter.name in ANSWERS:
        return type(parameter.annotation, (), {})()
    return "none" if parameter.annotation == "str | Path" else GOOD[parameter.name]


@pytest.mark.parametrize(
    ("name", "function", "asked", "fitting"), CASES, ids=[f"{name}-{asked}" for name, _, asked, _ in CASES]
)
def test_an_argument_of_the_wrong_kind_is_named(name, function, asked, fitting):
    parameters = inspect.signature(function).parameters
    required = [each for each in parameters.values() if each.default is inspect.Parameter.empty]
    for word, wrong in WRONG.items():
        if word in fitting:
            continue
        given = {
            each.name: _good(each)
            for each in required
            if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD) and each.name != asked
        }
        several = parameters[asked].kind == inspect.Parameter.VAR_POSITIONAL
        with pytest.raises(LimitsetsError) as error:
            function(*given.values(), wrong) if several else function(**{**given, asked: wrong})
        public = {"certify_map": "certify", "margins_of_map": "margin"}.get(name, name.rpartition(".")[2])
        named = (f"the argument {asked} of {public} is", "the source of a scene", *NAMED.get(asked, ()))
        assert any(words in str(error.value) for words in named), (word, str(error.value))
        assert error.value.allowed
        assert error.value.remedy
        assert f"help({public})" in error.value.remedy or "help(" not in error.value.remedy


# How an argument is named by a check that says more of it than its kind.
NAMED = {
    "params": ("the map is",),
    "map": ("the map is",),
    "subject": ("the map is", "the source of a scene"),
    "domain": ("the domain",),
    "cells": ("the number of cells",),
    "x": ("the start x", "the axis"),
    "within": ("the set to look in",),
    "path": ("the path",),
    "goal": ("the goal",),
    "source": ("what to draw", "the map is"),
    "found": ("what to draw",),
    "grid": ("the grid is",),
    "depth": ("the depth of the grid",),
    "grading": ("the grading",),
}


WRONG_PLACE = {
    GridError: [
        (lambda: ls.grid(SCENE), "the domain is 'Scene'.*pass its .domain"),
        (
            lambda: ls.grid([(-1, 1), (3, -3)]),
            r"domain along axis 1 is \(3.0, -3.0\); allowed: \(lo, hi\), finite and with lo < hi; swap them",
        ),
    ],
    SceneError: [
        (lambda: ls.design(maps.Logistic), "source of a scene is 'a map, Logistic'"),
        (lambda: ls.design(maps.Logistic(3.5)), "source of a scene is 'a map, Logistic'"),
        (lambda: evenly("mu", "0.1", "0.9", 4), "the quantity is 'mu'.*name one of these, a scene's$"),
    ],
    MapError: [
        (lambda: ls.transitions(SCENE, GRID), "the map is 'Scene'.*pass its .map"),
        (lambda: ls.orbit(SCENE.map, "8 in", 0, 3), "start x is '8 in'.*in the map's own unit"),
        (lambda: ls.certify(maps.Logistic, LINE), r"the class Logistic'.*pass Logistic\(r=\.\.\.\)"),
        (lambda: ls.transitions(maps.Logistic, LINE), r"the class Logistic'.*pass Logistic\(r=\.\.\.\)"),
        (lambda: ls.continuation(maps.Logistic, {"r": (3, 4)}), "the map is 'the class Logistic'"),
        (lambda: ls.explore(maps.Logistic, domain=[(0, 1)]), "the map is 'the class Logistic'"),
        (lambda: ls.orbit(maps.Logistic("3.5"), 0.1, 0, 3), "the field r of Logistic is '3.5'.*quotes"),
        (lambda: ls.transitions(maps.Logistic("3.5"), LINE), "the field r of Logistic is '3.5'.*quotes"),
        (lambda: ls.transitions(maps.Logistic(math.nan), LINE), "the field r of Logistic is nan"),
    ],
    AnswerError: [
        (
            lambda: ls.transitions(SCENE.map, SCENE.domain),
            "grid of transitions is 'a Domain'.*pass limitsets.grid",
        ),
        (lambda: ls.attractors(SCENE), "graph of attractors is 'a Scene'.*limitsets.transitions"),
        (lambda: ls.limit_set(GRAPH, FOUND), r"attractor of limit_set.*attractors\(graph\)\[0\]"),
        (lambda: ls.critical_points(SCENE.map, [(5, 28)]), "the domain.*pass scene.domain"),
        (lambda: ls.certify(Contraction()), "the grid is None.*limitsets.certify"),
        (lambda: ls.plot.flight(SCENE, 30.0, 0), "start x is 30.0.*at most 28 in"),
        (lambda: ls.attractors(GRAPH, throws=1e5), "pass throws=200000"),
        (
            lambda: ls.certify("paper-designed", "goal"),
            r"claims of certify is 'goal'.*; help\(certify\) says",
        ),
        (lambda: ls.certify(SCENE, GRID), "grid of certify is 'a Grid'; allowed: none beside a s"),
        (lambda: ls.certify(SCENE, ["goal"], ["goal"]), "grid of certify is 'a list of 1'"),
        (lambda: ls.certify(scene=SCENE, upper=3), "upper of certify is 3; .* scene has tolerance="),
        (lambda: ls.certify(MAP, LINE, noise={}), "noise of certify .*; allowed: none beside a map"),
        (lambda: ls.explore(maps.Henon(), domain=[(0, 1)]), "the domain is 1; allowed: 2, that of He"),
        (lambda: ls.atlas(MAP, "r=3:4:3", domain=SQUARE), "the domain is 2; allowed: 1, that"),
        (lambda: ls.continuation(MAP, {"r": (3, 4)}, domain=SQUARE), "the domain is 2; allowed: 1, that"),
        (lambda: ls.design("paper-designed"), "the critical points wanted is ''.*one per side"),
        (
            lambda: ls.atlas(
                maps.Henon(), "a=1:1.2:2", domain=SQUARE, task="limitsets.sweep.of_topology:topology"
            ),
            "a task of your own",
        ),
    ],
    LimitsetsError: [
        (
            lambda: ls.atlas(maps.Logistic(3.5), "r=3:3.2:2", task=of_map).certify(),
            "the argument grid of certify is None; allowed: cells, and no executor, of an atlas of a map",
        ),
    ],
}


@pytest.mark.parametrize(
    ("error", "asked", "said"), [(e, *row) for e, rows in WRONG_PLACE.items() for row in rows]
)
def test_a_scene_or_a_map_in_the_wrong_place_is_told_what_goes_there(error, asked, said):
    with pytest.raises(error, match=said):
        asked()


def test_what_certify_takes_is_shown_and_taken_by_name():
    names = "scene grid claims noise tolerance laid upper ends starts period progress"
    assert set(names.split()) == set(inspect.signature(ls.certify).parameters)
    assert ls.certify(scene="paper-designed", claims=["invariant"]).proved
    assert ls.certify(scene=maps.Logistic(2.5), grid=ls.grid([(0.1, 0.9)], cells=512), upper=None).proved


def test_a_missing_argument_is_named_by_python():
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'up_to'"):
        ls.cycles(GRAPH)


def test_every_public_function_holds_its_arguments_against_its_annotations():
    checked = {"checked", "with_bar"}
    for name, function in _public():
        seed = inspect.signature(function).parameters.get("seed")
        assert seed is None or seed.default == 0, name  # whatever draws draws the same unless it is told
        codes = set()
        while function is not None:
            codes.add(function.__code__.co_name)
            function = getattr(function, "__wrapped__", None)
        assert codes & checked or name in ("grid", "load", "map"), name


def test_a_large_graph_is_told_of_before_it_is_built(monkeypatch, capsys):
    cover = ls.grid([(0.0, 1.0)] * 3, cells=512)
    monkeypatch.setattr(memory, "_free_bytes", lambda: 10**12)
    memory.require_memory(cover, "corners-padded")
    said = capsys.readouterr().err
    assert "limitsets: the graph of 134217728 cells takes about 21 GB and" in said  # 155 bytes a cell
    memory.require_memory(ls.grid([(0.0, 1.0)] * 3, cells=64), "corners-padded")
    assert capsys.readouterr().err == ""


def test_of_a_limited_memory_there_is_what_is_not_in_use(monkeypatch, tmp_path):
    limit, used = tmp_path / "memory.max", tmp_path / "memory.current"
    limit.write_text("5000\n")
    used.write_text("2000\n")
    monkeypatch.setattr(memory, "LIMITS", ((limit, used), (tmp_path / "none", used)))
    assert memory._free_bytes() == 3000


def test_an_image_method_that_there_is_not():
    allowed = "boxes, corners, corners-padded, end-points"
    with pytest.raises(AnswerError, match=f"^the image method is 'random'; allowed: {allowed}; correct"):
        ls.transitions(MAP, LINE, "random")
