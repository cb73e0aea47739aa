"""A policy for a sensor of one bit: how its file is read, what it says in words, and that its beliefs hold.

docs/certificates.md, "Policies" and "Arrays of a policy".
"""

import re
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import Array, about, prove
from .cells import Crew, bracketed, marked, targets_of, tasks_of, with_targets
from .file import (
    LENGTHS,
    Arrays,
    Cells,
    Quantity,
    hex_float,
    one_length,
    plain,
    quantity,
    read_side,
    require,
    rounded,
    rows,
    section_alone,
    table,
    whole_number,
)
from .scene import Scene, read_scene

STOP = NO_STATE = -1  # no throw; no state: the answer cannot come, or the part is caught
MOST_STATES = 100_000
MOST_CHOICES = 16  # throws to choose from
MODES = ("stop", "catch")
OF_GAME = "scene mode goal starts first"
IMAGES = (("jog", "<i4"), ("flip", "<i4"), ("phi", "<f8"))
NAME_OF_THROW = r"[^\x00-\x1f\x7f]{1,64}"


class Sensor(NamedTuple):
    """A question: about a side, or whether the part is beyond a place, told to within an error; both None: nothing."""

    side: int | None
    place: Quantity | None
    error: Quantity | None


class Choice(NamedTuple):
    """A throw to choose: its name, the quantity that is given, and the scene in which it is made."""

    name: str
    given: str
    scene: Scene


class Game(NamedTuple):
    """What is played, and the states to begin in."""

    raw: dict[str, Any]
    noise: object
    choices: list[Choice]
    sensor: Sensor
    mode: str
    x: Quantity
    side: int
    first: list[int]  # by answer the state to begin in

    def at(self, where: Quantity) -> Fraction:
        """Give a place in the unit of the arm's length."""
        return where.lo / LENGTHS[self.choices[0].scene.unit]


class Policy(NamedTuple):
    """The content of a file: read, and not yet believed."""

    game: Game
    starts: list[tuple[int, float, float]]
    within: int
    cells: list[Cells]  # of each throw: the same borders, other images
    throw: Array
    left: Array
    after: Array
    belief: Array  # state, first and last cell

    @property
    def raw(self) -> dict[str, Any]:
        """The scene as the file has it."""
        return self.game.raw


def read_policy(header: dict[str, Any], entries: dict[str, memoryview]) -> Policy:
    """Read a file; raises BadFileError."""
    nothing = "a policy has no boxes and no tolerance"
    section = section_alone(header, "policy", "a policy", f"{OF_GAME} within", nothing, noisy=True)
    game = read_game(section, header["noise"])
    within = whole_number(section["within"], 0, 10**17, "within is not a number of throws")
    n_sides, answers = len(game.choices[0].scene.sides), len(game.first)
    cells, own = read_arrays(header["arrays"], entries, len(game.choices), n_sides, answers)
    starts = [read_start(row, n_sides) for row in rows(section["starts"], "starts", 1, MOST_STATES)]
    return Policy(game, starts, within, cells, *own)


def read_game(section: dict[str, Any], noise: object) -> Game:
    """Read what is played: the throws to choose from, the question, where the part is wanted, and the beginning."""
    raw = section["scene"]
    require(isinstance(raw, dict) and "feedback" in raw, "the scene has no feedback")
    require("goal" not in raw, "the scene has a goal of its own")
    has = table(raw["feedback"], "feedback", "throws", "sensor")
    choices = [read_choice(each, raw, noise) for each in rows(has["throws"], "throws", 1, MOST_CHOICES)]
    require(len({each.name for each in choices}) == len(choices), "two throws have one name")
    n_sides = len(choices[0].scene.sides)
    sensor = read_sensor(has.get("sensor"), n_sides)
    goal = table(section["goal"], "goal of policy", "x side")
    x, side = one_length(goal["x"], "goal.x"), read_side(goal["side"], n_sides)
    mode = section["mode"]
    require(mode in MODES, "mode is neither stop nor catch")
    check_cavity(raw, mode, x)
    words = ["any"] if sensor.side is None and sensor.place is None else ["yes", "no"]
    begin = table(section["first"], "first", " ".join(words))
    first = [NO_STATE if begin[word] is None else begin[word] for word in words]
    require(all(type(k) is int for k in first), "first holds no number of a state")
    return Game(raw, noise, choices, sensor, mode, x, side, first)


