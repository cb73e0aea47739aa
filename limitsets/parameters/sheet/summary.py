"""The robustness of a scene as one answer: margins, their curve over X, noise, and what is left out, with reasons."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import AnswerError, Table, Tabled, as_table, joined, picked
from limitsets.base.campaign import Here
from limitsets.feeder.goals import Goal
from limitsets.feeder.scattering import LAWS, Scattering, scattering_of
from limitsets.feeder.scene import WITHOUT_SCATTER, LaidLike, Model, Scene, load
from limitsets.feeder.scene.quantities import deviation, find
from limitsets.parameters.margins.margin_result import NOT_FOUND, REFUTED, Margin, void_of
from limitsets.parameters.margins.single import MarginsBeyond, margins_beyond, places_beyond
from limitsets.parameters.noise.statistics import Levels, NoiseStatistics

if TYPE_CHECKING:
    from limitsets.proofs.auditing import Audit


# ----------------------------------------------------------------
# The margin curve, place by place: the middle first, as many X as time permits, each handed on as soon as it is
# found.


# Places; how close their brackets are; most and least seconds for the proof of one joint margin, and seconds in all.
PLACES, COARSE, EACH, LEAST, SECONDS = 7, 0.1, 15.0, 1.0, 20.0


def _joined(one: MarginsBeyond | None, other: MarginsBeyond) -> MarginsBeyond:
    """Put the places of both together, ascending, without the proofs."""
    if one is None:
        return other
    order = np.argsort(np.concatenate([one.x, other.x]))
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(one, name), getattr(other, name)])[order]
        for name in ("x", "proved", "refuted")
    }
    return replace(one, **columns, margins=())


def _place(
    scene: Scene, side: int, names: tuple[str, ...], words: Mapping[str, Any], x: float, seconds: float
) -> MarginsBeyond:
    """Ask about one place; without the proofs, which would go from process to process."""
    return replace(margins_beyond(scene, side, names, x=[x], seconds=seconds, **words), margins=())


def curve(
    scene: Scene,
    side: int,
    tolerance: Mapping[str, str],
    *,
    laid: LaidLike | None = None,
    seconds: float = SECONDS,
    executor: Executor | None = None,
    tell: Callable[[str, float], None],
    keep: Callable[[MarginsBeyond], None],
) -> tuple[MarginsBeyond, int]:
    """Bracket margins of "beyond X only this side, and almost every orbit comes there" at some X.

    Parameters
    ----------
    scene : Scene
        The scene.
    side : int
        The side wanted.
    tolerance : mapping of str to str
        Of the joint margin; if it is empty, the margin is that of throw.speed.
    laid : mapping of int to sequence of (float, float), optional
        Where parts are laid down; default the whole arm.
    seconds : float
        Shared by the proofs of all places; no place is begun for which less is left than the dearest took, but the
        middle one always is.
    executor : Executor, optional
        Where places are asked about, as many at once as it has workers; default, here.
    tell, keep : callable
        Called with what is done and its share, and with what is found so far.

    Returns
    -------
    MarginsBeyond
        Without the proofs.
    int
        Places that there was no time for.

    Raises
    ------
    AnswerError
        The limit set gets farther on another side than on this one.
    """
    end = time.perf_counter() + seconds
    names = ("joint",) if tolerance else ("throw.speed",)
    words = {"tolerance": tolerance, "laid": laid, "width": COARSE}
    places = places_beyond(scene, side, PLACES)
    places = places[np.argsort(np.abs(places - places.mean()), kind="stable")]
    waiting, margins = places.tolist(), None
    pool = executor or Here()
    margin_there = partial(_place, scene, side, names, words)
    # concurrent.futures has no public word for it; of an executor of another kind it is not known
    at_once = getattr(pool, "_max_workers", 1)
    begun: dict[Future[MarginsBeyond], float] = {}
    dearest = 0.0
    while True:
        while waiting and len(begun) < at_once:
            now = time.perf_counter()
            dearest = max([dearest, *(now - since for since in begun.values())])
            # what would not end in time is left out
            if (margins is not None or begun) and end - now < dearest:
                break
            x, each = waiting[0], at_once * (end - now) / len(waiting)
            tell(f"margin beyond x = {x:.4g}", 1.0 - len(waiting) / PLACES)
            one = pool.submit(margin_there, x, min(EACH, max(each, LEAST)))
            begun[one] = now
            del waiting[0]
        if not begun:
            break
        for one in wait(begun, return_when=FIRST_COMPLETED).done:
            dearest = max(dearest, time.perf_counter() - begun.pop(one))
            margins = _joined(margins, one.result())
            keep(margins)
    assert margins is not None
    return margins, len(waiting)


# ----------------------------------------------------------------
# Input of the noise of a tolerance sheet: from the scene's world, or from texts; and the scene without noise.


FIELDS = {"throw.speed": "speed", "gravity.tilt": "tilt", "landing.x": "landing"}


def still(scene: Scene) -> Scene:
    """Return a scene without its scatter: in a margin, what is not asked about does not deviate."""
    if scene.effects.spread is None:
        return scene
    tree = scene.as_dict()
    tree["effects"].pop("spread")
    return replace(load(tree), file=scene.file)


def noise_of(scene: Scene, given: Scattering | None) -> tuple[Scattering | None, str]:
    """Choose the noise: what is given, else the scatter of the scene's world; and say where it is from."""
    if given is not None:
        return (given, "as it was asked for") if given.given() else (None, "")
    if scene.world.scatter is None:
        return None, ""
    if scene.effects.spread is not None:
        return scattering_of(scene), "the scene's, [world] scatter with [effects] spread"
    normal = replace(scene, effects=scene.effects.also(spread="gaussian"))
    words = "the scene's, [world] scatter, taken as standard deviations of normal laws; "
    return scattering_of(normal), words + 'spread = "bounded" in [effects] would make them bounds'


