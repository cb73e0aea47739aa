"""The claim `policy-chances`: how many throws a table makes in the mean, and how likely parts come, under known laws.

docs/certificates.md, "Chances of a policy".  T is the number of throws made until the controller stops or hears an
answer after which no state is named, until the part is caught, or leaves the arm.  The number of throws left falls with
every throw, so that state by state from the last ones, with W the bound of what is to come where a part has landed,

    V_state = 1 + K W    (0 in place of 1 for the probability that the part comes),

K of the state's throw, as one step of `steps` bounds it from above; W is the largest V of the states that an answer
there may lead to.  Lower ends come from the bounds of -V.  Nothing here rests on what the policy is proved to do: what
its table leads to is counted, whatever the laws.
"""

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .balls import Array, Pair, prove
from .brackets import (
    OUTERMOST,
    Setting,
    bounds_of_laws,
    chain_on,
    kinds_of,
    mesh_of,
    places_in_words,
    read_laws,
    read_setting,
    require_edges,
    start_row,
)
from .file import Arrays, hex_float, require, rounded, rows, section_alone
from .horizon import mean_above, nothing
from .links import ABSORBED, LIVE
from .means import Mesh
from .policy import (
    NO_STATE,
    OF_GAME,
    STOP,
    Game,
    board_of,
    check_table,
    read_game,
    read_table,
    table_in_words,
)
from .steps import Chain

MEAN, COME = "mean", "come"
MOST_NUMBERS = 200_000_000  # nodes of the functions of all states: memory
CHAIN = "starts laws strata absorbing"


class PolicyChances(NamedTuple):
    """What is claimed: read, and not yet believed."""

    game: Game
    settings: list[Setting]  # of each throw: the same places and laws
    edges: list[Array]
    throw: Array
    left: Array
    after: Array
    bounds: dict[str, Pair]

    @property
    def work(self) -> int:
        """How many nodes are thrown from, and looked at, in all."""
        return len(self.settings) * sum(len(each) for each in self.edges)

    @property
    def raw(self) -> dict[str, Any]:
        """The scene as the file has it."""
        return self.game.raw

    @property
    def setting(self) -> Setting:
        """Laws and starts."""
        return self.settings[0]


def read_policy_chances(header: dict[str, Any], entries: dict[str, memoryview]) -> PolicyChances:
    """Read a file; raises BadFileError."""
    nothing = "a file of a policy's chances has no boxes, no other noise and no tolerance"
    keys = f"{OF_GAME} {CHAIN} {MEAN} {COME}"
    section = section_alone(header, "policy-chances", "a policy's chances", keys, nothing)
    game, settings = read_settings(section)
    arrays = Arrays(header["arrays"], entries)
    edges = [arrays.read(f"edges.{i}", "<f8") for i in range(len(settings[0].scene.sides))]
    require_edges(edges, settings[0])
    own = read_table(arrays, len(game.first))
    arrays.require_no_others()
    bounds = {}
    for word in (MEAN, COME):
        lo, hi = (hex_float(end, word) for end in rows(section[word], word, 2, 2))
        require(0.0 <= lo <= hi, f"{word}: the ends are negative, or do not ascend")
        bounds[word] = lo, hi
    return PolicyChances(game, settings, edges, *own, bounds)


def read_settings(section: dict[str, Any]) -> tuple[Game, list[Setting]]:
    """Read what is played, and the chain of each throw to choose from."""
    game = read_game(section, bounds_of_laws(read_laws(section["laws"])))
    require("effects" not in game.raw, "nothing is claimed of a scene with effects")
    own = {word: section[word] for word in CHAIN.split()}
    bare = [
        {k: v for k, v in each.scene.raw.items() if k not in ("cavity", "feedback")} for each in game.choices
    ]
    settings = [read_setting(own | {"scene": scene}) for scene in bare]
    require(not settings[0].absorbing, "the places where parts end are those of the policy")
    return game, settings


def policy_chances_in_words(c: PolicyChances) -> list[str]:
    """Put the claim in words, from the numbers that were checked."""
    come, mean = (c.bounds[word] for word in (COME, MEAN))
    there, lost = f"on side {c.game.side} at x >= {c.game.x}", "has left the arm"
    answer = "the controller hears an answer that leads to no state"
    ends, until = {
        "stop": (f"the controller stops while the part is {there}", f"the controller stops, the part {lost}"),
        "catch": (f"the part is caught {there}", f"the part is caught (at x >= {c.game.x}) or {lost}"),
    }[c.game.mode]
    return [
        f"policy-chances: T is the number of throws that the table of this file makes until {until}, or {answer}",
        "    all deviations are independent of each other, and of all answers given before them",
        f"    starts, equally likely per length: {places_in_words(c.setting.starts, c.setting.scene.unit)}",
        *(f"    {line}" for line in table_in_words(c.game, len(c.throw))),
        f"    P({ends}): between {rounded(come[0], up=False)} and {rounded(min(come[1], 1.0), up=True)}",
        f"    the mean of T: between {rounded(mean[0], up=False)} and {rounded(mean[1], up=True)}",
    ]


