"""Brackets of the probabilities of absorption, of quantiles and means, for a scene that scatters: what is proved.

Within n throws both bounds come from n steps from V_0 = 1 on the target; the mean number of throws has a bound from
below and one from above (`limitsets/checker/brackets.py`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import AnswerError, Column, Table, Tabled, added_up, as_table, picked, shown_in_notebooks
from limitsets.base.arrays import Array
from limitsets.feeder.scattering import Scattering, scattering_of, starts_from
from limitsets.numbers.interval import guard
from limitsets.proofs.chances.chain import EXITS, Chain, Place, chain_of, require_places, write
from limitsets.proofs.chances.forever import forever
from limitsets.proofs.prover.certifying import require_cells

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
    source : Scene
        The scene.
    scene, unit : str
        Name of the scene, unit of lengths.
    scatter : Scattering
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

    source: Scene
    scene: str
    unit: str
    scatter: Scattering
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
        columns = ("ends at", "within throws", Column("probability", show=".6f", ends=True))
        return (Table(columns, rows, f"{self.scene}: brackets of probabilities", self.how),)

    def to_json(self) -> dict[str, Any]:
        """Give the brackets as JSON takes them."""
        return as_table(
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

    def save(self, path: str | Path, *, allowance: float = ALLOWANCE, recheck: bool = True) -> Path:
        """Write the brackets as a certificate, which gets its name once the checker has made the steps anew.

        Parameters
        ----------
        path : str or Path
            The file, NAME.proof.zip; an older one is replaced whole.
        allowance : float
            The claimed brackets are wider by this at both ends; bounds of the mean by this times the number of throws.
        recheck : bool
            Whether to check it first: from seconds to as long as the proof.

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
        return write(path, self.chain, self.within, forever, allowance=allowance, recheck=recheck)


# ----------------------------------------------------------------
# Brackets of the probabilities of absorption, of quantiles and means, for a scene whose throws scatter.


CELLS, THROWS = 4000, 200


@shown_in_notebooks
def absorption_brackets(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    right: tuple[float, int] | None = None,
    wrong: float | None = None,
    absorbing: Mapping[str, Sequence[Place]] | None = None,
    starts: Sequence[Place] | None = None,
    cells: int = CELLS,
    throws: int = THROWS,
    mean: bool = True,
    progress: Callable[[str, int, int], None] | None = None,
) -> AbsorptionBrackets:
    """Prove brackets of the probabilities with which parts end at places, and of how many throws that takes.

    Parameters
    ----------
    scene : Scene or str
        A scene in the minimal model, or the name of one.
    scatter : Scattering, optional
        Uniform or Gaussian deviations of speed and landing place, independent of each other and of other throws; by
        default that of the scene.
    right : (float, int), optional
        x and side: a part at rest at x or beyond, on this side, has ended "right" [length].
    wrong : float, optional
        x: at rest there or beyond, on any other side, it has ended "wrong"; needs `right` [length].
    absorbing : mapping of str to sequence of (int, float, float), optional
        Further places where parts end: by name side, from x, to x [length].
    starts : sequence of (int, float, float), optional
        Side, from x, to x: equally likely per length on all of them.  By default on every side from a twentieth of the
        arm beyond a_i to x of `right` [length].
    cells : int
        Cells per side; the brackets narrow with their square.
    throws : int
        n up to which probabilities within n throws are bounded.
    mean : bool
        Bound the mean of T too, and the probabilities of ever ending at a place: some hundreds of throws more.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    AbsorptionBrackets

    Raises
    ------
    AnswerError
        Places or starts that are none, a law or an effect of which nothing is proved, or so small a kappa that the
        impact may not be unique.

    Examples
    --------
    >>> from limitsets.robust import Scattering, Uniform, absorption_brackets
    >>> noise = Scattering(speed=Uniform(0.003), landing=Uniform(0.02))
    >>> brackets = absorption_brackets("paper-designed", noise, right=(20.5, 2), cells=500, throws=5, mean=False)
    >>> low, high = brackets.within["right"][:, 5]
    >>> bool(low < 0.222 < high < low + 0.05)
    True
    """
    from limitsets.feeder.scene import load

    begun = time.perf_counter()
    guard()
    read = load(scene) if isinstance(scene, str) else scene
    noise = scattering_of(read) if scatter is None else scatter
    require_cells(cells, "absorption bracket")
    places = absorbing_places(read, right, wrong, absorbing)
    begin = tuple(default_starts(read, right) if starts is None else starts)
    require_places(read, "a start", begin)
    tell = progress or (lambda stage, done, total: None)
    from limitsets.checker.brackets import brackets_of

    told = added_up("cells", len(read.sides) * cells, tell)
    chain = chain_of(read, noise, begin, places, cells, told)
    within, values = {}, {}
    for name in (ANY, *chain.steps.absorbed):
        told_of = partial(_told, partial(tell, name), throws)
        pair, values[name] = brackets_of(chain.steps, chain.row, name, throws + 1, told_of)
        within[name] = pair.T
    tell("mean", 0, 1)
    means, ever, functions = forever(chain, places, values) if mean else ((0.0, math.inf), {}, {})
    tell("mean", 1, 1)
    return AbsorptionBrackets(
        read,
        read.name,
        read.unit,
        scatter=noise,
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
    for name, places in (absorbing or {}).items():
        if name in (*absorbers, ANY, EXITS):
            raise AnswerError("the name of absorbing places", name, "one that is not taken", "choose another")
        absorbers[name] = [(int(side), float(lo), float(hi)) for side, lo, hi in places]
    for name, each in absorbers.items():
        require_places(scene, f'a place that is "{name}"', each)
    return absorbers


def default_starts(scene: Scene, right: tuple[float, int] | None) -> list[Place]:
    """Give the starts where none are named: on every side from a twentieth of the arm beyond a_i to x of `right`."""
    if right is None:
        raise AnswerError("the starts", "none", "(side, from x, to x)", "pass starts=[...], or `right`")
    x = float(right[0])
    return [(k, float(lo), x) for k, lo in enumerate(starts_from(scene)) if lo < x]
