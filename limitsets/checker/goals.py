"""The goals: what each asks of the attracting cells, or from anywhere on the arm.

docs/certificates.md, "Goals", and what `goal` rests on in "Goals, end points, orbits".
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from .balls import float_of, prove
from .bands import MOST_SAME_THROWS, throws_below
from .cells import grown, leading_into, targets_of
from .file import LENGTHS, Cells, one_length, require, rows, table, whole_number
from .near_hinge import check_everywhere, check_thinning, near_landing, not_arriving
from .scene import Scene
from .starts import (
    MOST_COUNTED,
    Starts,
    check_starts,
    explained_in_words,
    laid_down,
    read_starts,
    starts_in_words,
)

GOAL_KEYS = "x side every_orbit throws order jogs from_anywhere"
GOALS = {  # the kinds that are known, and the keys of their sections; from_anywhere may come with each
    "oriented_beyond": "kind x side",
    "reaches": "kind x side every_orbit throws",
    "attracts_all": "kind",
    "flip_order": "kind order jogs",
    "stays_on_arm": "kind",
}


def read_goal_claim(section: object, n_sides: int) -> dict[str, Any]:
    """Read the section of a goal, with the starts for which it is claimed."""
    starts = "starts thinning near_joint lost"
    known = table(section, "section of goal", "kind", f"{GOAL_KEYS} {starts}")
    own = {key: value for key, value in known.items() if key not in starts.split()}
    more = "from_anywhere throws" if own["kind"] == "oriented_beyond" else "from_anywhere"
    goal = read_goal(table(own, "section of goal", GOALS[own["kind"]], more), n_sides)
    return goal | {"starts": read_starts(known, goal, n_sides)}


def read_goal(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read a goal; its entry `all` is true if it is about throws from all cells, not from the attracting ones alone."""

    def count(value: object, most: int, what: str) -> int:
        return whole_number(value, 0, most - 1, f"goal.{what} is not a whole number as it should be")

    kind, anywhere = section["kind"], section.get("from_anywhere", False)
    require(isinstance(anywhere, bool), "goal.from_anywhere is neither true nor false")
    goal = {"kind": kind, "anywhere": anywhere, "all": anywhere or kind == "attracts_all"}
    if "x" in section:
        x = one_length(section["x"], "goal.x")
        goal |= {"x": x, "text": str(x), "side": count(section["side"], n_sides, "side")}
    if kind == "oriented_beyond":
        goal["throws"] = count(section.get("throws", 0), MOST_SAME_THROWS + 1, "throws")
        require(not (anywhere and goal["throws"]), "goal.throws are counted of attracting cells alone")
    if kind == "reaches":
        require(isinstance(section["every_orbit"], bool), "goal.every_orbit is neither true nor false")
        goal |= {
            "every": section["every_orbit"],
            "throws": count(section["throws"], MOST_COUNTED, "throws"),
        }
    if kind == "flip_order":
        order = [count(i, n_sides, "order") for i in rows(section["order"], "goal.order", 1, 64)]
        goal |= {"order": order, "jogs": count(section["jogs"], MOST_COUNTED, "jogs")}
    return goal


def goal_of_scene(scene: dict[str, Any], n_sides: int, *, checked: bool = False) -> dict[str, Any] | None:
    """Read a scene's own goal, in the form of a section; of an unknown one, which is not to be `checked`, the kind."""
    known = scene.get("goal")
    if known is None:
        return None
    kinds = [key for key in known if key != "from_anywhere"] if isinstance(known, dict) else []
    require(len(kinds) == 1, "scene.goal does not name one goal")
    kind, value = kinds[0], known[kinds[0]]
    if kind not in GOALS:
        require(not checked, "scene.goal: this checker does not know the kind of goal")
        return {"kind": kind, "all": False}
    section = {"kind": kind, "from_anywhere": known.get("from_anywhere", False)}
    if kind in ("oriented_beyond", "reaches"):
        more = "every_orbit" if kind == "reaches" else ""
        section |= table(value, f"scene.goal.{kind}", "x side", more)
        section |= {"every_orbit": section.get("every_orbit", False), "throws": 0} if more else {}
    elif kind == "flip_order":
        section |= {"order": value, "jogs": 0}
    else:
        require(value is True, f"scene.goal.{kind} is not true")
    return read_goal(section, n_sides)


def content_of_goal(goal: dict[str, Any]) -> tuple[Any, ...]:
    """Return what a goal asks, for comparison: kind, x in metres, side, and the rest."""
    x = goal["x"].lo if "x" in goal else None
    return goal["kind"], goal["all"], x, goal.get("side"), goal.get("every"), goal.get("order")


def check_goal(c: Cells, scene: Scene, goal: dict[str, Any]) -> None:
    """Check a goal by the integers, given that all images are what the certificate says."""
    if is_laid(goal):  # the goal is asked of what these starts can come to
        c = laid_down(c, scene, goal["starts"])
    if speaks_of_all(goal):
        check_everywhere(c, scene)
    check_starts(c, scene, goal, goal["starts"])
    check = CHECKS.get(goal["kind"])
    if check is not None:
        check(c, scene, goal)


def is_laid(goal: dict[str, Any]) -> bool:
    """Whether the goal is claimed for starts that are laid down in some ranges."""
    return goal["starts"].laid is not None


def speaks_of_all(goal: dict[str, Any]) -> bool:
    """Whether the goal is claimed for the throws from everywhere on the arm."""
    return bool(goal["anywhere"]) and goal["kind"] != "attracts_all" and not is_laid(goal)


