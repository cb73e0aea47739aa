"""The Pareto front of the designs tried, in margin and in throws to feed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from limitsets.files import as_table, picked
from limitsets.inverse.margin.feeding import ThrowsToFeed, throws_to_feed
from limitsets.inverse.margin.search import Candidate, DesignSearch
from limitsets.robust.margins.estimate import on_all_corners

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
            **picked(one, "values", "order"), **picked(one.found, "margin", "x"), throws=self.feeding
        )


def unbeaten(margin: Sequence[float], throws: Sequence[float]) -> list[int]:
    """Give the numbers of those that no other beats in both: more margin with no more throws, or fewer with no less.

    Examples
    --------
    >>> unbeaten([3.0, 2.0, 1.0, 2.5], [30.0, 20.0, 25.0, 30.0])
    [0, 1]
    """
    order = sorted(range(len(margin)), key=lambda k: (-margin[k], throws[k]))
    found: list[int] = []
    for k in order:
        if not found or throws[k] < throws[found[-1]]:
            found.append(k)
    return found


def front_of(
    searches: Sequence[DesignSearch],
    history: Sequence[Candidate],
    own: Option,
    side: int,
    seed: int,
    tell: Callable[[str, int, int], None],
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
    known = [each for each in history if each.found.margin > 0.0 and np.isfinite(each.found.x)]
    if not known:
        return (own,)
    margins = np.array([each.found.margin for each in known])
    which = np.minimum((CLASSES * margins / margins.max()).astype(int), CLASSES - 1)
    chosen = []
    for number in range(CLASSES):
        mine = np.flatnonzero(which == number)
        # a lower X against the reach is reached sooner: of each class those, besides the surest
        early = [known[k].found.x / known[k].found.reach for k in mine]
        chosen += [int(k) for k in mine[np.argsort(early)[:PER_CLASS]]]
    chosen += [int(k) for k in np.argsort(-margins)[:PER_CLASS]]
    options = [own]
    for number, k in enumerate(dict.fromkeys(chosen)):
        tell("throws to feed", number, len(chosen))
        option = _option(known[k], searches[known[k].order], side, seed)
        if option is not None:
            options.append(option)
    return _sure(options, searches, side, seed, tell)


def _sure(
    options: list[Option],
    searches: Sequence[DesignSearch],
    side: int,
    seed: int,
    tell: Callable[[str, int, int], None],
) -> tuple[Option, ...]:
    """Rate again on all corners whatever stands on the front, until all that does has been; the first one has been.

    The search knew some corners only: a rating from then may be too high, and hides designs that are better on all.
    """
    sure = [options[0]]
    for number in range(MOST_SURE):
        option = next((each for each in best_of(options) if each not in sure), None)
        if option is None:
            break
        tell("designs on all corners", number, MOST_SURE)
        options.remove(option)
        one, search = option.candidate, searches[option.candidate.order]
        found = on_all_corners(
            search.scene.with_values(dict(one.values)), search.tolerance, side, search.hard
        )
        if found is not None and found.margin > 0.0:
            again = _option(replace(one, found=found), search, side, seed)
            sure += [] if again is None else [again]
            options += [] if again is None else [again]
    return tuple(best_of(sure))


def _option(one: Candidate, search: DesignSearch, side: int, seed: int) -> Option | None:
    """Count the throws of a design at its best X; None if not every start is fed."""
    feeding = throws_to_feed(search.scene.with_values(dict(one.values)), one.found.x, side, seed=seed)
    return Option(one, feeding) if feeding.fed == feeding.starts else None


def best_of(options: Sequence[Option]) -> list[Option]:
    """Keep the options that no other beats in both, the surest first."""
    kept = unbeaten(
        [each.candidate.found.margin for each in options], [each.feeding.mean for each in options]
    )
    return [options[k] for k in kept]
