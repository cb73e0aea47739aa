"""Trials of assembly, run anywhere and counted with their intervals: `limitsets.assemble`."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked,
    as_table,
    shown_in_notebooks,
)
from limitsets.base.campaign import Row, finished_trials
from limitsets.cell.assembly.pairing import Pair, Start, pair_of, require_apart, seats_of
from limitsets.cell.assembly.trials import Pushed, Question, pass_through, push
from limitsets.cell.feeding.falling import FATES
from limitsets.feeder.engine.member import Recording
from limitsets.feeder.scattering import Scattering
from limitsets.feeder.scene import Scene
from limitsets.parameters.noise.sampling import binomial_interval, require_seed

# ----------------------------------------------------------------
# Rates with their intervals, the joint law of two fates, and shares of trials in which outlines overlap.


@dataclass(frozen=True)
class Rate:
    """A share of trials.

    Attributes
    ----------
    count, of : int
        So many of so many trials.
    share : float
        Their ratio.
    interval : (float, float)
        Of Clopper and Pearson, 95 %.
    """

    count: int
    of: int
    share: float
    interval: tuple[float, float]


def rate_of(count: int, of: int) -> Rate:
    """Give a rate with its interval.

    Examples
    --------
    >>> [round(end, 3) for end in rate_of(11, 20).interval]
    [0.315, 0.769]
    """
    return Rate(count, of, count / of, binomial_interval(count, of))


@dataclass(frozen=True)
class Overlaps:
    """Trials in which the outlines of parts that pass through each other overlap while both are on the arm.

    Attributes
    ----------
    ever, at_start, at_rest, in_flight : Rate
        At any time; before the first throw; after some throw; during some throw.
    """

    ever: Rate
    at_start: Rate
    at_rest: Rate
    in_flight: Rate


@dataclass(frozen=True)
class Joint:
    """The joint law of both parts' fates.

    Attributes
    ----------
    table : dict of str to dict of str to int
        Trials by the first part's fate, and by the second's.
    rates : tuple of Rate
        Right feeds of each part by itself: the marginals.
    both : Rate
        Both are fed rightly, in whatever order.
    product : float
        Of the marginals: what independent parts would do.
    error : float
        The product less the share of both: what multiplying is off by.
    error_interval : (float, float)
        Of that, 95 %, to first order: the trials' spread of (both - p1 [2 right] - p2 [1 right]).
    serial : (float, float)
        Interval of the product, 95 %: the rate of feeding serially, one part after the other, or with two arms, where
        the order is certain.
    """

    table: dict[str, dict[str, int]]
    rates: tuple[Rate, Rate]
    both: Rate
    product: float
    error: float
    error_interval: tuple[float, float]
    serial: tuple[float, float]


def joint_of(rows: Sequence[Mapping[str, Any]]) -> Joint:
    """Count pairs of fates."""
    of = len(rows)
    pairs = [tuple(row["fates"]) for row in rows]
    table = {one: {two: pairs.count((one, two)) for two in FATES} for one in FATES}
    right = [(one == "right", two == "right") for one, two in pairs]
    first, second = (rate_of(sum(each[k] for each in right), of) for k in (0, 1))
    both = rate_of(sum(one and two for one, two in right), of)
    product = first.share * second.share
    terms = [first.share * two + second.share * one - (one and two) for one, two in right]
    mean = sum(terms) / of
    spread = 1.96 * math.sqrt(sum((term - mean) ** 2 for term in terms) / max(of - 1, 1) / of)
    error = product - both.share
    # each marginal at 97.5 %, so that both hold at 95 %
    ends = [binomial_interval(rate.count, of, 0.975) for rate in (first, second)]
    return Joint(
        table,
        (first, second),
        both,
        product=product,
        error=error,
        error_interval=(error - spread, error + spread),
        serial=(ends[0][0] * ends[1][0], ends[0][1] * ends[1][1]),
    )


# ----------------------------------------------------------------
# Trials of assembly, run anywhere and counted: `limitsets.assemble`.


TRIALS, CHUNK = 2000, 10
SERIES = 20


@dataclass(frozen=True)
class Series:
    """Trials to be made, as workers are sent them: the scenes as JSON, the noise, how parts meet, and the seed."""

    scenes: tuple[str, str]
    scatter: Scattering
    contact: str | None
    carried: bool
    apart: bool
    starts: tuple[Start, Start] | None
    seed: int

    def question(self) -> dict[str, Any]:
        """Give what is asked, for the file of the trials: everything but how many they are."""
        scenes = [json.loads(text) for text in self.scenes]
        return asdict(self) | {"scenes": scenes, "scatter": self.scatter.words()}

    def row(self, number: int) -> Row:
        """Make a trial."""
        if self.contact is not None:
            return asdict(self.pushed(number)[0])
        pair = _read(self.scenes, self.scatter)
        passed = pass_through(pair, self.seed, number, apart=self.apart, starts=self.starts)
        return {"outcome": passed.outcome, **asdict(passed)}

    def pushed(self, number: int, last: int | None = None) -> tuple[Pushed, Recording]:
        """Make a trial in contact, and keep poses from throw `last` on."""
        pair, how = _read(self.scenes, self.scatter), Question(self.contact or "hinge", self.carried)
        return push(pair, self.seed, number, how, starts=self.starts, last=last)


@lru_cache(maxsize=4)
def _read(scenes: tuple[str, str], scatter: Scattering) -> Pair:
    return pair_of(json.loads(scenes[0]), json.loads(scenes[1]), scatter)


ENDED = {
    "assembled": "assembled",
    "ejected": "a part came out of the cavity again",
    "order": "the second part lies below the first",
    "wrong": "stuck in a wrong orientation",
    "wall": "stuck at the wall",
    "edge": "assumed not fed: a throw acts beyond the end",
    "left": "a part left the arm otherwise",
    "never": "a part stays on the arm",
    "unfinished": "still in motion",
}
"""Outcomes, and what they are for people."""
OUTCOMES = tuple(ENDED)


@dataclass(frozen=True, eq=False)
class Assembly(Tabled):
    """What became of pairs of parts.

    Attributes
    ----------
    pair : Pair
        Both parts, the end of the arm, and the noise.
    series : Series
        What was asked.
    rows : tuple of mapping
        The trials by number: `limitsets.cell.assembly.trials.Passed`, or `limitsets.cell.assembly.trials.Pushed` with
        contact.
    """

    pair: Pair
    series: Series
    rows: tuple[Row, ...]

    @property
    def contact(self) -> str:
        """How the parts meet: "none", "hinge" or "unilateral"."""
        return self.series.contact or "none"

    @property
    def counts(self) -> dict[str, int]:
        """How many trials ended in each way."""
        return dict.fromkeys(OUTCOMES, 0) | Counter(row["outcome"] for row in self.rows)

    @property
    def assembled(self) -> Rate:
        """The rate of assembly, with its interval."""
        return rate_of(self.counts["assembled"], len(self.rows))

    @property
    def first_series(self) -> Rate:
        """The rate of assembly in the first 20 trials, or in all where there are fewer."""
        first = self.rows[:SERIES]
        return rate_of(sum(row["outcome"] == "assembled" for row in first), len(first))

    @property
    def overlaps(self) -> Overlaps | None:
        """Shares of the trials in which the outlines overlap; None with contact."""
        if self.series.contact is not None:
            return None
        names = ("overlap_at_start", "overlap_at_rest", "overlap_in_flight")
        seen = [[bool(row[name]) for name in names] for row in self.rows]
        counts = (sum(map(any, seen)), *map(sum, zip(*seen, strict=True)))
        return Overlaps(*(rate_of(count, len(seen)) for count in counts))

    @property
    def joint(self) -> Joint | None:
        """The joint law of both fates, and the error that multiplying makes; None with contact."""
        return joint_of(self.rows) if self.series.contact is None else None

    @property
    def misfit(self) -> str | None:
        """Why the parts cannot lie in the cavity one on the other, whatever their fates; None where they fit."""
        try:
            seats_of(self.pair)
        except AnswerError as error:
            return f"{error.thing}: {error.value}"
        return None

    @property
    def survived(self) -> dict[str, Rate]:
        """Assembled pairs that are whole after one more throw: with a standing cavity, and with one that is thrown."""
        whole = {name: [row.get(f"survives_{name}") for row in self.rows] for name in ("standing", "carried")}
        known = {name: [each for each in thrown if each is not None] for name, thrown in whole.items()}
        return {name: rate_of(sum(thrown), len(thrown)) for name, thrown in known.items() if thrown}

    def example(self, outcome: str) -> int | None:
        """Give the number of the first trial that ended so."""
        return next((k for k, row in enumerate(self.rows) if row["outcome"] == outcome), None)

    def film(self, number: int, throws: int = 1) -> Recording:
        """Make a trial with contact again, and keep the poses of its last throws.

        Raises
        ------
        AnswerError
            Parts that pass through each other are not in the engine; no trial has this number.
        """
        if self.series.contact is None:
            remedy = "switch contact on in both scenes: [effects] contact = true"
            raise AnswerError("the film", "of parts without contact", "trials in the engine", remedy)
        if not 0 <= number < len(self.rows):
            raise AnswerError("the trial", number, f"0 to {len(self.rows) - 1}", "name one that was made")
        return self.series.pushed(number, max(max(self.rows[number]["throws"]) - throws + 1, 1))[1]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        count = len(self.rows)
        rows = [
            (ENDED[name], name, met, count, rate_of(met, count).interval) for name, met in self.counts.items()
        ]
        interval = Column("95 % interval", show=".4f", ends=True)
        columns = ("what becomes of a pair", "outcome", "met", "trials", interval)
        one, two = self.pair.scenes
        return (Table(columns, rows, f"{one.name} below, {two.name} on top", "sampled, not proved"),)

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it: docs/json.md."""
        one, two = self.pair.scenes
        return as_table(
            scenes=[one.name, two.name],
            unit=one.unit,
            contact=self.contact,
            carried=self.series.carried,
            misfit=self.misfit,
            overlaps=self.overlaps,
            trials=len(self.rows),
            seed=self.series.seed,
            scatter=self.pair.scatter.words() or None,
            counts=self.counts,
            assembled=self.assembled,
            first_series={"of": self.first_series.of, "assembled": self.first_series.count},
            joint=self.joint,
            survived=self.survived or None,
        )


