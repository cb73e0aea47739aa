"""A robust design and what others get of it: throws to feed, the Pareto front, tables, a folder with certificates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import Column, Progress, Table, Tabled, as_json, as_table, joined, one_by_one, picked
from limitsets.feeder.goals import Goal
from limitsets.feeder.scene import Model, Scene, dump, in_unit_of, unit_of
from limitsets.parameters.design.search import Candidate, Counterweight, DesignSearch
from limitsets.parameters.margins.estimate import Estimate, on_all_corners
from limitsets.parameters.margins.margin_result import Margin, settled
from limitsets.systems.maps import advance
from limitsets.systems.maps.contract import kind_of

# ----------------------------------------------------------------
# Throws to feed: the number of throws until a part from anywhere on the arm rests beyond X on the wanted side.


# Starts, and throws after which one that is not fed is given up.
STARTS, MOST = 2000, 2000
# Starts keep this share of the way from a_i to X away from a_i, where the number of throws has no bound.
NEAR = 0.05


@dataclass(frozen=True)
class ThrowsToFeed:
    """Throws to feed, sampled from random starts.

    Attributes
    ----------
    mean, quantile_95 : float
        Over the starts that are fed, nan if none is.
    fed, lost : int
        How many starts are fed, and how many leave the arm before.
    starts : int
        Of how many.
    """

    mean: float
    quantile_95: float
    fed: int
    lost: int
    starts: int


def throws_to_feed(scene: Scene, x: float, side: int, *, starts: int = STARTS, seed: int = 0) -> ThrowsToFeed:
    """Count throws until a part rests at x or beyond on a side.

    Parameters
    ----------
    scene : Scene
        The scene, as simulated: with its effects, if any.
    x, side : float, int
        Where parts are fed [length].
    starts : int
        Random starts: sides with equal chance, and places evenly from a_i to x but for 5 % of the way.
    seed : int
        Of the counted random numbers (Philox): the same seed, the same starts.

    Returns
    -------
    ThrowsToFeed

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.parameters.design.design_result import throws_to_feed
    >>> found = throws_to_feed(ls.load("paper-designed"), 20.0, 2)
    >>> found.fed, found.lost
    (2000, 0)
    """
    rng = np.random.Generator(np.random.Philox(seed))
    sides = rng.integers(len(scene.sides), size=starts)
    a = scene.sides.a[sides]
    places = a + (NEAR + (1.0 - NEAR) * rng.random(starts)) * (x - a)
    params, counts, lost = scene.map, np.zeros(starts), 0
    waiting = np.arange(starts)
    exits = list(kind_of(params).exits.values())
    for throw in range(1, MOST + 1):
        places, sides, code, _ = advance(params, places, sides, 1)
        gone = np.isin(code, exits)
        there = ~gone & (sides == side) & (places >= x)
        counts[waiting[there]] = throw
        lost += int(gone.sum())
        left = ~(gone | there)
        waiting, places, sides = waiting[left], places[left], sides[left]
        if not waiting.size:
            break
    done = counts[counts > 0]
    if not done.size:
        return ThrowsToFeed(np.nan, np.nan, 0, lost, starts)
    return ThrowsToFeed(float(done.mean()), float(np.quantile(done, 0.95)), int(done.size), lost, starts)


# ----------------------------------------------------------------
# The Pareto front of the designs tried, in margin and in throws to feed.


# Candidates whose throws are counted: the surest of each class of margins, and classes.
CLASSES, PER_CLASS = 30, 6
# Designs that are looked at on all corners, seconds each.
MOST_SURE = 60


@dataclass(frozen=True, eq=False)
class Option:
    """A design and its throws to feed.

    Attributes
    ----------
    candidate : Candidate
        The design, with its margin by floats.
    feeding : ThrowsToFeed
        Throws to feed at its own best X, sampled.
    """

    candidate: Candidate
    feeding: ThrowsToFeed

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        one = self.candidate
        return as_table(
            **picked(one, "values", "order"), **picked(one.estimate, "margin", "x"), throws=self.feeding
        )


def unbeaten(margin: Sequence[float], throws: Sequence[float]) -> list[int]:
    """Give the numbers of those that no other beats in both: more margin with no more throws, or fewer with no less.

    Examples
    --------
    >>> unbeaten([3.0, 2.0, 1.0, 2.5], [30.0, 20.0, 25.0, 30.0])
    [0, 1]
    """
    order = sorted(range(len(margin)), key=lambda k: (-margin[k], throws[k]))
    numbers: list[int] = []
    for k in order:
        if not numbers or throws[k] < throws[numbers[-1]]:
            numbers.append(k)
    return numbers


def front_of(
    searches: Sequence[DesignSearch],
    history: Sequence[Candidate],
    own: Option,
    side: int,
    seed: int,
    tell: Progress,
) -> tuple[Option, ...]:
    """Count the throws of designs of every margin, and keep those that nothing beats.

    Parameters
    ----------
    searches : sequence of DesignSearch
        By order.
    history : sequence of Candidate
        Designs tried.
    own : Option
        The design chosen, rated on all corners: no other need be looked at that it beats.
    side : int
        The side wanted.
    seed : int
        Of the random starts.
    tell : callable
        Progress.

    Returns
    -------
    tuple of Option
        The surest first.
    """
    known = [each for each in history if each.estimate.margin > 0.0 and np.isfinite(each.estimate.x)]
    if not known:
        return (own,)
    margins = np.array([each.estimate.margin for each in known])
    which = np.minimum((CLASSES * margins / margins.max()).astype(int), CLASSES - 1)
    chosen = []
    for number in range(CLASSES):
        mine = np.flatnonzero(which == number)
        # a lower X against the reach is reached sooner: of each class those, besides the surest
        early = [known[k].estimate.x / known[k].estimate.reach for k in mine]
        chosen += [int(k) for k in mine[np.argsort(early)[:PER_CLASS]]]
    chosen += [int(k) for k in np.argsort(-margins)[:PER_CLASS]]
    counted = one_by_one("throws to feed", dict.fromkeys(chosen), len(chosen), tell)
    options = [own, *filter(None, (_option(known[k], searches[known[k].order], side, seed) for k in counted))]
    # The designs on the front are rated again on all corners, until all of them are: the search knew some corners only,
    # so that a rating from then may be too high, and hides designs that are better on all.
    sure = [own]
    for number in range(MOST_SURE):
        option = next((each for each in best_of(options) if each not in sure), None)
        if option is None:
            break
        tell("designs on all corners", number, MOST_SURE)
        options.remove(option)
        one, search = option.candidate, searches[option.candidate.order]
        scene = search.scene.with_values(dict(one.values))
        estimate = on_all_corners(scene, search.tolerance, side, search.hard)
        if estimate is not None and estimate.margin > 0.0:
            again = [_option(replace(one, estimate=estimate), search, side, seed)]
            sure += filter(None, again)
            options += filter(None, again)
    return tuple(best_of(sure))


def _option(one: Candidate, search: DesignSearch, side: int, seed: int) -> Option | None:
    """Count the throws of a design at its best X; None if not every start is fed."""
    feeding = throws_to_feed(search.scene.with_values(dict(one.values)), one.estimate.x, side, seed=seed)
    return Option(one, feeding) if feeding.fed == feeding.starts else None


def best_of(options: Sequence[Option]) -> list[Option]:
    """Keep the options that no other beats in both, the surest first."""
    kept = unbeaten(
        [each.candidate.estimate.margin for each in options], [each.feeding.mean for each in options]
    )
    return [options[k] for k in kept]


# ----------------------------------------------------------------
# A robust design, and what others get of it: plain tables for JSON, and a folder with scene, answer, certificates.


@dataclass(frozen=True, eq=False)
class RobustDesign(Tabled):
    """A design for a large margin.

    Attributes
    ----------
    scene : Scene
        The design, with [goal] (the first of `goals`) and [tolerance].
    goals : tuple of Goal
        What has to hold, all of it.
    x, side : float, int
        Where parts are fed [length].
    varied : tuple of str
        What was varied.
    tolerance : dict of str to str
        What the margin multiplies.
    sampled : Estimate
        Its margin by floats, and the effect of each quantity.
    margins : tuple of Margin
        Proved and refuted, one for each of `goals`; empty where no proof was asked for.
    lead : Counterweight
        The point mass that makes it of a plate.
    feeding : ThrowsToFeed
        Throws to feed, sampled.
    front : tuple of Option
        Designs that no other one beats both in margin and in throws, by floats; the surest first.
    history : tuple of Candidate
        Every design tried that feeds at all.
    before : Scene
        Where the search began.
    before_sampled : Estimate or None
        The margin there, at the best X there, by floats.
    before_margins : tuple of Margin
        The same, proved and refuted.
    before_feeding : ThrowsToFeed or None
        Throws to feed there, sampled.
    evaluations : int
        Designs looked at.
    seconds : float
        Time of the search, without proofs.
    """

    scene: Scene
    goals: tuple[Goal, ...]
    x: float
    side: int
    varied: tuple[str, ...]
    tolerance: dict[str, str]
    sampled: Estimate
    margins: tuple[Margin, ...]
    lead: Counterweight
    feeding: ThrowsToFeed
    front: tuple[Option, ...]
    history: tuple[Candidate, ...]
    before: Scene
    before_sampled: Estimate | None
    before_margins: tuple[Margin, ...]
    before_feeding: ThrowsToFeed | None
    evaluations: int
    seconds: float

    @property
    def ratio(self) -> float | None:
        """What is proved of the design over what is refuted of the scene before: so often larger at least."""
        proved, refuted = both(self.margins)[0], both(self.before_margins)[1]
        return None if proved is None or not refuted else proved / refuted

    @property
    def model(self) -> Model:
        """Of which model the design is, and which facts of the scene that leaves out."""
        return Model.of(self.scene)

    @property
    def _values(self) -> dict[str, tuple[float, float]]:
        """Of the sides, and of what was varied: before and after."""
        sides = self.scene.text["part"].get("sides", ())
        names = (*(f"part.sides[{k}]" for k in range(len(sides))), *self.varied)
        return {name: (self.before.value(name), self.scene.value(name)) for name in names}

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        before = self.before
        rows = [
            (name, *(in_unit_of(before, name, value) for value in pair), unit_of(before, name))
            for name, pair in self._values.items()
        ]
        columns = ("quantity", Column("before", show=".6g"), Column("design", show=".6g"), "unit")
        table = Table(columns, rows, f"{self.scene.name}: robust design", self.model.sentence)
        return table, *((joined(self.margins),) if self.margins else ())

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON; every number is finite or null."""
        before, values = ({name: pair[k] for name, pair in self._values.items()} for k in (0, 1))
        return as_table(
            scene=self.scene.as_dict(),
            **picked(self, "x", "side", "tolerance"),
            values=values,
            before=before,
            **picked(self, "sampled", "margins", "before_sampled", "before_margins", "ratio"),
            lead=self.lead._asdict(),
            throws=self.feeding,
            before_throws=self.before_feeding,
            **picked(self, "front", "evaluations"),
            model=self.model,
            timings={"search": self.seconds},
        )

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write the scene, the answer as JSON, and what `limitsets.recheck` checks of the margin; checked before."""
        return save(self, Path(folder))[1]


def both(margins: Sequence[Margin]) -> tuple[float | None, float | None]:
    """Give the factor to which all goals are proved, and that at which one is refuted; None where not known."""
    refuted = [one.refuted for one in margins if one.refuted is not None]
    return min((one.proved for one in margins), default=None), min(refuted, default=None)


def save(
    design: RobustDesign, folder: Path, *, recheck: bool = True
) -> tuple[RobustDesign, tuple[Path, ...]]:
    """Write scene, answer, and what `limitsets.recheck` checks; return the design without what it denies, the files."""
    folder.mkdir(parents=True, exist_ok=True)
    scene, answer = folder / f"{design.scene.name}.toml", folder / "design.json"
    dump(design.scene, scene)
    left = replace(design, margins=tuple(settled(one, folder, recheck=recheck) for one in design.margins))
    answer.write_text(as_json(left.to_json()), encoding="utf-8", newline="\n")
    return left, (scene, answer, *(folder / name for one in left.margins for name in one.files))