def scattering_from(scene: Scene, texts: Mapping[str, str], law: str = "gaussian") -> Scattering:
    """Read noise from texts.

    Parameters
    ----------
    scene : Scene
        The scene.
    texts : mapping of str to str
        By quantity, ``{"throw.speed": "0.5 %", "landing.x": "0.02 in"}``.
    law : str
        Of `limitsets.feeder.scattering.LAWS`.

    Raises
    ------
    AnswerError
        Noise of another quantity than throw.speed, gravity.tilt and landing.x, or another law.

    Examples
    --------
    >>> import limitsets as ls
    >>> scattering_from(ls.load("paper-designed"), {"throw.speed": "0.5 %"}).words()
    {'speed': 'Gaussian(sigma=0.005)'}
    """
    if law not in LAWS:
        raise AnswerError("the law of the noise", law, " or ".join(LAWS), "correct the word")
    fields: dict[str, Any] = {}
    for name, text in texts.items():
        find(name)
        if name not in FIELDS:
            remedy = "what is fixed but unknown is a tolerance: it has a margin"
            raise AnswerError("the noise", name, f"noise of {', '.join(FIELDS)}", remedy)
        given = deviation(text, name, scene.unit, key=name)
        size = given.value
        if name == "throw.speed" and not given.relative:
            size /= scene.value(name)
        if name == "gravity.tilt" and given.relative:
            size *= scene.value(name)
        fields[FIELDS[name]] = LAWS[law](size)
    return Scattering(**fields)


# ----------------------------------------------------------------
# The robustness of a scene as one answer: margins, the best X, noise, and the parts left out with their reasons.


PARTS = ("margins", "joint", "curve", "noise", "audit")
"""What an answer is put together from."""


def row_of(margin: Margin) -> dict[str, Any]:
    """Give a margin as a row of the sheet's JSON: its value as the scene gives it, the goal violated, its files."""
    nominal, unit = margin.given
    proofs = [name for name in margin.files if not name.endswith(REFUTED)]
    row = margin.to_json() | {
        "nominal": nominal,
        "nominal_unit": unit,
        "violated": None if margin.violated is None else margin.goals.index(margin.violated),
        "certificate": (proofs if len(proofs) > 1 else proofs[0]) if proofs else None,
        "refutation": next((name for name in margin.files if name.endswith(REFUTED)), None),
    }
    del row["model"]  # the sheet names it once
    return row