# ----------------------------------------------------------------
# The bounds, found anew.


class Places(NamedTuple):
    """Which cells, by their left nodes, may hold a part that has left the arm, that is caught, that is asked about."""

    off: Array
    right: Array  # at rest where it is wanted
    wrong: Array  # at rest elsewhere; in mode "catch" there beyond x, where it is caught too
    answers: list[Array]  # by answer: it may be heard


def places_of(c: PolicyChances, mesh: Mesh) -> Places:
    """Compare the cells with the places of sensor and goal, as exact numbers."""
    kinds, _ = kinds_of(c.setting, mesh)
    left = np.flatnonzero(kinds >= 0)
    side = np.searchsorted(mesh.first, left, side="right") - 1
    lower, upper = mesh.place[left], mesh.place[left + 1]
    x, on = c.game.at(c.game.x), side == c.game.side
    sure, may = (np.array([Fraction(end) >= x for end in ends.tolist()]) for ends in (lower, upper))
    rests, caught = kinds[left] != ABSORBED, c.game.mode == "catch"
    asked = rests & ~(sure & caught)

    def by_node(mask: Array) -> Array:
        whole = np.zeros(len(kinds), dtype=bool)
        whole[left[mask]] = True
        return whole

    return Places(
        by_node(kinds[left] != LIVE),
        by_node(rests & may & on),
        by_node(rests & (may & ~on if caught else ~(sure & on))),
        [by_node(asked & answer) for answer in board_of(c.game, side, lower, upper).answers],
    )


def largest(functions: list[tuple[Array, Array]]) -> Array:
    """Return the least function of nodes that is on each of some cells above the function that is named with them."""
    bounds = np.full(len(functions[0][0]), -np.inf)
    for cells, values in functions:
        at = np.flatnonzero(cells)
        for nodes in (at, at + 1):
            bounds[nodes] = np.maximum(bounds[nodes], values[nodes])
    return bounds


def bound_of(c: PolicyChances, chains: dict[int, Chain], places: Places, of: str, sign: float) -> Array:
    """Bound from above, times the sign, what is to come before the first answer."""
    zero = np.zeros(len(places.off))
    come = zero + sign * (of == COME)
    stopped, ended = zero, [(places.off, zero)]
    if c.game.mode == "catch":
        ended += [(places.right, come), (places.wrong, zero)]
    else:
        stopped = largest([(places.right, come), (places.wrong, zero)])
    value = {NO_STATE: zero}

    def heard(after: list[int]) -> Array:
        return largest(
            [*ended, *((answer, value[k]) for answer, k in zip(places.answers, after, strict=True))]
        )

    for state in np.argsort(c.left, kind="stable").tolist():
        throw = int(c.throw[state])
        if throw == STOP:
            value[state] = stopped
            continue
        chain = chains[throw]
        value[state] = chain.above(heard(c.after[state].tolist()), nothing(chain), sign * (of == MEAN))
        prove(bool(np.isfinite(value[state]).all()), f"state {state}: nothing is bounded")
    return heard(c.game.first)


def bounds_of_policy(c: PolicyChances, advance: Callable[[int], None]) -> dict[str, Pair]:
    """Bound the mean of T and the probability that a part comes, over the starts."""
    check_table(c.game, c.throw, c.left, c.after)
    stops = c.game.mode == "stop" or not (c.throw == STOP).any()
    prove(stops, "the table stops, where parts go on until they are caught")
    states, answers = np.nonzero((c.after != NO_STATE) & (c.throw != STOP)[:, None])
    falls = c.left[c.after[states, answers]] < c.left[states]
    prove(bool(falls.all()), "the number of throws left does not fall")
    mesh = mesh_of(c.edges, OUTERMOST * c.setting.noisy.far)
    require(len(c.throw) * len(mesh.place) <= MOST_NUMBERS, "too many states on too many cells")
    places, row = places_of(c, mesh), start_row(c.setting.starts, mesh)
    made = sorted(set(c.throw.tolist()) - {STOP})
    chains = {throw: chain_on(c.settings[throw], c.edges, advance)[0] for throw in made}
    bounds, most = {}, max((int(c.left[k]) for k in c.game.first if k != NO_STATE), default=0)
    for of in (MEAN, COME):
        low, high = (mean_above(row, bound_of(c, chains, places, of, sign)) for sign in (-1.0, 1.0))
        bounds[of] = max(0.0, -low), min(high, float(most) if of == MEAN else 1.0)
    return bounds


def check_policy_chances(c: PolicyChances, advance: Callable[[int], None]) -> None:
    """Check everything that is claimed."""
    for word, (low, high) in bounds_of_policy(c, advance).items():
        lo, hi = c.bounds[word]
        only = f"only {rounded(low, up=False)} to {rounded(high, up=True)} is proved"
        prove(lo <= low and high <= hi, f"{word}: {lo!r} to {hi!r} is claimed, {only}")