def read_choice(value: object, raw: dict[str, Any], noise: object) -> Choice:
    """Read a throw: it stands in the place of the scene's own."""
    one = table(value, "a throw to choose", "name", "kappa speed")
    name = one["name"]
    require(isinstance(name, str) and re.fullmatch(NAME_OF_THROW, name) is not None, "a throw has no name")
    given = {key: text for key, text in one.items() if key != "name"}
    require(len(given) == 1, "a throw to choose: either kappa or speed")
    ((key, text),) = given.items()
    value = quantity(text, "length" if key == "kappa" else "speed", f"{plain(name)}.{key}")
    require(value.lo == value.hi, "a throw to choose is not one number")
    # no name reads like another throw of the list in which it is printed
    return Choice(
        re.sub("[:;=]", "?", plain(name)), f"{key} = {value}", read_scene({**raw, "throw": given}, noise)
    )


def read_sensor(value: object, n_sides: int) -> Sensor:
    """Read what is asked."""
    if value is None:
        return Sensor(None, None, None)
    asked = table(value, "sensor", "", "beyond error side")
    if "side" in asked:
        require(len(asked) == 1, "the sensor asks two questions, or a side has an error")
        return Sensor(read_side(asked["side"], n_sides), None, None)
    require("beyond" in asked, "the sensor asks nothing")
    place = one_length(asked["beyond"], "sensor.beyond")
    none = place._replace(lo=Fraction(0), hi=Fraction(0))
    error = one_length(asked["error"], "sensor.error") if "error" in asked else none
    require(error.lo >= 0, "the sensor's error is negative")
    return Sensor(None, place, error)


def check_cavity(raw: dict[str, Any], mode: str, x: Quantity) -> None:
    """Require that parts are caught where the scene has its cavity."""
    cavity = raw.get("cavity")
    if mode == "catch" and cavity is not None:
        require(isinstance(cavity, dict) and "position" in cavity, "the cavity has no position")
        at = one_length(cavity["position"], "cavity.position")
        require(at.lo == x.lo, "parts are caught elsewhere than where the cavity begins")


def read_start(value: object, n_sides: int) -> tuple[int, float, float]:
    """Read an interval of starts."""
    side, lo, hi = rows(value, "starts", 3, 3)
    ends = hex_float(lo, "starts"), hex_float(hi, "starts")
    require(ends[0] <= ends[1], "an interval of starts is empty")
    return read_side(side, n_sides), *ends


def read_arrays(
    said: object, entries: dict[str, memoryview], throws: int, n_sides: int, answers: int
) -> tuple[list[Cells], tuple[Array, Array, Array, Array]]:
    """Read the cells with the images under every throw, and the table."""
    arrays = Arrays(said, entries)
    array = arrays.read
    edges = [array(f"edges.{i}", "<f8") for i in range(n_sides)]
    require(all(len(e) >= 2 and bool((np.diff(e) > 0).all()) for e in edges), "the borders do not ascend")
    n = sum(len(e) - 1 for e in edges)
    cells = []
    for k in range(throws):
        jog, flip, phi = (array(f"{k}.{name}", dtype, 2) for name, dtype in IMAGES)
        require(len(jog) == len(flip) == len(phi) == n, "the images do not fit the cells")
        nothing = np.zeros(n, dtype=np.int64)
        cells.append(
            Cells(
                edges,
                jog.astype(np.int64),
                flip.astype(np.int64),
                branch=nothing,
                rank=nothing,
                component=nothing,
                phi=phi,
            )
        )
    own, belief = read_table(arrays, answers), array("belief", "<i4", 3)
    arrays.require_no_others()
    return cells, (*own, belief)


def read_table(arrays: Arrays, answers: int) -> tuple[Array, Array, Array]:
    """Read by state the throw, the throws left, and by answer the state after it."""
    throw, left = arrays.read("throw", "<i4"), arrays.read("left", "<i4")
    after = arrays.read("after", "<i4", answers)
    require(0 < len(throw) <= MOST_STATES, "there are no states, or too many")
    require(len(throw) == len(left) == len(after), "the table does not have one row for each state")
    return throw, left, after.reshape(len(throw), answers)


