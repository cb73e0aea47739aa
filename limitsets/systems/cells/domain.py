"""Where states may lie: a box of x for each side, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import GridError, shown


@dataclass(frozen=True, eq=False)
class Domain:
    """A box of x per side.

    Attributes
    ----------
    lo, hi : ndarray, shape (n_sides, dimension)
        Corners of the boxes.  A side without states has ``lo == hi``: a chamfer on which a part cannot rest.
    anchor : ndarray, shape (n_sides,), or None
        In one dimension: a point below `lo` towards which graded cells shrink (the throw: R = a_i).
    periodic : tuple of bool
        Which axes close, on all sides: there x and x + (hi - lo) are one state.  Default: none.

    Raises
    ------
    GridError
        For shapes that do not fit, boxes that end before they begin, no side with states, numbers that are not finite,
        an anchor inside a box, or one beside an axis that closes.

    Examples
    --------
    >>> from limitsets.cells import Domain
    >>> Domain([[0.0]], [[1.0]]).sides
    1
    """

    lo: NDArray[np.float64]
    hi: NDArray[np.float64]
    anchor: NDArray[np.float64] | None = None
    periodic: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        lo, hi = (np.array(corner, dtype=np.float64) for corner in (self.lo, self.hi))
        if lo.ndim != 2 or lo.shape != hi.shape or lo.shape[1] not in (1, 2, 3) or lo.shape[0] == 0:
            raise GridError(
                "the shape of the domain",
                (lo.shape, hi.shape),
                "lo and hi of shape (sides, dimension), dimension 1 to 3",
                "pass one row per side",
            )
        some, none = (lo < hi).all(axis=1), (lo == hi).all(axis=1)
        if not (np.isfinite(lo).all() and np.isfinite(hi).all() and (some | none).all() and some.any()):
            wrong = ~(np.isfinite(lo) & np.isfinite(hi) & (lo < hi)) & (~none[:, None] | none.all())
            side, axis = np.argwhere(wrong)[0].tolist()
            low, high = float(lo[side, axis]), float(hi[side, axis])
            raise GridError(
                f"the domain{f' on side {side}' if len(lo) > 1 else ''} along axis {axis}",
                (low, high),
                "(lo, hi), finite and with lo < hi",
                "swap them" if low > high else "correct them",
            )
        object.__setattr__(self, "lo", lo)
        object.__setattr__(self, "hi", hi)
        if self.anchor is not None:
            anchor = np.array(self.anchor, dtype=np.float64)
            if lo.shape[1] != 1 or anchor.shape != (lo.shape[0],) or not (anchor < lo[:, 0]).all():
                raise GridError(
                    "the anchor",
                    anchor.tolist(),
                    "one number below lo per side, in one dimension",
                    "correct the anchor",
                )
            object.__setattr__(self, "anchor", anchor)
        object.__setattr__(self, "periodic", _periodic(self.periodic, lo.shape[1], self.anchor is not None))

    @property
    def closes(self) -> bool:
        """Whether some axis closes."""
        return any(self.periodic)

    @property
    def period(self) -> NDArray[np.float64]:
        """Extent of each axis that closes, 0 of the others, shape (n_sides, dimension)."""
        return np.where(self.periodic, self.hi - self.lo, 0.0)

    def wrapped(self, x: ArrayLike, side: int | NDArray[np.int64]) -> NDArray[np.float64]:
        """Give the states of the domain that some states are: along axes that close in [lo, hi), as they are elsewhere.

        Parameters
        ----------
        x : array_like, shape (n, dimension), or (n,) in one dimension
            States, anywhere.
        side : int or ndarray of int, shape (n,)
            Their side, or the side of each.

        Returns
        -------
        ndarray, shape of x

        Examples
        --------
        >>> import limitsets as ls
        >>> ls.grid([(0.0, 1.0)], periodic=True).domain.wrapped([1.0, -0.25, 0.5], 0)
        array([0.  , 0.75, 0.5 ])
        """
        if not self.closes:
            return np.asarray(x, dtype=np.float64)
        states = np.array(x, dtype=np.float64)
        columns = states.reshape(-1, self.dimension)  # a view
        lo, hi, period = (
            np.broadcast_to(end[side], columns.shape) for end in (self.lo, self.hi, self.period)
        )
        turned = (period > 0.0) & np.isfinite(columns)
        some = columns[turned]
        some -= period[turned] * np.floor((some - lo[turned]) / period[turned])
        inside = (some >= lo[turned]) & (some < hi[turned])  # rounding may end on the seam
        columns[turned] = np.where(inside, some, lo[turned])
        return states

    def shortest(self, x: NDArray[np.float64], side: NDArray[np.int64]) -> NDArray[np.float64]:
        """Give differences of states, of shape (..., dimension), by the shortest way round axes that close."""
        period = self.period[side]
        turns = np.round(x / np.where(period > 0.0, period, 1.0))
        return np.where(period > 0.0, x - turns * period, x)

    def require_ends(self, door: str) -> None:
        """Refuse axes that close, for `door`, which knows none.

        Raises
        ------
        GridError
            Some axis closes.
        """
        if self.closes:
            raise GridError(
                f"the axes of {door}",
                f"periodic={self.periodic}",
                "axes that end",
                "leave periodic= out there",
            )

    @property
    def sides(self) -> int:
        """Number of sides."""
        return int(self.lo.shape[0])

    @property
    def inhabited(self) -> NDArray[np.bool_]:
        """Which sides have states, shape (n_sides,)."""
        return np.asarray(np.logical_and.reduce(self.lo < self.hi, axis=1))

    @property
    def dimension(self) -> int:
        """Number of coordinates of x."""
        return int(self.lo.shape[1])


def _periodic(periodic: Any, dimension: int, graded: bool) -> tuple[bool, ...]:
    """Read which axes close."""
    given = (periodic,) * dimension if isinstance(periodic, bool | np.bool_) else periodic
    listed = isinstance(given, Sequence | np.ndarray) and all(
        isinstance(one, bool | np.bool_) for one in given
    )
    axes = tuple(map(bool, given)) if listed else (False,)
    if not listed or len(axes) not in (0, dimension):
        allowed = f"{dimension} of True and False" if dimension > 1 else "True or False"
        remedy = (
            f"pass periodic=({', '.join(['True'] * dimension)})" if dimension > 1 else "pass periodic=True"
        )
        raise GridError("the argument periodic of grid", shown(periodic), allowed, remedy)
    if any(axes) and graded:
        allowed = "no axis that closes beside an anchor"
        raise GridError("the argument periodic of grid", axes, allowed, "leave the anchor out")
    return axes or (False,) * dimension


def as_domain(domain: Domain | ArrayLike) -> Domain:
    """Read a domain: a `Domain`, or for one side a list of (lo, hi), one pair per axis.

    Examples
    --------
    >>> from limitsets.cells import as_domain
    >>> as_domain([(-1, 1), (0, 2)]).dimension
    2
    """
    if isinstance(domain, Domain):
        return domain
    try:
        pairs = np.array(domain, dtype=np.float64)
    except (TypeError, ValueError):
        pairs = np.empty(0)
    if pairs.shape == (2,):
        pairs = pairs[None, :]
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        if isinstance(getattr(domain, "domain", None), Domain):  # of a scene
            raise GridError("the domain", type(domain).__name__, "a Domain", "pass its .domain")
        raise GridError("the domain", domain, "a Domain, or one (lo, hi) per axis", "pass [(lo, hi), ...]")
    return Domain(pairs[:, 0][None, :], pairs[:, 1][None, :])