@dataclass(frozen=True, eq=False)
class Robustness(Tabled):
    """How far a scene may drift, and what chance does to it.

    Attributes
    ----------
    scene : Scene
        The scene that was asked, its scatter left out.
    goals : tuple of Goal
        What has to hold, all of it.
    verdict : str
        Of the goals in the scene as it is: "proved", "refuted" or "undecided"; of a scene that scatters its throws
        followed by "of the scene without its scatter".
    reach : float or None
        Where the attracting cells end in which the goals are proved of the scene as it is.
    entries : tuple of Margin
        One per quantity and reading, without the cells of their proofs; the last is joint, where there is a tolerance.
        Proved and refuted.
    tolerance : dict of str to str
        The vector that the joint factor is on.
    curve : MarginsBeyond or None
        Margins against X, of "beyond X only this side, and almost every orbit comes there".  Proved and refuted.
    noise : NoiseStatistics or None
        What chance does.  Computed between cells, not proved.
    levels : Levels or None
        Its numbers at other levels of the noise.
    law : str
        How the law of the noise was come by.
    audit : Audit or None
        Assumptions of the model that the scene breaks.
    left_out : dict of str to str
        Which of `PARTS`, or which margin, there is nothing of, and why.
    width : float
        How close brackets had to be.
    seconds : float
        Time it took.
    """

    scene: Scene
    goals: tuple[Goal, ...]
    verdict: str
    reach: float | None
    entries: tuple[Margin, ...]
    tolerance: dict[str, str]
    curve: MarginsBeyond | None
    noise: NoiseStatistics | None
    levels: Levels | None
    law: str
    audit: Audit | None
    left_out: dict[str, str]
    width: float
    seconds: float

    @property
    def decided(self) -> str:
        """The first word of the verdict: that on `scene`, whether or not the scene that was asked scatters."""
        return self.verdict.removesuffix(f" {WITHOUT_SCATTER}")

    @property
    def model(self) -> Model:
        """Of which model the proofs are, which facts of the scene that leaves out, and what the audit found."""
        of = Model.of(self.scene)
        if self.audit is None:
            return of
        broken = (each for each in self.audit.on("limit-set") if each.called_for and not each.simulated)
        return replace(of, broken=tuple(each.effect for each in broken))

    @property
    def singles(self) -> tuple[Margin, ...]:
        """The margins of single quantities."""
        return tuple(entry for entry in self.entries if entry.quantity != "joint")

    @property
    def joint(self) -> Margin | None:
        """The factor on the tolerance."""
        return next((entry for entry in self.entries if entry.quantity == "joint"), None)

    @property
    def failed(self) -> tuple[str, ...]:
        """Those of `left_out` whose search ended with an error."""
        return tuple(part for part, why in self.left_out.items() if why.startswith(NOT_FOUND))

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        margins = joined(self.entries) if self.entries else Table(("quantity",), (), "No margins")
        shown = [margins]
        if self.curve is not None:
            shown += self.curve.tables()
        if self.noise is not None:
            shown += self.noise.tables()
        return tuple(shown)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON: null, never nan."""
        return as_table(
            complete=True,
            scene=self.scene.as_dict(),
            holds={"proved": True, "refuted": False}.get(self.verdict),
            vacuous=bool(void_of(self.goals, self.reach, self.scene.unit)),
            margins=[row_of(margin) for margin in self.entries],
            tolerance=self.tolerance or None,
            curve=self.curve,
            noise=None if self.noise is None else self.noise.to_json() | {"law": self.law},
            noise_levels=self.levels,
            assumptions=self.audit,
            model=self.model,
            **picked(self, "left_out", "width", "seconds"),
        )
