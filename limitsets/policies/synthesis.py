"""One bit of feedback: which throw on which answer brings the part to a wanted side and place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from limitsets.cells import CellSet, Domain, Grid, grid
from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.graph.condensation import attracting_of
from limitsets.graph.transitions import transitions
from limitsets.policies.cell_images import image_of, scattered
from limitsets.policies.game import Game, Image, Mask, game_of
from limitsets.policies.search import SOLVED, Found, search
from limitsets.proofs.parameters import ParameterBox, parameter_box
from limitsets.proofs.simulated import joined
from limitsets.proofs.simulated import scattered as scatter_of
from limitsets.scene import Scene, load
from limitsets.scene.sensing import BeyondSensor, Sensor

__all__ = ["MODES", "Starts", "Synthesis", "feedback", "places"]

Starts: TypeAlias = float | Mapping[int, tuple[float, float]] | None
Progress: TypeAlias = Callable[[str, int, int], None] | None

MODES = ("stop", "catch")


@dataclass(frozen=True, eq=False)
class Synthesis:
    """What one bit of feedback was found to do.

    Attributes
    ----------
    scene : Scene
        The scene.
    throws : dict of str to ParameterBox
        The parameters of every throw, noise included.
    sensor : Sensor or None
        What is asked; None: nothing.
    mode : str
        "stop": the controller stops where it knows that the part is in the goal region; "catch": the part is caught
        as soon as it comes there, and beyond x on another side it is lost.
    goal : tuple of (float, int)
        The goal region: at x or beyond, on this side.
    starts : CellSet
        Where the part may lie at first.
    starts_are : str
        How they were named.
    noise : dict of str to str
        What differs at every throw.
    game : Game
        The game on the cells.
    found : Found
        How the search ended.
    """

    scene: Scene
    throws: dict[str, ParameterBox]
    sensor: Sensor | None
    mode: str
    goal: tuple[float, int]
    starts: CellSet
    starts_are: str
    noise: dict[str, str]
    game: Game
    found: Found

    @property
    def solved(self) -> bool:
        """Whether there is a policy."""
        return self.found.verdict == SOLVED

    @property
    def grid(self) -> Grid:
        """The cells."""
        return self.starts.grid

    @property
    def question(self) -> str:
        """What the sensor is asked, a clause."""
        return "nothing is asked" if self.sensor is None else self.sensor.question(self.scene.unit)

    def beliefs(self) -> list[dict[int, list[tuple[float, float]]]]:
        """Give per state of the policy where the part may lie: intervals by side [length]."""
        policy = self.found.policy
        return [] if policy is None else [CellSet(self.grid, mask).extents() for mask in policy.belief]

    def to_json(self) -> dict[str, Any]:
        """Give its tables for JSON."""
        policy = None
        if self.found.policy is not None:
            policy = self.found.policy.to_json()
            for state, belief in zip(policy["states"], self.beliefs(), strict=True):
                state["belief"] = as_table(belief=belief)["belief"]
        return as_table(
            scene=self.scene.as_dict(),
            unit=self.scene.unit,
            throws=[
                {"name": name, "kappa": [box.bare[0].kappa, box.bare[1].kappa]}
                for name, box in self.throws.items()
            ],
            sensor=self.sensor,
            question=self.question,
            mode=self.mode,
            goal={"x": self.goal[0], "side": self.goal[1]},
            starts={"are": self.starts_are, "extents": self.starts.extents()},
            noise=self.noise,
            cells=self.grid.n_cells,
            verdict=self.found.verdict,
            within=self.found.throws,
            policy=policy,
            beliefs=self.found.beliefs,
            seconds=self.found.seconds,
            reason=self.found.reason,
        )


@dataclass(frozen=True, eq=False)
class _Board:
    """A scene's throws on cells, before a sensor is chosen."""

    scene: Scene
    throws: dict[str, ParameterBox]
    goal: tuple[float, int]
    mode: str
    noise: dict[str, str]
    starts: CellSet
    starts_are: str
    game: Game

    def play(
        self, sensor: Sensor | None, throws: int, seconds: float, beliefs: int, progress: Progress
    ) -> Synthesis:
        grid = self.starts.grid
        game = self.game.asking(None if sensor is None else sensor.answers(grid))
        found = search(game, self.starts.mask, throws, seconds=seconds, beliefs=beliefs, progress=progress)
        return Synthesis(
            self.scene,
            self.throws,
            sensor,
            self.mode,
            self.goal,
            self.starts,
            self.starts_are,
            self.noise,
            game,
            found,
        )


