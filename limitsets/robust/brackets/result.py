"""What is proved of where a noisy chain ends, and when."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.files import as_table, picked
from limitsets.robust.brackets.chain import Place
from limitsets.robust.brackets.nodes import Nodes
from limitsets.robust.noise.scattering import Scattering
from limitsets.tables import Column, Table, Tabled

if TYPE_CHECKING:
    from limitsets.scene import Scene

Array = NDArray[np.float64]

# Any absorbing set or exit.
ANY = "any"
# A certificate claims a little more than was found, and the checker's cells are finer: see `writing`.
ALLOWANCE, FINER = 1e-6, 2


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
    nodes : Nodes
        The cells: functions are affine between neighbouring nodes of a side.
    strata : dict of str to ndarray
        By quantity the ends of the strata into which its law is cut.
    within : dict of str to ndarray, shape (2, throws + 1)
        By name bounds of the probability of having ended there after 0, 1, ... throws; "any" is that of T <= n.
    values : dict of str to ndarray, shape (2, n_nodes)
        By name the bounds at the nodes after the last throw, for starts there.
    mean : (float, float)
        Bounds of the mean of T; the upper one is infinite where none was found.
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
    nodes: Nodes
    strata: dict[str, Array]
    within: dict[str, Array]
    values: dict[str, Array]
    mean: tuple[float, float]
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
        rows = [(name, last, (low[-1], high[-1])) for name, (low, high) in self.within.items()]
        columns = ("ends at", "within throws", Column("probability", show=".6f", ends=True))
        return (Table(columns, rows, f"{self.scene}: brackets of probabilities", self.how),)

    def to_json(self) -> dict[str, Any]:
        """Give the brackets as JSON takes them."""
        return as_table(
            **picked(self, "scene", "unit", "how", "absorbing", "starts", "seconds"),
            scatter=self.scatter.words(),
            cells=int(np.isfinite(self.nodes.width).sum()),
            within={name: {"lo": lo, "hi": hi} for name, (lo, hi) in self.within.items()},
            mean={"lo": self.mean[0], "hi": self.mean[1] if math.isfinite(self.mean[1]) else None},
            quantiles={
                str(share): dict(zip(("lo", "hi"), self.quantile(share), strict=True))
                for share in (0.5, 0.95, 0.99)
            },
        )

    def save(
        self, path: str | Path, *, allowance: float = ALLOWANCE, finer: int = FINER, recheck: bool = True
    ) -> Path:
        """Write the brackets as a certificate, which gets its name once the checker has made the steps anew.

        Parameters
        ----------
        path : str or Path
            The file, NAME.proof.zip; an older one is replaced whole.
        allowance : float
            What is claimed is wider by this at both ends; bounds of the mean by as many throws times their number.
        finer : int
            Into how many each cell is cut for the checker, whose way to bound a throw is a little less narrow.
        recheck : bool
            Whether to check it first: from seconds to as long as the proof.

        Raises
        ------
        AnswerError
            Laws that the checker does not know: it knows a uniform one of the landing place, and of the speed a
            uniform one or none.
        DeniedError
            The checker's own brackets are wider than what is claimed; the file is kept as NAME.denied.zip.

        Examples
        --------
        >>> import tempfile
        >>> import limitsets as ls
        >>> from limitsets.robust import Scattering, Uniform, absorption_brackets
        >>> noise = Scattering(landing=Uniform(0.1))
        >>> found = absorption_brackets("paper-initial", noise, right=(20, 2), cells=300, throws=3, mean=False)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ls.recheck(found.save(f"{folder}/initial.proof.zip")).verdict
        'proved'
        """
        from limitsets.robust.brackets.writing import write

        return write(
            path,
            self.source,
            self.scatter,
            (self.starts, self.absorbing),
            self.nodes,
            self.within,
            self.mean,
            allowance=allowance,
            finer=finer,
            recheck=recheck,
        )
