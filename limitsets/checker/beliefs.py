"""The table of a policy: that every belief holds what may come next, and that the throws left fall.

docs/certificates.md, "Tables of a policy".  The table is checked by whole numbers.  It rests on images of cells,
which are checked in balls for every throw that is made (2 to 4).
"""

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb

from .balls import Array
from .cells import Crew, first_bad, tasks_of
from .file import Cells
from .model import FULL_TURN
from .policy import NO_STATE, STOP, Policy


class Board(NamedTuple):
    """Sets of cells: where each answer may come, where the part is wanted, and where it may be caught wrongly."""

    answers: list[Array]
    won: Array
    lost: Array


def board_of(policy: Policy) -> Board:
    """Compare the borders of the cells with the places of sensor and goal, as exact numbers."""
    c = policy.cells[0]
    x, on = policy.at(policy.x), c.side == policy.side
    won = on & reaching(c.lower(), x)
    lost = ~on & beyond(c.upper(), x) & (policy.mode == "catch")
    place, error = policy.sensor.place, policy.sensor.error
    if place is not None and error is not None:
        nearest, farthest = policy.at(place) - policy.at(error), policy.at(place) + policy.at(error)
        return Board([beyond(c.upper(), nearest), ~beyond(c.lower(), farthest)], won, lost)
    if policy.sensor.side is not None:
        asked = c.side == policy.sensor.side
        return Board([asked, ~asked], won, lost)
    return Board([np.ones(len(on), dtype=bool)], won, lost)


def beyond(values: Array, limit: Fraction) -> Array:
    """Tell which floats are above a rational number."""
    return np.array([Fraction(value) > limit for value in values.tolist()], dtype=bool)


def reaching(values: Array, limit: Fraction) -> Array:
    """Tell which floats are not below a rational number."""
    return np.array([Fraction(value) >= limit for value in values.tolist()], dtype=bool)


def check_policy(
    policy: Policy, workers: int, progress: Callable[[int, int], None] | None
) -> tuple[str, int]:
    """Check the table, and the images that it rests on; "" or the reason, and the number of boxes looked at."""
    bad = check_ranges(policy)
    if bad:
        return bad, 0
    board = board_of(policy)
    bad = check_begin(policy, board)
    if bad:
        return bad, 0
    made = [np.zeros(len(board.won), dtype=bool) for _ in policy.choices]
    for state in range(len(policy.throw)):
        bad = check_state(policy, board, state)
        if bad:
            return f"state {state}: {bad}", 0
        if policy.throw[state] != STOP:
            made[policy.throw[state]] |= mask_of(policy, state)
    return check_images(policy, made, workers, progress)


def check_ranges(policy: Policy) -> str:
    """Check that all numbers of states, throws and cells are those of one; "" or the reason."""
    n, states = len(policy.cells[0].side), len(policy.throw)
    sides = policy.choices[0].scene.sides
    if not all(arb(float(e[0])) > s.a for e, s in zip(policy.cells[0].edges, sides, strict=True)):
        return "the cells begin left of a: a part there has left the arm"
    state, first, last = policy.belief.T
    for good, what in (
        (
            ((policy.throw >= STOP) & (policy.throw < len(policy.choices))),
            "a throw is none of those to choose from",
        ),
        (((policy.after >= NO_STATE) & (policy.after < states)), "a next state is none"),
        (policy.left >= 0, "a number of throws left is negative"),
        ((state >= 0) & (state < states), "a belief is that of no state"),
        (np.diff(state) >= 0, "the beliefs are not in the order of the states"),
        ((first >= 0) & (first <= last) & (last < n), "a belief names cells that are none"),
        (np.array([NO_STATE <= k < states for k in policy.first]), "the state to begin in is none"),
    ):
        if not good.all():
            return what
    return ""


def mask_of(policy: Policy, state: int) -> Array:
    """Give the cells in which the part may lie in a state."""
    begin, end = np.searchsorted(policy.belief[:, 0], [state, state + 1])
    return spread(policy.belief[begin:end, 1:], len(policy.cells[0].side))


