"""The robustness of a scene, put together: every margin, the factor on the tolerance, where X is best, the noise."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.errors import AnswerError, SceneError
from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.proofs.parameters import parameter_box
from limitsets.robust.deviations import Measure, measures
from limitsets.robust.entries import Entry
from limitsets.robust.joint import Tolerance, joint_margin
from limitsets.robust.keeping import Kept
from limitsets.robust.laws import Gaussian, Uniform
from limitsets.robust.margins import GoalLike, Margin, asked_of, goals_of, margin
from limitsets.robust.scattering import Scattering, scattering_of
from limitsets.robust.statistics import CELLS, Levels, NoiseStatistics, noise_levels, noise_statistics
from limitsets.scene import Scene, load

if TYPE_CHECKING:
    from limitsets.auditing import Audit

__all__ = ["PARTS", "Robustness", "robustness", "scattering_from", "still"]

PARTS = ("margins", "joint", "curve", "noise", "audit")
"""What a sheet is put together from."""

FACTORS = (0.0, 0.5, 1.0, 1.5, 2.0)

EXAMPLE = '[goal] oriented_beyond = { x = "20 in", side = 2 }'

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Robustness:
    """How far a scene may drift, and what chance does to it.

    Attributes
    ----------
    scene : Scene
        The scene that was asked, its scatter left out.
    goals : tuple of Goal
        What has to hold, all of it.
    verdict : str
        Of the goals in the scene as it is: "proved", "refuted" or "undecided".
    entries : tuple of Entry
        One per quantity and reading; the last is joint, where there is a tolerance.  Proved and refuted.
    tolerance : dict of str to str
        The vector that the joint factor is on.
    curve : object or None
        The margin against X.  Proved and refuted.
    noise : NoiseStatistics or None
        What chance does.  Computed between cells, not proved.
    levels : Levels or None
        Its numbers at other levels of the noise.
    law : str
        How the law of the noise was come by.
    audit : Audit or None
        Assumptions of the model that the scene breaks.
    left_out : dict of str to str
        Which of `PARTS` there is nothing of, and why.
    width : float
        How close brackets had to be.
    digest : str
        Of all that margins depend on.
    again : int
        How many margins were found by an earlier run.
    seconds : float
        Time it took.
    """

    scene: Scene
    goals: tuple[Goal, ...]
    verdict: str
    entries: tuple[Entry, ...]
    tolerance: dict[str, str]
    curve: Any
    noise: NoiseStatistics | None
    levels: Levels | None
    law: str
    audit: Audit | None
    left_out: dict[str, str]
    width: float
    digest: str
    again: int
    seconds: float

    @property
    def singles(self) -> tuple[Entry, ...]:
        """The margins of single quantities."""
        return tuple(entry for entry in self.entries if entry.quantity != "joint")

    @property
    def joint(self) -> Entry | None:
        """The factor on the tolerance."""
        return next((entry for entry in self.entries if entry.quantity == "joint"), None)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON: null, never nan."""
        levels = self.levels
        return {
            "complete": True,
            "digest": self.digest,
            "scene": self.scene.as_dict(),
            "holds": {"proved": True, "refuted": False}.get(self.verdict),
            "margins": [entry.to_json() for entry in self.entries],
            "tolerance": self.tolerance or None,
            "curve": None if self.curve is None else self.curve.to_json(),
            "noise": None if self.noise is None else self.noise.to_json() | {"law": self.law},
            "noise_levels": None
            if levels is None
            else {
                "factors": levels.factors.tolist(),
                "numbers": {
                    name: [None if value != value else float(value) for value in row]
                    for name, row in levels.numbers.items()
                },
            },
            "assumptions": None if self.audit is None else self.audit.to_json(),
            "left_out": self.left_out,
            "width": self.width,
            "seconds": self.seconds,
        }


