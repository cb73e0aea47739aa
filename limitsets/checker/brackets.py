"""The claim `probabilities`: what it says, and the brackets of a noisy chain, found anew.

docs/certificates.md, "Probabilities", number 22.  The checker makes the steps itself, and its own brackets have to lie
within those claimed.
"""

import itertools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .absorption import (
    ANY,
    LEFT,
    OF_ABSORPTION,
    Absorption,
    absorption_in_words,
    check_absorption,
    read_absorption,
)
from .balls import Array, exact
from .file import (
    LENGTHS,
    Arrays,
    decimal,
    number_and_unit,
    plain,
    quantity,
    read_side,
    require,
    rows,
    section_alone,
    table,
    whole_number,
)
from .landings import Noisy
from .laws import SIGMAS, Law, normal_law, uniform_law
from .links import ABSORBED, HARD, LIVE, chain_of
from .means import Mesh, Rows, Spread, mean_rows
from .scene import NONE, Scene, read_scene
from .steps import Chain

# ----------------------------------------------------------------
# The claim `probabilities`, brackets of where a noisy chain ends, and when: how it is read, and put in words.
#
# docs/certificates.md, "Probabilities".  The file holds laws, starts, places that absorb, nodes and strata, and the
# brackets claimed.


# Landings are followed up to so many arms, more than shifts and scatter make of them; nodes end at so many of these.
ARMS, OUTERMOST = 8.0, 32.0
MOST_NODES, MOST_STRATA = 120_000, 64
UNIFORM, NORMAL = "uniform", "gaussian"
KINDS_OF_NOISE = {"throw.speed": "share", "landing.x": "length"}
# Parts of a normal law, and finer strata in each: throws are enclosed at the ends of parts of the speed.
NORMAL_SPEED, FINE, NORMAL_LANDING, FINE_LANDING = 96, 4, 24, 8
Place = tuple[int, Fraction, Fraction]  # side, from x, to x


class Setting(NamedTuple):
    """The chain that is spoken of: laws, scene, starts and places that absorb; lengths in the scene's unit."""

    laws: dict[str, tuple[str, str]]
    scene: Scene
    noisy: Noisy
    starts: list[Place]
    absorbing: dict[str, list[Place]]


class Chances(NamedTuple):
    """What is claimed: read, and not yet believed."""

    setting: Setting
    edges: list[Array]
    absorption: Absorption

    @property
    def work(self) -> int:
        """How many nodes are thrown from, and looked at, in all."""
        return (1 + len(self.absorption.within)) * sum(len(each) for each in self.edges)

    @property
    def raw(self) -> dict[str, Any]:
        """The scene as the file has it."""
        return self.setting.scene.raw


def read_chances(header: dict[str, Any], entries: dict[str, memoryview]) -> Chances:
    """Read a file; raises BadFileError."""
    keys = f"scene laws starts absorbing strata {OF_ABSORPTION}"
    nothing = "a file of probabilities has no boxes, no other noise and no tolerance"
    section = section_alone(header, "probabilities", "probabilities", keys, nothing, optional="ever")
    setting = read_setting(section)
    arrays = Arrays(header["arrays"], entries)
    edges = [arrays.read(f"edges.{i}", "<f8") for i in range(len(setting.scene.sides))]
    require_edges(edges, setting)
    absorption = read_absorption(section, arrays, "", setting.absorbing, sum(len(each) + 2 for each in edges))
    arrays.require_no_others()
    return Chances(setting, edges, absorption)


def read_setting(section: dict[str, Any]) -> Setting:
    """Read the chain of a section; raises BadFileError."""
    laws = read_laws(section["laws"])
    scene = read_scene(section["scene"], bounds_of_laws(laws))
    require(
        all(side.concave for side in scene.sides), "kappa > ell is not given: the impact may not be unique"
    )
    require(scene.arm[0] == scene.arm[1] and not scene.cuts(), "a quantity of the scene is an interval")
    require(scene.end is None, "the scene has a cavity, which the claim leaves out")
    still = read_scene({k: v for k, v in scene.raw.items() if k != "effects"}, None)
    strata = whole_number(section["strata"], 1, MOST_STRATA, f"strata is not from 1 to {MOST_STRATA}")
    speed = law_of(laws, "throw.speed", Fraction(1), (strata, NORMAL_SPEED, FINE))
    landing = law_of(laws, "landing.x", LENGTHS[scene.unit], (1, NORMAL_LANDING, FINE_LANDING))
    # far nodes hold where throws land at all, and what is not followed lies off the arm on both branches
    far = ARMS * 2.0 ** math.ceil(math.log2(scene.arm[0]))
    near = all(bool(abs(side.shift) < far / 2) for side in scene.sides)
    require(near and landing.reach < far, "landings are too far out")
    require(speed.reach < 1, "noise reaches 100 %")
    noisy = Noisy(still.sides, still.k_lo.union(still.k_hi), speed, landing, far)
    places = {
        plain(name): read_places(some, name, scene)
        for name, some in table_of(section["absorbing"], "absorbing").items()
    }
    require(not {ANY, LEFT} & set(places), f"{ANY} and {LEFT} name no places")
    require(not overlapping(places), "two places that absorb overlap")
    starts = read_places(section["starts"], "starts", scene)
    require(not overlapping({"starts": starts}), "two stretches of starts overlap: they would count twice")
    return Setting(laws, scene, noisy, starts, places)


