"""A file outside the package that adds an effect, a goal, a map, an image method, a figure and a command.

Everything in it is what CONTRIBUTING says; the package is not edited.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import typer
from matplotlib.figure import Figure

import limitsets as ls
from limitsets.face.plot import style
from limitsets.feeder.goals import Found, Goal, Place, Verdict
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower.effects import Effect
from limitsets.feeder.thrower.motion import Contact, Face, FullSide, at_kappa, impacted, moved, thrown
from limitsets.feeder.thrower.params import Throw
from limitsets.feeder.world import Fact
from limitsets.proofs.prover.goals import Answer, Kind
from limitsets.proofs.prover.goals.kind import against, below, common, place_text, undecided
from limitsets.proofs.prover.goals.recurrent_orbits import recurrent_violation
from limitsets.systems.cells import Grid
from limitsets.systems.graph.images.undecided import SamplePoints

# ---------------------------------------------------------------- an effect, with two facts of its own


class Wear(NamedTuple):
    """A worn arm: its speed is less than it should be, a landing takes rotation, a part at rest creeps outward."""

    lost: float
    grip: float
    creep: float


def slower(wear: Wear, bare: Throw) -> Throw:
    """kappa = g/w^2 with w (1 - lost)."""
    return at_kappa(bare, bare.kappa / ((1.0 - wear.lost) * (1.0 - wear.lost)))


def gripped(wear: Wear, contact: Contact, part: FullSide) -> Contact:
    """Take a share of the rotation."""
    left = (1.0 - wear.grip) * contact.omega
    return Contact(contact.vertex, contact.psi, contact.shift, left, contact.slide, contact.lift)


def crept(wear: Wear, shift: float, part: FullSide, face: Face) -> float:
    """Creep on the side it stays on."""
    return shift + wear.creep


thrown.on(Wear, slower)
impacted.on(Wear, gripped)
moved.on(Wear, crept)

GRIP = {"loose": 0.0, "firm": 1.0}

WEAR = Effect(
    "wear",
    Wear,
    lambda world, how: Wear(world.lost, GRIP[how], world.creep),
    "the arm is as new",
    needs=("lost", "creep"),
    words=("loose", "firm"),
    facts={"lost": Fact("the lost share", most=0.5, words="0.1"), "creep": Fact("the creep", "length")},
)


# ---------------------------------------------------------------- a goal, with its proof


@dataclass(frozen=True)
class KeepsBelow(Goal):
    """Every part at rest is at x at most."""

    kind: ClassVar[str] = "keeps_below"
    x: Place
    from_anywhere: bool = False

    def decide(self, found: Found) -> Verdict:
        threshold = max((hi for parts in found.extents.values() for _, hi in parts), default=-math.inf)
        return Verdict(threshold <= self.x, threshold)

    def question(self, unit: str) -> str:
        return f"no part rests beyond x = {self.x:g} {unit}"

    def explained(self, threshold: float, unit: str) -> str:
        return f"The farthest part is at x = {threshold:.3f} {unit}."

    def wrong(self) -> Callable[[Any, Any], Any]:
        return lambda x, side: x > self.x


def _prove(found: Any, scene: Scene, goal: KeepsBelow) -> Answer:
    ends = max(hi for parts in found.cells.extents().values() for _, hi in parts)
    if missing := common(found, anywhere=goal.from_anywhere):
        return undecided(missing)
    if goal.from_anywhere or ends > below(goal.x):
        return undecided(f"the attracting cells end at x = {ends:g}")
    return Answer("proved", "", {"kind": goal.kind, "x": place_text(goal, scene)})


def _refute(found: Any, scene: Scene, goal: KeepsBelow) -> Answer:
    return against(recurrent_violation(found, scene, goal.wrong()))


def _sentence(section: Mapping[str, Any]) -> str:
    return f"In the attracting cells, no part rests beyond x = {section['x']}."


KEEPS_BELOW = Kind(_prove, _refute, _sentence, lambda goal: [below(goal.x)])


# ---------------------------------------------------------------- a map


class Tent(NamedTuple):
    """x' = slope min(x, 1 - x)."""

    slope: float


def tent(params: Tent, x: float, side: int) -> tuple[float, int, int]:
    return (params.slope * x, side, 0) if x < 0.5 else (params.slope * (1.0 - x), side, 1)


# ---------------------------------------------------------------- an image method


def thirds(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """Two points per cell, a third from each end."""
    (edges,) = grid.edges[side]
    width = np.diff(edges)
    points = np.stack([edges[:-1] + width / 3, edges[1:] - width / 3], axis=1).ravel()
    return SamplePoints((points,), (2,), np.arange(2))


# ---------------------------------------------------------------- a figure


def lengths(scene: Scene) -> Figure:
    """Draw the length of each side."""
    figure, (axes,) = style.canvas(5.0, 3.0)
    axes.bar(range(len(scene.sides)), scene.sides.length, color=style.JOG, gid="length")
    axes.set_ylabel(f"length [{scene.unit}]")
    style.title(figure, scene.name)
    return figure


# ---------------------------------------------------------------- a command


def perimeter(scene: str) -> None:
    """Print the part's perimeter."""
    given = ls.load(scene)
    typer.echo(f"{given.sides.length.sum():g} {given.unit}")
