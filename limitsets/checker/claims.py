"""The claims of a file: how each is read, checked and put in words.

docs/certificates.md, "What is claimed", and the end of "Goals, end points, orbits" for what each claim rests on.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from .balls import UnprovedError, reason_of
from .cells import (
    Crew,
    UnprovedSlopeError,
    check_components,
    check_ranks,
    check_structure,
    extents,
    tasks_of,
)
from .end_points import check_ends, ends_statement, read_ends
from .entropy import ENTROPY_KEYS, entropy_in_words
from .feeding import FEEDS_KEYS, check_feeds, feeds_statement, read_feeds
from .file import Cells, hex_float, plain, read_sections, require, rounded, table
from .goals import GOALS, check_goal, read_goal_claim, speaks_of_all, statement_of_goal
from .near_hinge import check_below_cells, check_near_joint, fixed_points_in_words, read_near_hinge
from .observable import KEYS as OF_AVERAGES, Average, average_in_words
from .refutations import (
    check_orbits,
    check_refuted,
    orbits_statement,
    read_orbits,
    read_refutation,
    statement_of_refutation,
)
from .scene import Scene
from .throw_average import check_throw_average
from .throw_entropy import check_throw_entropy

Failed = dict[str, str]  # by claim the reason why it fails


def read_claims(value: object, n_sides: int) -> tuple[dict[str, dict[str, Any]], list[tuple[str, str, str]]]:
    """Read the claims that can be checked, name -> section, and those that cannot."""
    known: dict[str, dict[str, Any]] = {}
    unknown = []
    for name, section in read_sections(value).items():
        if name not in CLAIMS:
            unknown.append((plain(name), "not rechecked", "this checker does not know the claim"))
        elif section is None:
            unknown.append((name, "not rechecked", "the claim has no section"))
        elif name == "goal" and isinstance(section, dict) and section.get("kind") not in list(GOALS):
            unknown.append((name, "not rechecked", "this checker does not know the kind of goal"))
        else:
            kind = CLAIMS[name]
            if name != "goal":  # whose keys depend on its kind, see GOALS
                section = table(section, f"section of {name}", kind.keys, kind.more)
            known[name] = kind.read(section, n_sides)
    return known, unknown


def read_attracts_all(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the section of attracts-all."""
    q, fixed = read_near_hinge(section["near_joint"], n_sides)
    require(type(section["max_rank"]) is int, "max_rank is not an integer")
    return {"q": q, "fixed": fixed, "max_rank": section["max_rank"]}


def read_expanding(section: dict[str, Any], _: int) -> dict[str, Any]:
    """Read the section of expanding."""
    least = hex_float(section["least_slope"], "least_slope")
    require(least > 1, "least_slope is not above 1")
    return {"least": least}


def check_box_claims(
    scene: Scene, c: Cells, box: int, claims: dict[str, dict[str, Any]], crew: Crew
) -> Failed:
    """Check all claims for one box; return those that fail, with the first reason of each."""
    failed: Failed = {}
    if "refuted" in claims:
        failed |= failing(["refuted"], check_refuted, scene, claims["refuted"])
    if "feeds" in claims:
        failed |= failing(["feeds"], check_feeds, scene, c, box, claims["feeds"], crew)
    others = {name: section for name, section in claims.items() if name not in ("refuted", "feeds")}
    return failed | (check_cell_claims(scene, c, box, others, crew) if others else {})


def failing(names: Iterable[str], check: Callable[..., None], *more: Any) -> Failed:
    """Check what some claims need; if it fails, all of these fail for the same reason."""
    reason = reason_of(check, *more)
    return dict.fromkeys(names, reason) if reason else {}