def table_of(value: object, where: str) -> dict[str, Any]:
    """Read an object whose keys are names."""
    known = table(value, where, "", " ".join(value) if isinstance(value, dict) else "")
    require(len(known) <= 100 and all(k and plain(k) == k for k in known), f"{where}: an odd name")
    return known


def read_laws(value: object) -> dict[str, tuple[str, str]]:
    """Read the laws, each uniform within a bound or normal with a standard deviation: its kind and this number."""
    laws = {}
    for name, law in table(value, "laws", "", " ".join(KINDS_OF_NOISE)).items():
        kind = table(law, f"law of {name}", "", " ".join(law) if isinstance(law, dict) else "")
        known = len(kind) == 1 and set(kind) <= {UNIFORM, NORMAL}
        require(known, f"law of {name}: this checker knows {UNIFORM} and {NORMAL} laws only")
        ((word, text),) = kind.items()
        require(isinstance(text, str), f"law of {name}: its number is not a text")
        laws[name] = (word, text)
    return laws


def bounds_of_laws(laws: dict[str, tuple[str, str]]) -> dict[str, str] | None:
    """Return the bounds within which the laws deviate, as a file states noise: normal ones are cut off."""
    bounds = {}
    for name, (word, text) in laws.items():
        number, unit = number_and_unit(text, KINDS_OF_NOISE[name], f"law of {name}")
        most = f"{decimal(100 * SIGMAS * number)} %" if unit == "%" else f"{decimal(SIGMAS * number)} m"
        bounds[name] = text if word == UNIFORM else most
    return bounds or None


def law_of(laws: dict[str, tuple[str, str]], name: str, unit: Fraction, strata: tuple[int, int, int]) -> Law:
    """Cut a law in strata: their number for a uniform law, and for a normal one that of its parts and finer ones."""
    word, text = laws.get(name, (UNIFORM, ""))
    size = quantity(text, KINDS_OF_NOISE[name], name) if text else NONE
    require(size.lo == size.hi >= 0, f"law of {name}: its number is negative, or an interval")
    if word == UNIFORM:
        return uniform_law(size.lo / unit, strata[0])
    return normal_law(size.lo / unit, *strata[1:])


def read_places(value: object, where: str, scene: Scene) -> list[Place]:
    """Read places: side, from x, to x; null for the end of the arm."""
    places: list[Place] = []
    where = plain(where)
    for row in rows(value, where, 1, 1000):
        number, lo, hi = rows(row, where, 3, 3)
        side = read_side(number, len(scene.sides))
        first = length_of(lo, where, scene)
        last = scene.arm[0] if hi is None else length_of(hi, where, scene)
        on = first < last <= scene.arm[0] and bool(exact(first) > scene.sides[side].a)
        require(on, f"{where}: a place is not one of the arm")
        places.append((side, first, last))
    return places


def length_of(value: object, where: str, scene: Scene) -> Fraction:
    """Read a length in the scene's unit."""
    q = quantity(value, "length", where)
    require(q.lo == q.hi, f"{where}: an interval is no place")
    return q.lo / LENGTHS[scene.unit]


def overlapping(places: dict[str, list[Place]]) -> bool:
    """Whether two of the places have inner points in common."""
    every = sorted(place for some in places.values() for place in some)
    return any(a[0] == b[0] and b[1] < a[2] for a, b in itertools.pairwise(every))