def policy_in_words(policy: Policy) -> list[str]:
    """Say what is claimed."""
    game = policy.game
    there = f"on side {game.side} at x >= {game.x}"
    ends = {
        "stop": f"is brought to lie {there}, and the controller, which stops then, knows it",
        "catch": f"comes to rest {there}, where it is caught, and nowhere before at x >= {game.x} on another side",
    }[game.mode]
    noisy = "for every sequence of throws, " if game.noise is not None else ""
    starts = "; ".join(
        f"side {side}: [{rounded(lo, up=True)}, {rounded(hi, up=False)}]"
        for side, lo, hi in policy.starts[:12]
    )
    caught = f" (those at x < {game.x}: the others are caught at once)" if game.mode == "catch" else ""
    more = " ..." if len(policy.starts) > 12 else ""
    return [
        f"policy: {noisy}from every start named the part {ends}, after {policy.within} throws at most (an upper bound)",
        f"starts{caught}: {starts}{more}",
        *table_in_words(game, len(policy.throw)),
    ]


def table_in_words(game: Game, states: int) -> list[str]:
    """Say what a table chooses from, what it asks, and how large it is."""
    return [
        "throws to choose from: " + "; ".join(f"{each.name}: {each.given}" for each in game.choices),
        f"asked before the first throw and after each: {question_in_words(game)}",
        f"states of the policy: {states}",
    ]


def question_in_words(game: Game) -> str:
    """Say what the sensor is asked, and how well it answers."""
    sensor = game.sensor
    if sensor.place is not None and sensor.error is not None:
        accuracy = (
            f", where it is farther from there than {sensor.error}; nearer any answer"
            if sensor.error.lo
            else ""
        )
        return f"is the part beyond {sensor.place}?{accuracy}"
    return "nothing" if sensor.side is None else f"does the part lie on side {sensor.side}?"


# ----------------------------------------------------------------
# The table of a policy: that every belief holds what may come next, and that the throws left fall.
#
# docs/certificates.md, "Tables of a policy".  The table is checked by whole numbers.  It rests on images of cells,
# which are checked in balls for every throw that is made (2 to 4).


class Board(NamedTuple):
    """Sets of cells: where each answer may come, where the part is wanted, and where it may be caught wrongly."""

    answers: list[Array]
    won: Array
    lost: Array


def board_of(game: Game, side: Array, lower: Array, upper: Array) -> Board:
    """Compare the borders of the cells with the places of sensor and goal, as exact numbers."""
    x, on = game.at(game.x), side == game.side
    won = on & np.array([Fraction(value) >= x for value in lower.tolist()], dtype=bool)
    lost = ~on & beyond(upper, x) & (game.mode == "catch")
    place, error = game.sensor.place, game.sensor.error
    if place is not None and error is not None:
        nearest, farthest = game.at(place) - game.at(error), game.at(place) + game.at(error)
        return Board([beyond(upper, nearest), ~beyond(lower, farthest)], won, lost)
    if game.sensor.side is not None:
        asked = side == game.sensor.side
        return Board([asked, ~asked], won, lost)
    return Board([np.ones(len(on), dtype=bool)], won, lost)


def beyond(values: Array, limit: Fraction) -> Array:
    """Tell which floats are above a rational number."""
    return np.array([Fraction(value) > limit for value in values.tolist()], dtype=bool)


def check_policy(policy: Policy) -> list[Array]:
    """Check the table; return by throw the cells from which it is made: the images that the table rests on."""
    check_ranges(policy)
    c = policy.cells[0]
    board = board_of(policy.game, c.side, c.lower(), c.upper())
    check_begin(policy, board)
    made = [np.zeros(len(board.won), dtype=bool) for _ in policy.game.choices]
    for state in range(len(policy.throw)):
        with about(f"state {state}"):
            check_state(policy, board, state)
        if policy.throw[state] != STOP:
            made[policy.throw[state]] |= mask_of(policy, state)
    return made


def check_ranges(policy: Policy) -> None:
    """Check that all numbers of states, throws and cells are those of one."""
    n, states = len(policy.cells[0].side), len(policy.throw)
    sides = policy.game.choices[0].scene.sides
    on = all(arb(float(e[0])) > s.a for e, s in zip(policy.cells[0].edges, sides, strict=True))
    prove(on, "the cells begin left of a: a part there has left the arm")
    check_table(policy.game, policy.throw, policy.left, policy.after)
    state, first, last = policy.belief.T
    for good, what in (
        ((state >= 0) & (state < states), "a belief is that of no state"),
        (np.diff(state) >= 0, "the beliefs are not in the order of the states"),
        ((first >= 0) & (first <= last) & (last < n), "a belief names cells that are none"),
    ):
        prove(bool(good.all()), what)


