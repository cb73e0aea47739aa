"""Interface and shared parts of the files of this room: answers, borders next to a decimal, backward reachability.

*Backward reachability*: cells all of whose images lie in the wanted cells are one throw away from them; cells all of
whose images lie in those or in the wanted cells are two throws away; and so on.  Every orbit from such a cell comes to
the wanted cells, whatever its course and whether or not the map is continuous.  With the edges from the cells wanted
taken away these are the cells from which neither a recurrent cell nor an exit can be reached, and the throws are the
longest path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Ints, Mask
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import BELOW, Attraction, no_cells
from limitsets.proofs.prover.basin import missing_near
from limitsets.proofs.prover.cover import everywhere, leading_to, targets
from limitsets.proofs.prover.goals.recurrent_orbits import Refutation
from limitsets.proofs.prover.goals.violating_orbits import State
from limitsets.systems.graph.components import ranks, reach, strong_components
from limitsets.systems.graph.ranges import RUN, Ranges, build


class Answer(NamedTuple):
    """The verdict on a goal; the words are those of `limitsets.proofs.prover.certifying.Claim`."""

    verdict: str
    reason: str = ""
    section: Mapping[str, Any] = {}
    counterexample: tuple[State, ...] = ()
    final: bool = False
    starts: Any = None
    shares: Mapping[str, float] = {}
    note: str = ""
    recurs: Mapping[str, Any] = {}


class Kind(NamedTuple):
    """One kind of goal.

    Attributes
    ----------
    prove : callable
        From an `Attraction`, the scene and the goal to an `Answer`, proved or undecided: of the attracting cells, or of
        every start where the goal says `from_anywhere`.
    refute : callable
        As `prove`, to an `Answer` that is refuted or undecided.
    sentence : callable
        From the section of a proved goal to a sentence about the attracting cells, or about every start.
    borders : callable
        From the goal to the borders of cells that it needs.
    almost : callable
        From the goal to whether it speaks of almost every orbit only.
    rechecked : bool
        Whether the checker knows the goal, so that a certificate of it can be written.
    """

    prove: Callable[[Attraction, Scene, Any], Answer]
    refute: Callable[[Attraction, Scene, Any], Answer]
    sentence: Callable[[Mapping[str, Any]], str]
    borders: Callable[[Any], Sequence[float]]
    almost: Callable[[Any], bool] = lambda _: False
    rechecked: bool = False


def undecided(reason: str, *, final: bool = False) -> Answer:
    """Answer that nothing is proved."""
    return Answer("undecided", reason, final=final)


def proved_unless(missing: str, section: Mapping[str, Any], *, final: bool = False) -> Answer:
    """Answer that the goal is proved, by the numbers of its section; undecided where something is missing."""
    return undecided(missing, final=final) if missing else Answer("proved", "", section)


def against(refutation: Refutation, reason: str = "") -> Answer:
    """Answer by a refutation, with the starts for which the goal fails; undecided if the refutation is empty."""
    if not refutation.of:
        return undecided(reason)
    states, of, recurs = refutation
    return Answer("refuted", reason, {}, states, starts=of, recurs=recurs)


def once(orbit: tuple[State, ...], reason: str = "") -> Answer:
    """Answer by one passage, which refutes a goal about every start on the arm; undecided without one."""
    return against(Refutation(orbit, "every", {"once": True}) if orbit else Refutation(), reason)


def common(attraction: Attraction, *, anywhere: bool) -> str:
    """Say which need of every goal is not proved: attracting cells, or that no start leaves; empty if all are."""
    if not anywhere:
        return no_cells(attraction.component)
    return BELOW if attraction.cover.points else missing_near(attraction.joint) or attraction.cover.leaving


def begins(section: Mapping[str, Any]) -> str:
    """Say where orbits begin in a goal about every start on the arm."""
    laid = isinstance(section.get("starts"), dict)
    return "where they are laid down" if laid else "anywhere on the arm"


def thrown_into(attraction: Attraction, bad: Mask) -> str:
    """Name a cell from which a throw may land in one of some cells; empty if there is none."""
    leading = (leading_to(ends, bad) for ends in everywhere(attraction.cover))
    return next((attraction.cover.place(int(cells.argmax())) for cells in leading if cells.any()), "")


def place_text(goal: Any, scene: Scene) -> str:
    """Write the x of a goal as a certificate has it: the scene's own words where it is the scene's own goal."""
    own = scene.text.get("goal", {}).get(goal.kind)
    if goal == scene.goal and own is not None:
        return " ".join(str(own["x"] if isinstance(own, Mapping) else own).split())
    return f"{goal.x!r} {scene.unit}"


def below(x: float) -> float:
    """Return a float that is not above the decimal that a certificate has for x, which x is next to."""
    return math.nextafter(x, -math.inf)


def above(x: float) -> float:
    """Return a float that is not below the decimal that a certificate has for x, which x is next to."""
    return math.nextafter(x, math.inf)


def throws_to_reach(
    attraction: Attraction, cells: Mask, wanted: Mask, branch: int | None = None
) -> tuple[int, Ints]:
    """Count the throws after which every orbit from the cells has come to those wanted.

    Parameters
    ----------
    attraction : Attraction
        Cells and images.
    cells : ndarray of bool, shape (n_cells,)
        Where orbits begin.
    wanted : ndarray of bool, shape (n_cells,)
        Where they have to come; a start there has arrived.
    branch : int, optional
        The branch to follow; a throw of another one has arrived.  Default: all.

    Returns
    -------
    int
        Throws, at most.
    ndarray of int64
        Cells from which it is not proved.
    """
    ranges = attraction.cover.graph.ranges if branch is None else _of_branch(attraction, branch)
    owner = np.repeat(np.arange(cells.size), np.diff(ranges.first))
    ranges = ranges._replace(box=ranges.box.copy())
    ranges.box[wanted[owner], RUN] = 0  # an orbit that has arrived is followed no farther
    parts = strong_components(ranges)
    stay = (parts.recurrent[parts.label] | (ranges.exits > 0)) & ~wanted
    late = reach(ranges, parts, stay.astype(np.uint8)) > 0
    steps = ranks(ranges, parts, np.zeros(parts.count, dtype=bool))
    throws = int(steps[cells & ~late].max(initial=0))
    # with one branch given, the last throw is one of another branch
    return throws + (0 if branch is None else 1), np.flatnonzero(cells & late)


def _of_branch(attraction: Attraction, branch: int) -> Ranges:
    """Target cells of one branch as ranges, with the exits of all."""
    grid, ends = attraction.cover.grid, targets(attraction.cover, branch)
    some = ends[:, 0] >= 0
    side = grid.side_of(ends[some, 0]).astype(np.int32)
    lo, hi = (((ends[some, k] - grid.offset[side])[:, None]).astype(np.int32) for k in (0, 1))
    first = np.concatenate([[0], np.cumsum(some)])
    return build(grid, first, side, lo, hi, attraction.cover.graph.ranges.exits)