def still(scene: Scene) -> Scene:
    """Return a scene without its scatter: margins are about throws that deviate as the margin says, and else do not."""
    if scene.effects.spread is None:
        return scene
    tree = scene.as_dict()
    tree["effects"].pop("spread")
    return replace(load(tree), file=scene.file)


def scattering_from(scene: Scene, texts: Mapping[str, str], law: str = "gaussian") -> Scattering:
    """Read noise from texts, ``{"throw.speed": "0.5 %", "landing.x": "0.02 in"}``.

    Parameters
    ----------
    scene : Scene
        The scene.
    texts : mapping of str to str
        Standard deviations, or bounds of an even law, by quantity.
    law : str
        "gaussian" or "bounded".

    Examples
    --------
    >>> import limitsets as ls
    >>> scattering_from(ls.load("paper-designed"), {"throw.speed": "0.5 %"}).words()
    {'speed': 'Gaussian(sigma=0.005)'}
    """
    from limitsets.scene.quantities import base_unit, deviation, find

    kinds = {"gaussian": Gaussian, "bounded": Uniform}
    if law not in kinds:
        raise AnswerError("the law of the noise", law, " or ".join(kinds), "correct the word")
    fields = {"throw.speed": "speed", "gravity.tilt": "tilt", "landing.x": "landing"}
    found: dict[str, Any] = {}
    for name, text in texts.items():
        find(name)
        if name not in fields:
            allowed = f"noise of {', '.join(fields)}"
            raise AnswerError("the noise", name, allowed, "what is fixed but unknown is a tolerance")
        given = deviation(text, name, scene.unit, key=name)
        size, relative = given.value, given.relative
        if name == "throw.speed" and not relative:
            size /= scene.value("throw.speed")
        if name == "gravity.tilt" and relative:
            size *= scene.value("gravity.tilt")
        found[fields[name]] = kinds[law](size)
        assert base_unit  # units of the other quantities are the scene's own
    return Scattering(**found)


def robustness(
    scene: Scene | str | Path,
    *quantities: str,
    goal: GoalLike | Sequence[GoalLike] | None = None,
    reading: str | None = None,
    tolerance: Mapping[str, str] | None = None,
    scatter: Scattering | None = None,
    width: float = 0.01,
    cells: int = CELLS,
    leave_out: Sequence[str] = (),
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> Robustness:
    """Say how far a scene may drift before its goal fails, and what noise does to it.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, or what `limitsets.load` takes.
    *quantities : str
        Names of quantities; default all that the scene gives.
    goal : Goal, callable, or a sequence of them, optional
        What has to hold, all of it; default the scene's goal.
    reading : str, optional
        "fixed" or "per-throw"; default both, of each quantity those that it has.
    tolerance : mapping of str to str, optional
        Deviations that the joint margin is a factor on, ``{"throw.speed": "1 %"}``; default the scene's.
    scatter : Scattering, optional
        Noise at every throw with its laws; default that of the scene's world, normal unless the scene says "bounded".
    width : float
        How close the two ends of a bracket have to be, as a share of the upper one.
    cells : int
        Cells per side for the noise.
    leave_out : sequence of str
        Which of "margins", "joint", "curve", "noise" and "audit" not to do.
    folder : str or Path, optional
        Margins are written there as they are found, with their certificates, and found again by the next run.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    Robustness
        Margins are proved and refuted, statistics of noise computed, an audit as it says.

    Raises
    ------
    AnswerError
        No goal, a scene of which nothing can be proved, a quantity that it does not give.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.robustness("paper-designed", "throw.speed", reading="fixed", leave_out=["curve", "audit"])
    >>> found.entries[0].proved < 0.733 < found.entries[0].refuted, found.entries[0].unit
    (True, '%')
    """
    begin = time.perf_counter()
    sheet = _Sheet(scene, quantities, goal, reading, tolerance, scatter, width, cells, leave_out, folder)
    return sheet.fill(progress or (lambda step, done, of: None), begin)