def check_table(game: Game, throw: Array, left: Array, after: Array) -> None:
    """Check that all numbers of states and throws are those of one."""
    states = len(throw)
    for good, what in (
        (((throw >= STOP) & (throw < len(game.choices))), "a throw is none of those to choose from"),
        (((after >= NO_STATE) & (after < states)), "a next state is none"),
        (left >= 0, "a number of throws left is negative"),
        (np.array([NO_STATE <= k < states for k in game.first]), "the state to begin in is none"),
    ):
        prove(bool(good.all()), what)


def mask_of(policy: Policy, state: int) -> Array:
    """Give the cells in which the part may lie in a state."""
    begin, end = np.searchsorted(policy.belief[:, 0], [state, state + 1])
    return marked(policy.belief[begin:end, 1:], len(policy.cells[0].side))


def holds_all(policy: Policy, state: int, heard: Array) -> bool:
    """Whether a state holds all cells that may be where its answer is heard."""
    return not heard.any() or (state != NO_STATE and not (heard & ~mask_of(policy, state)).any())


def check_begin(policy: Policy, board: Board) -> None:
    """Check that the starts lie on the cells, and in the beliefs to begin with."""
    c = policy.cells[0]
    begin = np.zeros(len(c.side), dtype=bool)
    for side, lo, hi in policy.starts:
        on = bool(c.edges[side][0] <= lo <= hi <= c.edges[side][-1])
        prove(on, f"the starts [{lo!r}, {hi!r}] on side {side} do not lie on the cells")
        inside = (c.upper() > lo) & (c.lower() < hi) if lo < hi else (c.upper() >= lo) & (c.lower() <= hi)
        begin |= (c.side == side) & inside
    caught = policy.game.mode == "catch" and (begin & beyond(c.upper(), policy.game.at(policy.game.x))).any()
    prove(not caught, "parts in some of the starts are caught at once")
    for answer, state in zip(board.answers, policy.game.first, strict=True):
        held = holds_all(policy, state, begin & answer)
        prove(held, "the state to begin in does not hold all starts with its answer")
        enough = state == NO_STATE or policy.left[state] <= policy.within
        prove(bool(enough), f"more than {policy.within} throws may be needed")


def check_state(policy: Policy, board: Board, state: int) -> None:
    """Check that a state stops in the goal region, or that its throw leads to states that hold what may be.

    The number of throws left falls with every throw, so that no policy goes round for ever.
    """
    throw, belief = int(policy.throw[state]), mask_of(policy, state)
    if throw == STOP:
        known = policy.game.mode == "stop" and not (belief & ~board.won).any()
        prove(known, "it stops where the part may lie off the goal region")
        return
    c = policy.cells[throw]
    c.prove_all(~belief | bracketed(c), "the bracket of phi is not one")
    for branch in (0, 1):
        inside, none = with_targets(c, branch)
        c.prove_all(~belief | inside | none, "its target cells are not those of one side")
    image = targets_of([c.jog, c.flip], belief)
    prove(not (image & board.lost).any(), "its throw may bring the part down on a wrong side")
    if policy.game.mode == "catch":
        image &= ~board.won
    prove(bool(policy.left[state] >= 1), "it throws, and no throw is left")
    for answer, after in zip(board.answers, policy.after[state].tolist(), strict=True):
        held = holds_all(policy, after, image & answer)
        prove(held, "the state after an answer does not hold all that may be")
        falls = after == NO_STATE or policy.left[after] < policy.left[state]
        prove(bool(falls), "the number of throws left does not fall")


def check_images(policy: Policy, number: int, made: Array, crew: Crew) -> None:
    """Check decision, landing and image of every cell from which one of the throws is made."""
    c, choice = policy.cells[number], policy.game.choices[number]
    tasks = tasks_of(c, choice.scene, number, np.flatnonzero(made), None)
    crew.run(lambda cell: f"the throw {choice.name}, {c.name(cell)}", tasks)