def check_cell_claims(
    scene: Scene, c: Cells, box: int, claims: dict[str, dict[str, Any]], crew: Crew
) -> Failed:
    """Check the claims about cells: first by integers, then decision, images and slope of the cells concerned.

    Images are proved to lie strictly inside the union of their target cells (or at most at the arm's length), so that
    "invariant" gives "trapping".
    """
    failed = failing(claims, check_structure, c, scene) or failing(claims, check_components, c)
    if failed:
        return failed
    if "goal" in claims:
        failed |= failing(["goal"], check_goal, c, scene, claims["goal"])
    if "attracts-all" in claims:
        failed |= failing(["attracts-all"], check_attracts_all, c, scene, claims["attracts-all"])
    outside = {"goal", "attracts-all"} & set(claims) - set(failed)
    inside = np.flatnonzero(c.component >= 0)
    least = claims["expanding"]["least"] if "expanding" in claims else None
    images: Failed = {}
    try:
        crew.run(c.name, tasks_of(c, scene, box, inside, least))
    except UnprovedSlopeError as error:
        failed["expanding"] = str(error)
        images = failing(claims, crew.run, c.name, tasks_of(c, scene, box, inside, None))
    except UnprovedError as error:
        images = dict.fromkeys(claims, str(error))
    if images:
        return images | failed
    if "end-points" in claims:
        failed |= failing(["end-points"], check_ends, scene, c, claims["end-points"])
    if "cycles" in claims:
        failed |= failing(["cycles"], check_orbits, scene, c, claims["cycles"])
    if "average" in claims:
        failed |= failing(["average"], check_throw_average, scene, c, claims["average"]["read"])
    if "entropy" in claims:
        failed |= failing(["entropy"], check_throw_entropy, scene, c, claims["entropy"]["read"])
    # the cells with a rank, and those without one that some claims are about too
    wide = {name for name in outside if name != "goal" or speaks_of_all(claims["goal"])}
    for names, mask in ((outside, c.rank >= 0), (wide, c.rank < 0)):
        chosen = np.flatnonzero((c.component < 0) & mask)
        images = failing(names, crew.run, c.name, tasks_of(c, scene, box, chosen, None)) if names else {}
        if images:
            return images | failed
    return failed


def check_attracts_all(c: Cells, scene: Scene, section: dict[str, Any]) -> None:
    """Check ranks and the starts near the joint."""
    check_ranks(c, scene, section["max_rank"])
    for i, (q, said) in enumerate(zip(section["q"], section["fixed"], strict=True)):
        check_near_joint(c, scene, i, check_below_cells, q, said)


def attracts_all_statement(section: dict[str, Any], noisy: bool) -> str:
    """Put attracts-all in words."""
    if None not in section["fixed"]:
        return fixed_points_in_words(section, noisy)
    return (
        f"attracts-all: every start a_i < x <= arm.length on every side i enters the attracting cells and stays in"
        f" them, within {section['max_rank']} throws where x is in the cells; nearer to the joint x - a_i grows by"
        f" a factor of at least {rounded(min(section['q']), up=False)} with every throw"
    )


def expanding_statement(section: dict[str, Any], noisy: bool) -> str:
    """Put expanding in words."""
    least = section["least"]
    entropy = "" if noisy else f"; topological entropy >= ln({least!r}) >= {entropy_of(least)}"
    return f"expanding: |dR'/dR| >= {least!r} on the attracting cells{entropy}"


def average_statement(section: dict[str, Any], _: bool) -> str:
    """Put averages in words; where some of the attracting cells are left out the others are named by their places."""
    average: Average = section["read"]
    c: Cells = section["cells"]
    numbers = average.components()
    if numbers == np.unique(c.component[c.component >= 0]).tolist() and len(numbers) == 1:
        names = dict.fromkeys(numbers, "the attracting cells")
    else:
        names = {k: f"component {k} ({extents(c, c.component == k)})" for k in numbers}
    return f"average: {average_in_words(average, names, ['jog', 'flip'])}"


def entropy_of(least: float) -> str:
    """Write the logarithm of a slope, rounded down by more than its error."""
    return rounded(math.log(least) * (1 - 2.0**-40), up=False, digits=6)


class Kind(NamedTuple):
    """A claim that is known: the keys of its section and those that it may have, how it is read, and put in words."""

    keys: str
    read: Callable[[dict[str, Any], int], dict[str, Any]]
    statement: Callable[[dict[str, Any], bool], str]
    more: str = ""


INVARIANT = "invariant: no throw leaves the attracting cells, nor the component it starts in"
TRAPPING = "trapping: the attracting cells are mapped into their interior (relative to x <= arm.length)"
CLAIMS = {
    "attracts-all": Kind("near_joint max_rank", read_attracts_all, attracts_all_statement),
    "invariant": Kind("", lambda _, __: {}, lambda _, __: INVARIANT),
    "trapping": Kind("", lambda _, __: {}, lambda _, __: TRAPPING),
    "goal": Kind("kind", read_goal_claim, statement_of_goal),
    "expanding": Kind("least_slope", read_expanding, expanding_statement),
    "end-points": Kind("images ends pieces", read_ends, ends_statement),
    "cycles": Kind("cycles complete", read_orbits, lambda section, _: orbits_statement(section)),
    "average": Kind(OF_AVERAGES, lambda section, _: section, average_statement),
    "entropy": Kind(
        ENTROPY_KEYS,
        lambda section, _: section,
        lambda section, _: f"entropy: {entropy_in_words(section['read'])}",
    ),
    "refuted": Kind(
        "goal nominal tolerance",
        read_refutation,
        lambda section, _: statement_of_refutation(section),
        more="recurs start throws",
    ),
    "feeds": Kind("side", read_feeds, feeds_statement, more=FEEDS_KEYS),
}
"""The claims that are known."""