def feedback(
    scene: Scene | str,
    sensor: Sensor | str | None = None,
    *,
    mode: str = "stop",
    goal: tuple[float, int] | None = None,
    starts: Starts = None,
    throws: int = 30,
    cells: int = 1024,
    noise: Mapping[str, str] | None = None,
    seconds: float = 60.0,
    beliefs: int = 400_000,
    progress: Progress = None,
) -> Synthesis:
    """Look for a policy: which throw on which answer of a sensor of one bit.

    The sensor is read whenever the part lies at rest, before the first throw too.  A policy holds for every start in
    the cells named and every sequence of the noise.

    Parameters
    ----------
    scene : Scene or str
        A scene with the table ``[feedback]``.
    sensor : Sensor or "none", optional
        Instead of the scene's; "none" asks nothing.
    mode : {"stop", "catch"}
        "stop": the controller stops where it knows that the part is in the goal region.  "catch": a part that comes to
        rest at the goal's x or beyond falls in; on another side than the goal's it is lost.
    goal : (float, int), optional
        x and side of the goal region [length]; default those of the scene's goal.
    starts : float or mapping of int to (float, float), optional
        Every start from this x on, or from one x to another by side [length].  Default: the limit sets of the scene's
        own throw, so far as parts there are not yet caught.
    throws : int
        The most throws.
    cells : int
        Cells per side.
    noise : mapping of str to str, optional
        What differs at every throw: ``{"throw.speed": "0.3 %"}``, besides what the scene scatters.
    seconds : float
        The most time for the search [s].
    beliefs : int
        The most beliefs to remember.
    progress : callable, optional
        Told the step, its number and how many there are.

    Returns
    -------
    Synthesis

    Raises
    ------
    AnswerError
        For a scene without throws to choose from, a goal without a place, an unknown mode, or starts that are none.

    Source: docs/feedback.md.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed").as_dict()
    >>> scene["feedback"] = {
    ...     "sensor": {"beyond": "20 in"},
    ...     "throws": [{"name": "own", "kappa": "25.3778518 in"}],
    ... }
    >>> found = ls.feedback(ls.load(scene), starts={2: (18.0, 19.0)}, cells=256)
    >>> found.found.verdict, found.found.throws
    ('solved', 2)
    """
    chosen = load(scene) if isinstance(scene, str) else scene
    asked = _sensor_of(chosen, sensor)
    cuts = [] if not isinstance(asked, BeyondSensor) else [asked.x - asked.error, asked.x + asked.error]
    board = _board(chosen, mode, goal, starts, cells, noise, cuts, progress)
    return board.play(asked, throws, seconds, beliefs, progress)


def places(
    scene: Scene | str,
    at: Sequence[float],
    *,
    error: float = 0.0,
    mode: str = "stop",
    goal: tuple[float, int] | None = None,
    starts: Starts = None,
    throws: int = 30,
    cells: int = 1024,
    noise: Mapping[str, str] | None = None,
    seconds: float = 10.0,
    beliefs: int = 400_000,
    progress: Progress = None,
) -> tuple[Synthesis, ...]:
    """Try the sensor "is the part beyond x?" at several places; the images of the cells are computed once.

    Parameters
    ----------
    at : sequence of float
        The places [length].
    error : float
        The sensor's error [length].
    scene, mode, goal, starts, throws, cells, noise, seconds, beliefs, progress
        As in `feedback`; the time is that for each place.

    Returns
    -------
    tuple of Synthesis
        One for each place.
    """
    chosen = load(scene) if isinstance(scene, str) else scene
    board = _board(chosen, mode, goal, starts, cells, noise, at, progress)
    found = []
    for k, x in enumerate(at):
        if progress is not None:
            progress("places of the sensor", k, len(at))
        found.append(board.play(BeyondSensor(x, error), throws, seconds, beliefs, None))
    return tuple(found)


