"""Brackets of the probabilities of absorption, of quantiles and means, for a scene that scatters: what is proved.

Within n throws both bounds come from n steps from V_0 = 1 on the target; the mean number of throws has a bound from
below and one from above (`limitsets/checker/brackets.py`).
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Table,
    Tabled,
    added_up,
    arguments_checked,
    as_table,
    picked,
    shown,
    shown_in_notebooks,
)
from limitsets.base.arrays import Array
from limitsets.feeder.scattering import Scattering, scattering_of, starts_from
from limitsets.numbers.interval import guard
from limitsets.proofs.chances.absorption_of_map import chain_of_map, whole_grid
from limitsets.proofs.chances.chain import EXITS, Chain, Place, chain_of, require_places, write
from limitsets.proofs.chances.forever import forever
from limitsets.proofs.prover.certifying import require_cells, require_map, require_none
from limitsets.proofs.prover.noise_of_map import Bounds, Noise
from limitsets.systems.maps import coerce

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene


# ----------------------------------------------------------------
# Brackets of where a noisy chain ends, and when.


# Any absorbing set or exit.
ANY = "any"
# A certificate claims slightly wider brackets than the proof gives: see `chain`.
ALLOWANCE = 1e-6


@dataclass(frozen=True, eq=False)
class AbsorptionBrackets(Tabled):
    """Proved brackets of where a noisy chain ends, and when; T is the throw of the first absorption.

    Attributes
    ----------
    source, upper : Scene, or NamedTuple
        The scene, twice; or the corners of the map's parameters: bounds hold for all between, others at every step too.
    scene, unit : str
        Name of the scene or map, unit of lengths.
    scatter : Scattering or Noise
        The laws of what differs at every throw.
    absorbing : dict of str to tuple of (int, float, float)
        By name side, from x, to x of the places that absorb [length]; the exits ("exits") do too.
    starts : tuple of (int, float, float)
        Side, from x, to x: starts are equally likely per length on all of these [length].
    chain : Chain
        The chain on its cells: functions are affine between neighbouring nodes of a side (`chain.nodes`).
    within : dict of str to ndarray, shape (2, throws + 1)
        By name bounds of the probability of having ended there after 0, 1, ... throws; "any" is that of T <= n.
    values : dict of str to ndarray, shape (2, n_nodes)
        By name the bounds at the nodes after the last throw, for starts there; they belong to `chain.steps.mesh`, which
        has two far nodes more on each side.
    mean : (float, float)
        Bounds of the mean of T; the upper one is infinite where no finite bound is proved.
    ever : dict of str to (float, float)
        By name bounds of the probability of ever ending there, after any number of throws; empty without `mean`.
    functions : dict of str to ndarray
        The functions at the nodes that prove `mean` and `ever`, as a certificate has them.
    seconds : float
        Time it took.
    how : str
        "proved".
    """

    source: Any
    upper: Any
    scene: str
    unit: str
    scatter: Scattering | Noise
    absorbing: dict[str, tuple[Place, ...]]
    starts: tuple[Place, ...]
    chain: Chain
    within: dict[str, Array]
    values: dict[str, Array]
    mean: tuple[float, float]
    ever: dict[str, tuple[float, float]]
    functions: dict[str, Array]
    seconds: float
    how: str = "proved"

    @property
    def step(self) -> str:
        """What is counted: throws of a scene, steps of a map."""
        return "throws" if isinstance(self.scatter, Scattering) else "steps"

    def quantile(self, share: float, name: str = ANY) -> tuple[int | None, int | None]:
        """Bound the number of throws within which `share` of the starts end there; None beyond the throws counted.

        Parameters
        ----------
        share : float
            From 0 to 1.
        name : str
            Of the places; all of them by default.
        """
        low, high = self.within[name]
        first, last = np.flatnonzero(high >= share), np.flatnonzero(low >= share)
        return (int(first[0]) if first.size else None), (int(last[0]) if last.size else None)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        last = self.within[ANY].shape[1] - 1
        rows = [(name, str(last), (low[-1], high[-1])) for name, (low, high) in self.within.items()]
        rows += [(name, "any number of", pair) for name, pair in self.ever.items()]
        columns = ("ends at", f"within {self.step}", Column("probability", show=".6f", ends=True))
        return (Table(columns, rows, f"{self.scene}: brackets of probabilities", self.how),)

    def to_json(self) -> dict[str, Any]:
        """Give the brackets as JSON takes them."""
        corners = (
            {} if self.step == "throws" else {"parameters": [self.source._asdict(), self.upper._asdict()]}
        )
        return as_table(
            **corners,
            **picked(self, "scene", "unit", "how", "absorbing", "starts", "seconds"),
            scatter=self.scatter.words(),
            cells=self.chain.nodes.place.size - self.chain.nodes.first.size + 1,
            within={name: {"lo": lo, "hi": hi} for name, (lo, hi) in self.within.items()},
            ever={name: {"lo": lo, "hi": hi} for name, (lo, hi) in self.ever.items()},
            mean={"lo": self.mean[0], "hi": self.mean[1] if math.isfinite(self.mean[1]) else None},
            quantiles={
                str(share): dict(zip(("lo", "hi"), self.quantile(share), strict=True))
                for share in (0.5, 0.95, 0.99)
            },
        )

    def save(
        self,
        path: str | Path,
        *,
        allowance: float = ALLOWANCE,
        recheck: bool = True,
        workers: int | None = 1,
    ) -> Path:
        """Write the brackets as a certificate, which gets its name once the checker has made the steps anew.

        Parameters
        ----------
        path : str or Path
            The file, NAME.proof.zip; an older one is replaced whole.
        allowance : float
            The claimed brackets are wider by this at both ends; bounds of the mean by this times the number of throws.
        recheck : bool
            Whether to check it first: from seconds to as long as the proof.
        workers : int, optional
            Processes that check it, as in `limitsets.recheck`.

        Raises
        ------
        DeniedError
            The checker's own brackets are wider than what is claimed; the file is kept as NAME.denied.zip.

        Examples
        --------
        >>> import tempfile
        >>> import limitsets as ls
        >>> from limitsets.robust import Scattering, Uniform, absorption_brackets
        >>> noise = Scattering(landing=Uniform(0.1))
        >>> brackets = absorption_brackets("paper-initial", noise, right=(20, 2), cells=300, throws=3, mean=False)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ls.recheck(brackets.save(f"{folder}/initial.proof.zip")).verdict
        'proved'
        """
        forever = self.mean, self.ever, self.functions
        write(path, self.chain, self.within, forever, allowance=allowance, recheck=recheck, workers=workers)
        return Path(path)


# ----------------------------------------------------------------
# Brackets of the probabilities of absorption, of quantiles and means, for a scene whose throws scatter.


CELLS, THROWS = 4000, 200
# What a certificate takes.
MOST_THROWS, MOST_PLACES, MOST_NAMES, LONGEST = 2000, 1000, 99, 80


@shown_in_notebooks
@arguments_checked
def absorption_brackets(
    scene: Any,
    scatter: Any = None,
    *,
    right: tuple[float, int] | None = None,
    wrong: float | None = None,
    absorbing: Mapping[str, Sequence[Place]] | None = None,
    starts: Sequence[Place] | None = None,
    cells: int | None = None,
    throws: int = THROWS,
    mean: bool = True,
    upper: Any = None,
    noise: Bounds | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> AbsorptionBrackets:
    """Prove brackets of the probabilities with which parts, or orbits, end at places, and of how long that takes.

    ``absorption_brackets(scene, scatter, right=...)`` of a scene, ``absorption_brackets(map, grid, noise=e,
    absorbing=...)`` of a map of a line, whose orbits also end where they leave the grid.

    Parameters
    ----------
    scene : Scene, str or NamedTuple
        A scene in the minimal model, or the name of one; or a map of one coordinate, or the lower corner of a box of
        its parameters.
    scatter : Scattering or Grid, optional
        Of a scene: uniform or Gaussian deviations of speed and landing place, independent of each other and of other
        throws; by default that of the scene.  Of a map: the cells.
    right : (float, int), optional
        Of a scene: x and side: a part at rest at x or beyond, on this side, has ended "right" [length].
    wrong : float, optional
        Of a scene: x: at rest there or beyond, on any other side, it has ended "wrong"; needs `right` [length].
    absorbing : mapping of str to sequence of (int, float, float), optional
        Further places where parts or orbits end: by name side, from x, to x [length].
    starts : sequence of (int, float, float), optional
        Side, from x, to x: equally likely per length on all of them.  By default on every side from a twentieth of the
        arm beyond a_i to x of `right`; of a map all of the grid [length].
    cells : int, optional
        Of a scene: cells per side, by default 4000; the brackets narrow with their square.
    throws : int
        n up to which probabilities within n throws or steps are bounded.
    mean : bool
        Bound the mean of T too, and the probabilities of ever ending at a place: some hundreds of throws more.
    upper : NamedTuple, optional
        Of a map: the upper corner of the parameters; they may be others at every step.
    noise : float or mapping of str to float, optional
        Of a map: each step lands evenly within this distance of the image; or by name what deviates evenly, and anew at
        every step: "landing", and a parameter.  [length, or that of the parameter]
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    AbsorptionBrackets

    Raises
    ------
    AnswerError
        Places or starts that are none, a law or an effect of which nothing is proved, so small a kappa that the
        impact may not be unique, or arguments of the other kind.

    Examples
    --------
    >>> from limitsets.robust import Scattering, Uniform, absorption_brackets
    >>> noise = Scattering(speed=Uniform(0.003), landing=Uniform(0.02))
    >>> brackets = absorption_brackets("paper-designed", noise, right=(20.5, 2), cells=500, throws=5, mean=False)
    >>> low, high = brackets.within["right"][:, 5]
    >>> bool(low < 0.222 < high < low + 0.05)
    True
    >>> import limitsets as ls
    >>> def halved(x): return 0.5 * x
    >>> top, below = {"top": [(0, 1.0, 3.0)]}, [(0, 0.0, 1.0)]  # a step from x ends there with probability x/4
    >>> grid = ls.grid([(0.0, 3.0)], cells=300)
    >>> ends = absorption_brackets(ls.map(halved), grid, noise=1.0, absorbing=top, starts=below)
    >>> [round(end, 4) for end in (*ends.ever["top"], *ends.mean)]
    [0.25, 0.25, 2.0, 2.0]
    """
    from limitsets.feeder.scene import Scene, load

    begun = time.perf_counter()
    guard()
    tell = progress or (lambda stage, done, total: None)
    if not 0 <= throws <= MOST_THROWS:
        raise AnswerError("the throws counted", throws, f"0 to {MOST_THROWS}", "`ever` is of any number")
    if starts is not None:
        starts = _places("starts", starts)
    if isinstance(scene, Scene | str):
        require_none({"upper": upper, "noise": noise}, "absorption_brackets", "beside a scene")
        read = load(scene)
        law = scattering_of(read) if scatter is None else scatter
        require_cells(cells, "absorption bracket")
        places = absorbing_places(read, right, wrong, absorbing)
        begin = tuple(default_starts(read, right) if starts is None else starts)
        require_places(read, "a start", begin)
        told = added_up("cells", len(read.sides) * (cells or CELLS), tell)
        chain = chain_of(read, law, begin, places, cells or CELLS, told)
        who = read, read, read.name, read.unit
    else:
        other = {"right": right, "wrong": wrong, "cells": cells}
        require_none(other, "absorption_brackets", "beside a map")
        require_map(scene, scatter, None, "absorption_brackets")
        read, corner = coerce(scene), coerce(scene if upper is None else upper)
        places = _named_places(absorbing, {})
        begin = tuple(whole_grid(scatter) if starts is None else starts)
        chain, law = chain_of_map(read, corner, scatter, noise, begin, places)
        who = read, corner, type(read).__name__, ""
    from limitsets.checker.absorption import brackets_of

    within, values = {}, {}
    for name in (ANY, *chain.steps.absorbed):
        told_of = partial(_told, partial(tell, name), throws)
        pair, values[name] = brackets_of(chain.steps, chain.row, name, throws + 1, told_of)
        within[name] = pair.T
    tell("mean", 0, 1)
    means, ever, functions = forever(chain, places, values) if mean else ((0.0, math.inf), {}, {})
    tell("mean", 1, 1)
    return AbsorptionBrackets(
        *who,
        scatter=law,
        absorbing={name: tuple(each) for name, each in places.items()},
        starts=begin,
        chain=chain,
        within=within,
        values=values,
        mean=means,
        ever=ever,
        functions=functions,
        seconds=time.perf_counter() - begun,
    )


def _told(tell: Callable[[int, int], None], of: int, done: int) -> None:
    tell(done, of)


def absorbing_places(
    scene: Scene,
    right: tuple[float, int] | None,
    wrong: float | None,
    absorbing: Mapping[str, Sequence[Place]] | None,
) -> dict[str, list[Place]]:
    """Collect the absorbing places by name."""
    absorbers: dict[str, list[Place]] = {}
    if right is not None:
        absorbers["right"] = [(int(right[1]), float(right[0]), math.inf)]
    if wrong is not None:
        if right is None:
            raise AnswerError(
                "the places that are wrong", wrong, "x, with `right`", "say which side is right"
            )
        absorbers["wrong"] = [
            (k, float(wrong), math.inf) for k in range(len(scene.sides)) if k != int(right[1])
        ]
    absorbers |= _named_places(absorbing, absorbers)
    for name, each in absorbers.items():
        require_places(scene, f'a place that is "{name}"', each)
    return absorbers


def _named_places(
    absorbing: Mapping[str, Sequence[Place]] | None, taken: Mapping[str, object]
) -> dict[str, list[Place]]:
    """Read further places by name."""
    if len(absorbing or {}) > MOST_NAMES:
        raise AnswerError(
            "the names of absorbing places", len(absorbing or {}), f"at most {MOST_NAMES}", "join some"
        )
    for name in absorbing or {}:
        if name in (*taken, ANY, EXITS):
            raise AnswerError("the name of absorbing places", name, "one that is not taken", "choose another")
        if not isinstance(name, str) or not re.fullmatch(rf"[!-~]{{1,{LONGEST}}}", name):
            allowed = f"1 to {LONGEST} letters, digits and signs of ASCII, without blanks"
            raise AnswerError("the name of absorbing places", name, allowed, "choose another")
    return {name: _places(f'places "{name}"', places) for name, places in (absorbing or {}).items()}


def _places(thing: str, places: Sequence[Place]) -> list[Place]:
    """Read places."""
    if not 1 <= len(places) <= MOST_PLACES:
        raise AnswerError(
            f"the number of {thing}", len(places), f"1 to {MOST_PLACES}", "give (side, from x, to x)"
        )
    try:
        return [(int(side), float(lo), float(hi)) for side, lo, hi in places]
    except (TypeError, ValueError):
        raise AnswerError(thing, shown(places), "(side, from x, to x) each", "correct them") from None


def default_starts(scene: Scene, right: tuple[float, int] | None) -> list[Place]:
    """Give the starts where none are named: on every side from a twentieth of the arm beyond a_i to x of `right`."""
    if right is None:
        raise AnswerError("the starts", "none", "(side, from x, to x)", "pass starts=[...], or `right`")
    x = float(right[0])
    return [(k, float(lo), x) for k, lo in enumerate(starts_from(scene)) if lo < x]