@shown_in_notebooks
@arguments_checked
def assemble(
    scene: Scene | str | Path | Mapping[str, Any],
    scene2: Scene | str | Path | Mapping[str, Any],
    scatter: Scattering | None = None,
    *,
    contact: str | None = None,
    carried: bool = True,
    apart: bool | None = None,
    starts: Sequence[Start] | None = None,
    trials: int = TRIALS,
    seed: int = 0,
    file: str | Path | None = None,
    executor: Executor | None = None,
    cluster: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Assembly:
    """Throw pairs of parts along an arm with a cavity at its end, and count what becomes of them.

    Parameters
    ----------
    scene, scene2 : Scene, str, Path or mapping
        The part that is to lie below, and the one on top of it; arm, throw and cavity are the same in both.
    scatter : Scattering, optional
        Random noise of every throw; default the scenes'.  The speed's is common, each landing has its own.
    contact : str, optional
        How a struck corner meets the arm where the scenes have ``contact = true``: ``"hinge"`` (default) or
        ``"unilateral"``.  Without contact in the scenes the parts pass through each other, and the map alone throws.
    carried : bool
        With contact: whether the cavity is part of the arm, and thrown with what lies in it, as the paper's was.
    apart : bool, optional
        Whether random starts are those of parts that do not overlap; default with contact, where they have to be.
    starts : pair of (float, int), optional
        x and side of each part, instead of random ones.
    trials, seed : int
        Trial number k of a seed draws the same whatever the workers.
    file : str or Path, optional
        Finished trials are kept there; the same call goes on with what is left.
    executor : concurrent.futures.Executor, optional
        It makes the trials.
    cluster : str, optional
        Instead: the address of a Dask scheduler.
    workers : int, optional
        Instead: so many processes on this machine.  By default all happens in this one.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    Assembly

    Raises
    ------
    AnswerError
        Scenes that differ in arm, throw or cavity; parts that overlap at the start; a file of other trials.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.assemble("paper-triangle", "paper-quadrilateral", trials=20)
    >>> found.contact, len(found.rows), found.joint.rates[0].share
    ('none', 20, 1.0)
    """
    pair = pair_of(scene, scene2, scatter)
    if trials < 1:
        raise AnswerError("the trials", trials, "1 or more", "throw some parts")
    require_seed(seed)
    if not pair.contact and (contact is not None or not carried):
        remedy = "switch it on in both scenes: [effects] contact = true"
        raise AnswerError("effects.contact", False, "true, for trials in the engine", remedy)
    if contact not in (None, "hinge", "unilateral"):
        raise AnswerError("the contact", contact, "'hinge' or 'unilateral'", "choose one")
    how = (contact or "hinge") if pair.contact else None
    if apart is False and how is not None:
        raise AnswerError("the starts", "overlapping", "parts that do not overlap", "leave apart out")
    given = None if starts is None else require_apart(pair, starts)
    one, two = (json.dumps(each.as_dict()) for each in pair.scenes)
    series = Series(
        (one, two),
        pair.scatter,
        how,
        carried=carried and pair.contact,
        apart=bool(how if apart is None else apart),
        starts=given,
        seed=seed,
    )
    rows = finished_trials(
        series,
        trials,
        CHUNK,
        "assembly",
        "trials",
        file=file,
        executor=executor,
        cluster=cluster,
        workers=workers,
        progress=progress,
    )
    return Assembly(pair, series, rows)
