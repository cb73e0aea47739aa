"""One bit of feedback: which throw on which answer brings the part to a wanted side and place; its certificate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import (
    AnswerError,
    Table,
    arguments_checked,
    as_table,
    facts,
    picked,
    shown_in_notebooks,
)
from limitsets.base.arrays import Arrays
from limitsets.feeder.scene import BeyondSensor, Model, Scene, Sensor, exact_text, load
from limitsets.proofs.policies.board import Board, Progress, Starts, board_of
from limitsets.proofs.policies.controller import Controller, controller_of
from limitsets.proofs.policies.policy import NONE, NOT_DECIDED, SOLVED, Found, Policy, search
from limitsets.proofs.prover.certificate import Saved, brackets, in_certificate, pack
from limitsets.proofs.prover.cover import targets
from limitsets.systems.cells import CellSet, Grid

# ----------------------------------------------------------------
# The certificate of a policy: all that a recheck needs, and nothing that it has to trust.
#
# The file is laid out as every certificate (docs/certificates.md).  Its scene names the throws and the sensor; places
# that cells are cut at stand as the floats that they are, written in full.


def write(
    path: str | Path,
    board: Board,
    sensor: Sensor | None,
    policy: Policy,
    *,
    recheck: bool,
    workers: int | None,
) -> Path:
    """Write it, replacing an older file whole."""
    require_minimal(board)
    spans = [[side, lo.hex(), hi.hex()] for side, parts in board.starts.extents().items() for lo, hi in parts]
    within = max((int(policy.left[k]) for k in policy.first if k != NONE), default=0)
    section = game_section(board, sensor, policy) | {"starts": spans, "within": within}
    claims = [{"claim": "policy", "section": section}]
    held = table_arrays(policy) | _beliefs(policy) | _of_throws(board, policy)
    model = section["scene"]["model"]
    pack(path, model, claims, held, noise=board.noise, recheck=recheck, workers=workers)
    return Path(path)


def require_minimal(board: Board) -> None:
    """Refuse effects, of which nothing is rechecked."""
    if any(box.effects for box in board.throws.values()):
        raise AnswerError(
            "the certificate",
            "with effects",
            "the minimal model, and noise",
            "nothing rechecks other maps; the policy stands in .found and .to_json()",
        )


def game_section(board: Board, sensor: Sensor | None, policy: Policy) -> dict[str, Any]:
    """Say what is played, and the states to begin in, as certificates have it."""
    x, side = board.goal
    return {
        "scene": _scene(board, sensor),
        "mode": board.mode,
        "goal": {"x": f"{exact_text(x)} {board.scene.unit}", "side": side},
        "first": policy.to_json()["first"],
    }


def _scene(board: Board, sensor: Sensor | None) -> dict[str, Any]:
    """Write the scene with the sensor that is asked; its own goal may be another one and is left out."""
    scene = board.scene
    text = in_certificate(scene.text, "goal")
    text["feedback"].pop("sensor", None)
    if sensor is not None:
        text["feedback"]["sensor"] = dict(sensor.as_text(scene.unit))
    if board.mode == "catch" and scene.cavity is not None:
        text["cavity"]["position"] = f"{exact_text(board.goal[0])} {scene.unit}"
    return text


def table_arrays(policy: Policy) -> Arrays:
    """Write the table: what is thrown in each state, and what comes after."""
    return {
        "throw": policy.throw.astype(np.int32),
        "left": policy.left.astype(np.int32),
        "after": policy.after.astype(np.int32).squeeze(axis=1 if len(policy.answers) == 1 else ()),
    }


def _beliefs(policy: Policy) -> Arrays:
    """Write where the part may lie in each state, as ranges of cells."""
    edge = np.zeros((policy.states, 1), dtype=bool)
    steps = np.diff(np.concatenate([edge, policy.belief, edge], axis=1).astype(np.int8), axis=1)
    state, first = np.nonzero(steps == 1)
    _, past = np.nonzero(steps == -1)
    return {"belief": np.stack([state, first, past - 1], axis=1).astype(np.int32)}


def _of_throws(board: Board, policy: Policy) -> Arrays:
    """Write the cells, and where each throw leads from those in which it is made; -1 and 0 for the others."""
    held: Arrays = {f"edges.{side}": edges for side, (edges,) in enumerate(board.starts.grid.edges)}
    for number, cover in enumerate(board.covers.values()):
        made = policy.belief[policy.throw == number].any(axis=0)
        images = (
            ("jog", targets(cover, 0), -1),
            ("flip", targets(cover, 1), -1),
            ("phi", brackets(cover), 0.0),
        )
        for name, value, none in images:
            held[f"{number}.{name}"] = np.where(made[:, None], value, none).astype(value.dtype)
    return held


# ----------------------------------------------------------------
# One bit of feedback: which throw on which answer brings the part to a wanted side and place.


class Limits(NamedTuple):
    """How long a search may go on: throws, seconds, beliefs."""

    throws: int
    seconds: float
    beliefs: int


@dataclass(frozen=True, eq=False)
class Synthesis(Board, Saved):
    """The answer of a search for a policy with one bit of feedback, and the game that was searched.

    Attributes
    ----------
    sensor : Sensor or None
        What is asked; None: nothing.
    limits : Limits
        How long the search could go on.
    found : Found
        How the search ended.
    """

    sensor: Sensor | None
    limits: Limits
    found: Found

    @property
    def solved(self) -> bool:
        """Whether there is a policy."""
        return self.found.verdict == SOLVED

    def require_policy(self) -> Policy:
        """Return the policy; AnswerError where there is none."""
        outcome = self.found
        if outcome.policy is None:
            remedy = "more throws, other throws, another sensor or fewer starts may do it"
            raise AnswerError("the policy", outcome.verdict, "one that was found", remedy)
        return outcome.policy

    @property
    def grid(self) -> Grid:
        """The cells."""
        return self.starts.grid

    @property
    def question(self) -> str:
        """What the sensor is asked, a clause."""
        return "nothing is asked" if self.sensor is None else self.sensor.question(self.scene.unit)

    @property
    def model(self) -> Model:
        """The model for which the policy is proved, and the facts of the scene that this model leaves out."""
        return Model.of(self.scene, self.noise)

    def asking(self, sensor: Sensor | None) -> Synthesis:
        """Play with another sensor on the same cells, whose images are not computed again."""
        return _play(self, sensor, self.limits)

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write the policy that was found."""
        write(path, self, self.sensor, self.require_policy(), **how)

    def denied(self, why: str) -> Synthesis:
        """Return the answer where the checker denies its certificate: nothing is decided."""
        reason = f"the checker denies it: {why}"
        return replace(
            self, found=replace(self.found, verdict=NOT_DECIDED, throws=-1, policy=None, reason=reason)
        )

    def controller(self) -> Controller:
        """Give the policy as complete tables for a controller; AnswerError where there is none."""
        scene, (x, side) = self.scene, self.goal
        assert scene.feedback is not None  # there is a policy
        given = (
            f"throw {k}, {each.name}: {each.quantity} = {each.text}"
            for k, each in enumerate(scene.feedback.throws)
        )
        wanted = {"stop": "known to lie", "catch": "to be caught"}[self.mode]
        about = (
            f"Policy of the scene {scene.name}: the part is {wanted} on side {side}",
            f"at x = {x:.9g} {scene.unit} or beyond,",
            f"after {self.found.throws} throws at most, from {self.starts_are}.",
            f"The sensor is asked: {self.question}",
            *given,
        )
        return controller_of(self.require_policy(), about)

    def beliefs(self) -> list[dict[int, list[tuple[float, float]]]]:
        """Give per state of the policy where the part may lie: intervals by side [length]."""
        policy = self.found.policy
        return [] if policy is None else [CellSet(self.grid, mask).extents() for mask in policy.belief]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        policy = self.found.policy
        caption = f"{self.scene.name}: {self.question}"
        of = self.model.sentence
        verdict = facts(caption, picked(self.found, "verdict", "throws", "beliefs"), of)
        if policy is None:
            return (verdict,)
        return (
            replace(policy.tables()[0], caption=caption, how=f"proved for the starts and noise named; {of}"),
            verdict,
        )

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
            model=self.model,
            verdict=self.found.verdict,
            within=self.found.throws,
            policy=policy,
            beliefs=self.found.beliefs,
            seconds=self.found.seconds,
            reason=self.found.reason,
        )