def _sensor_of(scene: Scene, sensor: Sensor | str | None) -> Sensor | None:
    if isinstance(sensor, str):
        if sensor != "none":
            raise AnswerError("the sensor", sensor, 'a Sensor or "none"', "correct it")
        return None
    own = sensor if sensor is not None or scene.feedback is None else scene.feedback.sensor
    if own is None and scene.feedback is not None:
        remedy = 'add it to the scene, choose one, or pass "none"'
        raise AnswerError("the sensor", "none", "[feedback] sensor", remedy)
    return own


def _goal_of(scene: Scene, goal: tuple[float, int] | None) -> tuple[float, int]:
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
    return goal


def _board(
    scene: Scene,
    mode: str,
    goal: tuple[float, int] | None,
    starts: Starts,
    cells: int,
    noise: Mapping[str, str] | None,
    cuts: Sequence[float],
    progress: Progress,
) -> _Board:
    if mode not in MODES:
        raise AnswerError("the mode", mode, " or ".join(MODES), "correct the word")
    if scene.feedback is None:
        remedy = "add [[feedback.throws]] to the scene, each with name and kappa or speed"
        raise AnswerError("the throws to choose from", "none", "one at least", remedy)
    x, side = _goal_of(scene, goal)
    noises = joined(noise or {}, scatter_of(scene))
    boxes = {
        each.name: parameter_box(scene.with_values({each.quantity: each.text}), noise=noises)
        for each in scene.feedback.throws
    }
    named: Mapping[int, Sequence[float]] = starts if isinstance(starts, Mapping) else {}
    cells_of = _cells(
        scene, boxes, cells, {x, *cuts, *([starts] if isinstance(starts, float) else [])}, named
    )
    beyond = np.concatenate([edges[:-1] >= x for (edges,) in cells_of.edges])
    target = np.zeros(cells_of.n_cells, dtype=bool)
    target[cells_of.of_side(side)] = beyond[cells_of.of_side(side)]
    images = {}
    for k, (name, box) in enumerate(boxes.items()):
        if progress is not None:
            progress(f"images of the throw {name}", k, len(boxes))
        image = image_of(transitions(box.lo, cells_of, "boxes", upper=box.hi))
        images[name] = scattered(image, cells_of, box.landing) if box.landing else image
    lost = beyond & ~target if mode == "catch" else None
    game = game_of(images, None, target, lost)
    begin, words = _starts(scene, cells_of, starts, noises)
    if lost is not None:
        begin &= ~beyond
    if not begin.any():
        raise AnswerError("the starts", words, "some that are not caught at once", "name others")
    return _Board(scene, boxes, (x, side), mode, noises, CellSet(cells_of, begin), words, game)


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
    sides = []
    for side, (edges,) in enumerate(plain.edges):
        wanted = [x for x in {*cuts, *starts.get(side, ())} if edges[0] < x < edges[-1]]
        sides.append((np.union1d(edges, np.array(wanted, dtype=np.float64)),))
    return Grid(plain.domain, tuple(sides))


def _starts(scene: Scene, cells: Grid, starts: Starts, noise: dict[str, str]) -> tuple[Mask, str]:
    """Give the cells of the starts, and how they are named."""
    found = np.zeros(cells.n_cells, dtype=bool)
    if starts is None:
        box = parameter_box(scene, noise=noise)
        landing = box.landing
        graph = transitions(box.lo, cells, "boxes", upper=box.hi)
        sets = graph.recurrent_components()
        good = attracting_of(graph.ranges, graph.components(), sets)
        for each in (part for part, attracts in zip(sets, good, strict=True) if attracts):
            found[each] = True
        found = _closed(found, scattered(image_of(graph), cells, landing) if landing else image_of(graph))
        if not found.any():
            remedy = "name the starts"
            raise AnswerError("the limit sets of the scene's own throw", "none on these cells", "one", remedy)
        return found, "the limit sets of the scene's own throw"
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
        found[cells.of_side(side)] = inside if lo < hi else (edges[1:] >= lo) & (edges[:-1] <= hi)
    return found, words


def _closed(cells: Mask, image: Image) -> Mask:
    """Add to attracting cells what the scatter of the landings leads to from there; nothing where it may lead off."""
    while True:
        more = image(cells)
        if more is None:
            return np.zeros_like(cells)
        if not (more & ~cells).any():
            return cells
        cells = cells | more
