"""The board of a game: a scene's throws on cells, before a sensor is chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Mask
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene, require_rests
from limitsets.proofs.policies.game import Game, game_of, image_of
from limitsets.proofs.prover.attraction import components_of
from limitsets.proofs.prover.certifying import spelled_deviations
from limitsets.proofs.prover.cover import Cover, cover_on, cut_at
from limitsets.proofs.prover.parameters import ParameterBox, joined, parameter_box, scattered
from limitsets.systems.cells import CellSet, Domain, Grid, cell_ends, grid

Starts: TypeAlias = float | Mapping[int, tuple[float, float]] | None
Progress: TypeAlias = Callable[[str, int, int], None] | None

MODES = ("stop", "catch")


@dataclass(frozen=True, eq=False)
class Board:
    """Throws, cells, starts and the goal region of a scene.

    Attributes
    ----------
    scene : Scene
        The scene.
    covers : dict of str to Cover
        For every throw the cells and their proved images, noise included.
    goal : tuple of (float, int)
        The goal region: at x or beyond, on this side.
    mode : str
        "stop": the controller stops where it knows that the part is in the goal region; "catch": the part is caught
        as soon as it comes there, and beyond x on another side it is lost.
    noise : dict of str to str
        What differs at every throw.
    starts : CellSet
        Where the part may lie at first.
    starts_are : str
        How the caller named the starts.
    game : Game
        The game on the cells, as yet without a sensor.
    """

    scene: Scene
    covers: dict[str, Cover]
    goal: tuple[float, int]
    mode: str
    noise: dict[str, str]
    starts: CellSet
    starts_are: str
    game: Game

    @property
    def throws(self) -> dict[str, ParameterBox]:
        """The parameters of every throw, noise included."""
        return {name: cover.box for name, cover in self.covers.items()}


def _goal_of(scene: Scene, goal: tuple[float, int] | None, mode: str) -> tuple[float, int]:
    if goal is None:
        if not isinstance(scene.goal, OrientedBeyond | Reaches):
            kind = None if scene.goal is None else scene.goal.kind
            remedy = "add such a goal to the scene, or pass goal=(x, side)"
            raise AnswerError("the goal", kind, "one with x and side", remedy)
        goal = scene.goal.x, scene.goal.side
    x, side = goal
    if not (0 <= x < scene.arm_length and 0 <= side < len(scene.sides)):
        allowed = f"a place on the arm below {scene.arm_length:.9g} {scene.unit} and a side of the part"
        raise AnswerError("the goal", goal, allowed, "correct it")
    if mode == "catch" and scene.cavity is not None and x != scene.cavity.position:
        allowed = f"{scene.cavity.position:.9g} {scene.unit}, where the arm ends and the cavity begins"
        remedy = "parts are caught there: ask for this x, or move the cavity"
        raise AnswerError("the x from which parts are caught", x, allowed, remedy)
    return goal


def board_of(
    scene: Scene,
    mode: str,
    goal: tuple[float, int] | None,
    starts: Starts,
    cells: int,
    noise: Mapping[str, str] | None,
    cuts: Sequence[float],
    progress: Progress,
) -> Board:
    """Cut the arm into cells, and enclose where each throw leads from each of them; arguments as in `feedback`."""
    if mode not in MODES:
        raise AnswerError("the mode", mode, " or ".join(MODES), "correct the word")
    if scene.feedback is None:
        require_rests(scene)
        remedy = "add [[feedback.throws]] to the scene, each with name and kappa or speed"
        raise AnswerError("the throws to choose from", "none", "one at least", remedy)
    x, side = _goal_of(scene, goal, mode)
    noises = joined(spelled_deviations(scene, noise), spelled_deviations(scene, scattered(scene)))
    boxes = {
        each.name: parameter_box(scene.with_values({each.quantity: each.text}), noise=noises)
        for each in scene.feedback.throws
    }
    named: Mapping[int, Sequence[float]] = starts if isinstance(starts, Mapping) else {}
    cells_of = _cells(
        scene, boxes, cells, {x, *cuts, *([starts] if isinstance(starts, float) else [])}, named
    )
    on, lo, _ = cell_ends(cells_of)
    beyond = lo >= x
    target = beyond & (on == side)
    covers = {}
    for k, (name, box) in enumerate(boxes.items()):
        if progress is not None:
            progress(f"images of the throw {name}", k, len(boxes))
        covers[name] = cover_on(box, cells_of)
    images = {name: image_of(cover.graph) for name, cover in covers.items()}
    lost = beyond & ~target if mode == "catch" else None
    game = game_of(images, None, target, lost)
    begin, words = _starts(scene, cells_of, starts, noises)
    if lost is not None:
        begin &= ~beyond
    if not begin.any():
        raise AnswerError("the starts", words, "some that are not caught at once", "name others")
    return Board(
        scene,
        covers,
        (x, side),
        mode=mode,
        noise=noises,
        starts=CellSet(cells_of, begin),
        starts_are=words,
        game=game,
    )


def _cells(
    scene: Scene,
    boxes: Mapping[str, ParameterBox],
    cells: int,
    cuts: set[float],
    starts: Mapping[int, Sequence[float]],
) -> Grid:
    """Cut the arm into cells, with borders at the places that matter."""
    own = scene.domain
    end = min(float(box.bare[0].arm_length) for box in boxes.values())
    plain = grid(Domain(own.lo, np.full_like(own.hi, end), own.anchor), cells=cells, grading="uniform")
    return cut_at(plain, {side: [*cuts, *starts.get(side, ())] for side in range(plain.sides)})


def _starts(scene: Scene, cells: Grid, starts: Starts, noise: dict[str, str]) -> tuple[Mask, str]:
    """Give the cells of the starts, and the words for them."""
    mask = np.zeros(cells.n_cells, dtype=bool)
    if starts is None:
        component, _ = components_of(cover_on(parameter_box(scene, noise=noise), cells).graph)
        mask = component >= 0
        if not mask.any():
            remedy = "name the starts"
            raise AnswerError("the limit sets of the scene's own throw", "none on these cells", "one", remedy)
        return mask, "the limit sets of the scene's own throw"
    by_side: Mapping[int, tuple[float, float]]
    if isinstance(starts, Mapping):
        by_side, words = starts, "those named"
    else:
        x = float(starts)
        by_side = {side: (x, float(edges[-1])) for side, (edges,) in enumerate(cells.edges)}
        words = f"every start from x = {x:.9g} {scene.unit} on"
    for side, (lo, hi) in by_side.items():
        if not 0 <= side < cells.sides or not lo <= hi:
            raise AnswerError("the starts", dict(by_side), "side: (lowest x, highest x)", "correct them")
        (edges,) = cells.edges[side]
        if lo < edges[0] or hi > edges[-1]:
            allowed = f"from {edges[0]:.9g} to {edges[-1]:.9g} {scene.unit} on side {side}"
            raise AnswerError("the starts", (lo, hi), allowed, "name places where the part can rest")
        inside = (edges[1:] > lo) & (edges[:-1] < hi)
        mask[cells.of_side(side)] = inside if lo < hi else (edges[1:] >= lo) & (edges[:-1] <= hi)
    return mask, words