def _play(board: Board, sensor: Sensor | None, limits: Limits, progress: Progress = None) -> Synthesis:
    own = {each.name: getattr(board, each.name) for each in fields(Board)}
    game = board.game.asking(None if sensor is None else sensor.answers(board.starts.grid))
    outcome = search(game, board.starts.mask, **limits._asdict(), progress=progress)
    return Synthesis(**{**own, "game": game}, sensor=sensor, limits=limits, found=outcome)


@shown_in_notebooks
@arguments_checked
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
    cuts: Sequence[float] = (),
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
    cuts : sequence of float
        Further borders of cells [length], such as the places of sensors that `Synthesis.asking` will try.
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
    >>> answer = ls.feedback(ls.load(scene), starts={2: (16.0, 16.5)}, cells=256)
    >>> answer.found.verdict, answer.found.throws
    ('solved', 2)
    """
    chosen = load(scene)
    asked = _sensor_of(chosen, sensor)
    own = asked.cuts if isinstance(asked, BeyondSensor) else ()
    board = board_of(
        chosen, mode, goal, starts=starts, cells=cells, noise=noise, cuts=(*cuts, *own), progress=progress
    )
    return _play(board, asked, Limits(throws, seconds, beliefs), progress)


def places(
    scene: Scene | str, at: Sequence[float], *, error: float = 0.0, progress: Progress = None, **options: Any
) -> tuple[Synthesis, ...]:
    """Try the sensor "is the part beyond x?" at several places; the images of the cells are computed once.

    Parameters
    ----------
    at : sequence of float
        The places [length].
    error : float
        The sensor's error [length].
    scene, progress, **options
        As in `feedback`; the time is that for each place.

    Returns
    -------
    tuple of Synthesis
        One for each place.
    """
    sensors = [BeyondSensor(x, error) for x in at]
    syntheses: list[Synthesis] = []
    for k, sensor in enumerate(sensors):
        if progress is not None:
            progress("places of the sensor", k, len(at))
        if syntheses:
            syntheses.append(syntheses[0].asking(sensor))
        else:
            cuts = [cut for each in sensors for cut in each.cuts]
            syntheses.append(feedback(scene, sensor, **{**options, "cuts": cuts}))
    return tuple(syntheses)


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