def require_edges(edges: list[Array], setting: Setting) -> None:
    """Require that the nodes of each side ascend, and reach from before the joint to beyond the arm's end."""
    scene, most = setting.scene, setting.noisy.far / 2
    require(sum(len(e) for e in edges) <= MOST_NODES, f"more than {MOST_NODES} nodes")
    for i, e in enumerate(edges):
        require(len(e) >= 2 and bool((np.diff(e) > 0).all()), f"side {i}: the nodes do not ascend")
        whole = bool(arb(float(e[0])) <= scene.sides[i].a) and Fraction(float(e[-1])) >= scene.arm[0]
        require(whole and float(np.abs(e).max()) < most, f"side {i}: the nodes do not span the arm")


def chances_in_words(c: Chances) -> list[str]:
    """Put the claim in words, from the numbers that were checked."""
    unit = c.setting.scene.unit
    return [
        "probabilities: T is the throw with which a part first comes to rest at a place named below, or leaves the arm",
        "    all deviations are independent of each other",
        f"    starts, equally likely per length: {places_in_words(c.setting.starts, unit)}",
        *(f"    {name}: {places_in_words(places, unit)}" for name, places in c.setting.absorbing.items()),
        *absorption_in_words(c.absorption, "throw"),
    ]


def places_in_words(places: list[Place], unit: str) -> str:
    """Name places."""
    return ", ".join(f"side {side} from {float(lo)!r} to {float(hi)!r} {unit}" for side, lo, hi in places)


# ----------------------------------------------------------------
# The brackets of a noisy chain, found anew.


def mesh_of(edges: list[Array], outermost: float) -> Mesh:
    """Put the nodes of all sides together, with one far out at either end."""
    whole = [np.concatenate([[-outermost], each, [outermost]]) for each in edges]
    return Mesh(np.concatenate(whole), np.concatenate([[0], np.cumsum([len(each) for each in whole])]))


def kinds_of(c: Setting, mesh: Mesh) -> tuple[Array, dict[str, Array]]:
    """Find what each cell is, exactly, and by name the nodes of the cells that absorb, or may do so in part."""
    kinds = np.full(len(mesh.place), -1)
    absorbed: dict[str, set[int]] = {name: set() for name in (LEFT, *c.absorbing)}
    for i, side in enumerate(c.scene.sides):
        own = [(name, place) for name, some in c.absorbing.items() for place in some if place[0] == i]
        for cell in range(int(mesh.first[i]), int(mesh.first[i + 1]) - 1):
            lo, hi = float(mesh.place[cell]), float(mesh.place[cell + 1])
            a, b = Fraction(lo), Fraction(hi)
            met = {name for name, (_, begin, end) in own if a < end and begin < b}
            inside = any(begin <= a and b <= end for _, (_, begin, end) in own)
            if bool(arb(hi) <= side.a) or a >= c.scene.arm[0]:
                kinds[cell], met = ABSORBED, {LEFT}
            elif not (bool(arb(lo) > side.a) and b <= c.scene.arm[0]):
                kinds[cell], met = HARD, met | {LEFT}
            else:
                kinds[cell] = ABSORBED if inside else HARD if met else LIVE
            for name in met:
                absorbed[name] |= {cell, cell + 1}
    return kinds, {name: np.array(sorted(nodes), dtype=np.int64) for name, nodes in absorbed.items()}


def start_row(starts: list[Place], mesh: Mesh) -> Rows:
    """Build the row that makes the mean over the starts, which are equally likely per length."""
    side, lo, hi = (np.array(column) for column in zip(*starts, strict=True))
    length = hi - lo
    weight = (length / length.sum()).astype(float)
    row = np.zeros(len(side), dtype=np.int64)
    spread = Spread(row, weight, side.astype(np.int64), lo.astype(float), hi.astype(float))
    rows = mean_rows(1, mesh, [spread])
    # the ends of the starts are rounded
    return rows._replace(off=rows.off + 2.0**-50 * mesh.size() / float(length.min()))


def chain_on(c: Setting, edges: list[Array], advance: Callable[[int], None]) -> tuple[Chain, Rows]:
    """Prove the throws of a chain on some cells; with the row that makes means over its starts."""
    mesh = mesh_of(edges, OUTERMOST * c.noisy.far)
    return chain_of(c.noisy, mesh, *kinds_of(c, mesh), advance), start_row(c.starts, mesh)


def check_chances(c: Chances, advance: Callable[[int], None]) -> None:
    """Check everything that is claimed."""
    chain, row = chain_on(c.setting, c.edges, advance)
    check_absorption(chain, row, c.absorption, "throw", lambda: advance(sum(len(each) for each in c.edges)))
