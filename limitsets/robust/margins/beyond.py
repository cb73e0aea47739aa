"""Margins as functions of X, for "beyond X only one side": where to let the arm end.

With growing X the slack to parts on other sides grows, and the slack of the wanted side falls.  Every X therefore has
two goals: beyond X only the wanted side, and almost every orbit comes to rest on that side beyond X.  The margin is
largest between the two limits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.files import as_table, picked
from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.progress import shown_in_notebooks
from limitsets.proofs.query import Query
from limitsets.robust.margins.finding import goals_of, margin
from limitsets.robust.margins.joint import joint_margin
from limitsets.robust.margins.margin_result import Margin
from limitsets.robust.margins.margin_texts import bound, bound_above
from limitsets.scene import Scene, load
from limitsets.scene.laid import LaidLike
from limitsets.tables import Column, Table, Tabled

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class MarginsBeyond(Tabled):
    """Brackets of margins at several X.

    Attributes
    ----------
    scene : Scene
        The scene.
    side : int
        The side wanted.
    x : ndarray, shape (n,)
        Places, ascending [length].
    names : tuple of str
        Quantity and reading of each margin.
    units : tuple of str
        Their units.
    proved, refuted : ndarray, shape (n, names)
        The brackets; refuted is nan where nothing is.
    margins : tuple of tuple of Margin
        The same with their proofs, by place.
    """

    scene: Scene
    side: int
    x: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    proved: NDArray[np.float64]
    refuted: NDArray[np.float64]
    margins: tuple[tuple[Margin, ...], ...]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        bounds = [
            Column(f"{name} {word}", unit, show)
            for name, unit in zip(self.names, self.units, strict=True)
            for word, show in (("proved", bound), ("refuted", bound_above))
        ]
        rows = [
            (x, *(end for pair in zip(low, high, strict=True) for end in pair))
            for x, low, high in zip(self.x.tolist(), self.proved.tolist(), self.refuted.tolist(), strict=True)
        ]
        caption = f"{self.scene.name}: margins of side {self.side} beyond X"
        columns = (Column("X", self.scene.unit, ".6g"), *bounds)
        return (Table(columns, rows, caption, "brackets: proved below, refuted above"),)

    def to_json(self) -> dict[str, Any]:
        """Give them as a plain table for JSON, without the proofs; null where nothing is refuted."""
        places = picked(self, "side", "x")
        return as_table(**places, quantities=self.names, **picked(self, "units", "proved", "refuted"))

    def best(self, name: str | None = None) -> tuple[float, float]:
        """Return the place with the largest proved margin, and that margin; of the first quantity by default."""
        k = 0 if name is None else self.names.index(name)
        at = int(np.argmax(self.proved[:, k]))
        return float(self.x[at]), float(self.proved[at, k])


@shown_in_notebooks
def margins_beyond(
    scene: Scene | str | Path,
    side: int,
    quantities: Sequence[str] = ("throw.speed",),
    *,
    x: Sequence[float] | None = None,
    places: int = 9,
    tolerance: Mapping[str, str] | None = None,
    laid: LaidLike | None = None,
    width: float = 0.05,
    seconds: float = 30.0,
    progress: Progress | None = None,
) -> MarginsBeyond:
    """Bracket margins of "beyond X only this side, and almost every orbit comes there" at several X.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, or what `limitsets.load` takes.
    side : int
        The side wanted.
    quantities : sequence of str
        Each fixed but unknown, landing.x at every throw; "joint" for the tolerance.
    x : sequence of float, optional
        Places; default `places` of them between the farthest that the limit set gets on other sides and on this one.
    places : int
        How many.
    tolerance : mapping of str to str, optional
        For "joint"; default the scene's.
    laid : mapping of int to sequence of (float, float), optional
        Where parts are laid down, as for `limitsets.certify`; default the whole arm.
    width : float
        Of the brackets.
    seconds : float
        For each proof of "joint".
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Raises
    ------
    AnswerError
        The limit set gets farther on another side than on this one.

    Examples
    --------
    >>> margins_beyond("paper-designed", 2, x=[20.0]).proved[:, 0].round(1).tolist()
    [0.7]
    """
    loaded = load(scene)
    at = np.sort(np.asarray(places_beyond(loaded, side, places) if x is None else x, dtype=float))
    rows: list[tuple[Margin, ...]] = []
    for number, place in enumerate(at.tolist()):
        if progress is not None:
            progress(f"margins beyond x = {place:.4g}", number, at.size)
        goals = goals_of(loaded, (OrientedBeyond(place, side), Reaches(place, side)), laid)
        rows.append(tuple(_one(loaded, name, goals, tolerance, width, seconds) for name in quantities))
    names = tuple(one.quantity for one in rows[0])
    proved = np.array([[one.proved for one in row] for row in rows])
    refuted = np.array([[np.nan if one.refuted is None else one.refuted for one in row] for row in rows])
    return MarginsBeyond(
        loaded, side, at, names, tuple(one.unit for one in rows[0]), proved, refuted, tuple(rows)
    )


def _one(
    scene: Scene,
    name: str,
    goals: tuple[Goal, ...],
    tolerance: Mapping[str, str] | None,
    width: float,
    seconds: float,
) -> Margin:
    if name == "joint":
        return joint_margin(scene, goals, tolerance, width=width, seconds=seconds)
    (found,) = margin(scene, name, goal=goals, width=width)
    return found


def places_beyond(scene: Scene, side: int, places: int) -> NDArray[np.float64]:
    """Return places between the farthest that the limit set gets on other sides and on this one, as many as asked."""
    extents = Query.of(scene, (OrientedBeyond(0.0, side),)).cells(None, 2).cells.extents()
    highest = {s: max(hi for _, hi in parts) for s, parts in extents.items() if parts}
    others = max((top for s, top in highest.items() if s != side), default=0.0)
    own = highest.get(side, -np.inf)
    if not others < own:
        farthest = max(highest, key=lambda s: highest[s], default=side)
        raise AnswerError(
            "the side",
            side,
            f"the one that the limit set gets farthest out on, {farthest}",
            "ask about that one",
        )
    return np.linspace(others, own, places + 2)[1:-1]