def spread(ranges: Array, n: int) -> Array:
    """Mark the cells of ranges."""
    steps = np.zeros(n + 1, dtype=np.int64)
    np.add.at(steps, ranges[:, 0], 1)
    np.add.at(steps, ranges[:, 1] + 1, -1)
    return np.asarray(np.cumsum(steps[:-1]) > 0)


def check_begin(policy: Policy, board: Board) -> str:
    """Check that the starts lie on the cells, and in the beliefs to begin with; "" or the reason."""
    c = policy.cells[0]
    begin = np.zeros(len(c.side), dtype=bool)
    for side, lo, hi in policy.starts:
        edges = c.edges[side]
        if not edges[0] <= lo <= hi <= edges[-1]:
            return f"the starts [{lo!r}, {hi!r}] on side {side} do not lie on the cells"
        inside = (c.upper() > lo) & (c.lower() < hi) if lo < hi else (c.upper() >= lo) & (c.lower() <= hi)
        begin |= (c.side == side) & inside
    if policy.mode == "catch" and (begin & beyond(c.upper(), policy.at(policy.x))).any():
        return "parts in some of the starts are caught at once"
    for answer, state in zip(board.answers, policy.first, strict=True):
        heard = begin & answer
        if heard.any() and (state == NO_STATE or (heard & ~mask_of(policy, state)).any()):
            return "the state to begin in does not hold all starts with its answer"
        if state != NO_STATE and policy.left[state] > policy.within:
            return f"more than {policy.within} throws may be needed"
    return ""


def check_state(policy: Policy, board: Board, state: int) -> str:
    """Check that a state stops in the goal region, or that its throw leads to states that hold what may be; "" or why.

    The number of throws left falls with every throw, so that no policy goes round for ever.
    """
    throw, belief = int(policy.throw[state]), mask_of(policy, state)
    if throw == STOP:
        known = policy.mode == "stop" and not (belief & ~board.won).any()
        return "" if known else "it stops where the part may lie off the goal region"
    c = policy.cells[throw]
    bad = check_targets(c, belief)
    if bad:
        return bad
    ranges = np.concatenate([each[belief & (each[:, 0] >= 0)] for each in (c.jog, c.flip)])
    image = spread(ranges, len(belief))
    if (image & board.lost).any():
        return "its throw may bring the part down on a wrong side"
    if policy.mode == "catch":
        image &= ~board.won
    if policy.left[state] < 1:
        return "it throws, and no throw is left"
    for answer, after in zip(board.answers, policy.after[state].tolist(), strict=True):
        heard = image & answer
        if heard.any() and (after == NO_STATE or (heard & ~mask_of(policy, after)).any()):
            return "the state after an answer does not hold all that may be"
        if after != NO_STATE and not policy.left[after] < policy.left[state]:
            return "the number of throws left does not fall"
    return ""


def check_targets(c: Cells, some: Array) -> str:
    """Check the brackets of the angle and the target cells of some cells; "" or the reason."""
    lo, hi = c.phi.T
    checks = [(~some | ((lo > 0) & (lo < hi) & (hi <= FULL_TURN)), "the bracket of phi is not one")]
    n_sides = len(c.edges)
    for array, target in ((c.jog, c.side), (c.flip, (c.side + 1) % n_sides)):
        first, last = array.T
        inside = (first >= c.start[target]) & (first <= last) & (last < c.start[target + 1])
        none = (first == -1) & (last == -1)
        checks.append((~some | inside | none, "its target cells are not those of one side"))
    return first_bad(c, checks)


def check_images(
    policy: Policy, made: list[Array], workers: int, progress: Callable[[int, int], None] | None
) -> tuple[str, int]:
    """Check decision, landing and image of every cell from which a throw is made; "" or why, and the boxes."""
    total = sum(int(some.sum()) for some in made)
    told = None if progress is None else (lambda done: progress(done, total))
    crew = Crew([each.scene.raw for each in policy.choices], policy.noise, workers, told)
    try:
        for k, some in enumerate(made):
            found = crew.run(
                list(tasks_of(policy.cells[k], policy.choices[k].scene, k, np.flatnonzero(some), None))
            )
            if found is not None:
                name = f"the throw {policy.choices[k].name}"
                return f"{name}, {policy.cells[k].name(found[0])}: {found[1].text}", crew.boxes
    finally:
        crew.close()
    return "", crew.boxes