def check_oriented(c: Cells, scene: Scene, goal: dict[str, Any]) -> None:
    """Check that no attracting cell, or no target of any cell, of another side reaches beyond x."""
    beyond = goal["x"].lo / LENGTHS[scene.unit]
    x = float_of(beyond, up=False)
    wrong = (c.side != goal["side"]) & (c.upper() > x)
    if not goal["anywhere"]:
        wrong &= c.component >= 0
        if goal["throws"] and wrong.any():
            throws_below(c, scene, wrong, x, goal["throws"])
            return
        c.prove_all(~wrong, f"an attracting cell of another side reaches beyond x = {float(beyond)!r}")
        return
    for what, q, _, most in c.targets(wrong.astype(np.int64), np.ones_like(wrong)):
        good = np.ones_like(wrong)
        good[q] = most == 0
        c.prove_all(good, f"{what} may end beyond x = {float(beyond)!r} on another side")
    for i, edges in enumerate(c.edges if not is_laid(goal) else ()):
        if i != goal["side"]:
            near = near_landing(scene.sides[i], scene.k_lo, scene.k_hi, float(edges[0]))
            prove(near <= x, f"side {i}, near the joint: a throw may end beyond x = {float(beyond)!r}")


def check_reaches(c: Cells, scene: Scene, goal: dict[str, Any]) -> None:
    """Check that orbits come to rest at x or beyond on the side, every one or almost every one."""
    least = float_of(goal["x"].lo / LENGTHS[scene.unit], up=True)
    wanted = (c.side == goal["side"]) & (c.lower() >= least)
    inside = c.component >= 0
    if goal["every"]:
        cells = c.rank >= 0 if goal["anywhere"] else inside
        late = not_arriving([c.jog, c.flip], cells, wanted, goal["throws"])
        c.prove_all(~late, f"{goal['throws']} throws are not proved to be enough")
    else:
        alike = np.zeros(len(inside), dtype=np.int32)
        check_thinning(c, scene, inside & ~wanted, goal["throws"], alike)


def check_one_component(c: Cells, _: Scene, __: dict[str, Any]) -> None:
    """Check that each attracting cell leads to every other through targets."""
    inside = c.component >= 0
    start = np.zeros(len(inside), dtype=bool)
    start[np.argmax(inside)] = True
    forward = grown(start, lambda known: targets_of([c.jog, c.flip], known & inside))
    backward = grown(start, lambda known: leading_into(c, known) & inside)
    c.prove_all(~inside | (forward & backward), "an attracting cell is not of one component with the first")


def check_flip_order(c: Cells, _: Scene, goal: dict[str, Any]) -> None:
    """Check that orbits from the attracting cells come to the sides in the order asked, again and again."""
    order, n, inside = goal["order"], len(c.edges), c.component >= 0
    if len(order) == 1 and not goal["anywhere"]:
        c.prove_all(~inside | (c.side == order[0]), "an attracting cell lies on another side")
        return
    follows = all((a + 1) % n == b for a, b in zip(order, order[1:] + order[:1], strict=True))
    right = len(order) == n and follows
    prove(right, "the order is not that in which flips lead from side to side")
    # one more than the jogs in a row: the throw after them is a flip, or there is none
    late = not_arriving([c.jog], inside, np.zeros(len(inside), dtype=bool), goal["jogs"] + 1)
    c.prove_all(~late, f"{goal['jogs'] + 1} jogs in a row are not excluded")


CHECKS: dict[str, Callable[[Cells, Scene, dict[str, Any]], None]] = {
    "oriented_beyond": check_oriented,
    "reaches": check_reaches,
    "attracts_all": check_one_component,
    "flip_order": check_flip_order,
}
"""What each goal asks of the cells; `stays_on_arm` says only that images lie in cells."""


def statement_of_goal(goal: dict[str, Any], noisy: bool) -> str:
    """Put a goal in words; its `starts` are those for which it is proved."""
    starts = goal["starts"]
    place = starts_in_words(starts, noisy)
    those = "the attracting cells" + (" to which starts laid down can come" if is_laid(goal) else "")
    into = f"; into the attracting cells comes, and there stays, {place}"
    if starts.only:
        place, into = "every start in the attracting cells", ""
    if goal["anywhere"]:
        into = ""
    here = place if goal["anywhere"] else f"every start in {those}"
    if goal["kind"] == "oriented_beyond":
        same = f"after {goal['throws']} throw{'s' * (goal['throws'] > 1)} with the same parameters in"
        cells = same if goal["throws"] else "in"
        after = "after every throw of an orbit from" if is_laid(goal) else "after a throw from"
        where = f"{after} {place}" if goal["anywhere"] else f"{cells} {those}"
        words = f"{where}, x > {goal['text']} implies side {goal['side']}{into}"
    elif goal["kind"] == "reaches":
        there = f"comes to rest on side {goal['side']} at x >= {goal['text']}"
        most = f"after {goal['throws']} throws at most where x is in the cells"
        almost = f"{place}{but_for_length_zero(starts, noisy)} {there}"
        words = f"{here} {there}, {most}{into}" if goal["every"] else almost
    elif goal["kind"] == "attracts_all":
        words = f"{place} enters one component of attracting cells, connected by its images, and stays in it"
    elif goal["kind"] == "flip_order":
        order = " ".join(map(str, goal["order"]))
        again = f"comes to lie on the sides in the order {order}, again and again"
        stays = f"stays on side {order}" if len(goal["order"]) == 1 else again
        words = f"from {here} the part {stays}{into}"
    else:
        words = f"from {place} no throw leads off the arm or to x <= a_i"
    return "\n".join([f"goal: {words}", *explained_in_words(starts)])


def but_for_length_zero(starts: Starts, noisy: bool) -> str:
    """Name the starts excepted from a goal of almost every orbit, unless the starts in words have them already."""
    if starts.thinning:
        return ""
    return ", but for starts of total length zero" + (", others for other throws" if noisy else "")
