"""Many parts on a tray at once, counted: fractions of the depressions, pass by pass, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.files import as_table
from limitsets.robust.noise.proportions import binomial_interval
from limitsets.sweep.trial_file import Row
from limitsets.trays.pouring import Pouring

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class TrayCrowd:
    """How depressions fill by which many parts come at once; counted.

    Attributes
    ----------
    parts, depressions : int
        Parts that come by in each pass, together; depressions of the tray.
    between : bool
        Whether the parts push each other.
    right, covered, wrong : ndarray of int64, shape (batches, passes + 1)
        Depressions after 0, 1, ... passes: with one part, that lies rightly; with one that does under others; with
        wrong parts only.
    met : ndarray of bool, shape (batches,)
        Whether two parts pushed each other.
    unfinished : int
        Motions after which a part was not at rest when patience ended; it counts as it lay.
    moved : int
        Parts kicked or coming by, each counted in each pass.
    seconds : float
        Processor time of the passes.
    seed : int
        Of all draws.
    """

    parts: int
    depressions: int
    between: bool
    right: Ints
    covered: Ints
    wrong: Ints
    met: NDArray[np.bool_]
    unfinished: int
    moved: int
    seconds: float
    seed: int

    @property
    def words(self) -> str:
        """How the parts meet, in words."""
        return "pushing" if self.between else "passing through"

    def share(self, counts: Ints) -> tuple[Array, Array]:
        """Give fractions of the depressions after 0, 1, ... passes, and their intervals of 95 %.

        Depressions of one batch depend on each other: the interval is the wider of Student's between batches and that
        of independent depressions.
        """
        from scipy.stats import t

        batches = counts.shape[0]
        each = counts / self.depressions
        mean = each.mean(axis=0)
        of = batches * self.depressions
        ends = np.array([binomial_interval(int(count), of) for count in counts.sum(axis=0)])
        if batches > 1:
            half = t.ppf(0.975, batches - 1) * each.std(axis=0, ddof=1) / np.sqrt(batches)
            ends[:, 0] = np.clip(np.minimum(ends[:, 0], mean - half), 0.0, 1.0)
            ends[:, 1] = np.clip(np.maximum(ends[:, 1], mean + half), 0.0, 1.0)
        return mean, ends

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        shares = {name: self.share(getattr(self, name)) for name in ("right", "covered", "wrong")}
        return as_table(
            parts=self.parts,
            depressions=self.depressions,
            between=self.between,
            contact="unilateral",
            batches=self.met.size,
            seed=self.seed,
            **{name: {"value": value, "interval": ends} for name, (value, ends) in shares.items()},
            met=float(self.met.mean()),
            unfinished=self.unfinished,
            moved=self.moved,
            seconds_per_part_and_pass=self.seconds / max(self.moved, 1),
        )


def crowds_of(pouring: Pouring, rows: Sequence[Row]) -> tuple[TrayCrowd, ...]:
    """Count batches: of parts that push each other, and of parts that pass through each other."""
    found = []
    for name in ("pushing", "passing"):
        kept = [row[name] for row in rows]
        states = np.array([each["states"] for each in kept], dtype=np.int64)
        right, covered, wrong = np.moveaxis(states, -1, 0)
        found.append(
            TrayCrowd(
                pouring.parts,
                pouring.depressions,
                name == "pushing",
                right,
                covered,
                wrong,
                np.array([each["met"] for each in kept]),
                sum(each["unfinished"] for each in kept),
                sum(each["moved"] for each in kept),
                sum(each["seconds"] for each in kept),
                pouring.seed,
            )
        )
    return tuple(found)
