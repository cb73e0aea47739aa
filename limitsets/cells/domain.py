"""Where states may lie: a box of x for each side, or none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.errors import GridError


@dataclass(frozen=True, eq=False)
class Domain:
    """A box of x per side.

    Attributes
    ----------
    lo, hi : ndarray, shape (n_sides, dimension)
        Corners of the boxes.  A side without states has ``lo == hi``: a chamfer on which a part cannot rest.
    anchor : ndarray, shape (n_sides,), or None
        In one dimension: a point below `lo` towards which graded cells shrink (the throw: R = a_i).

    Raises
    ------
    GridError
        For shapes that do not fit, boxes that end before they begin, no side with states, numbers that are not finite,
        or an anchor inside a box.

    Examples
    --------
    >>> from limitsets.cells import Domain
    >>> Domain([[0.0]], [[1.0]]).sides
    1
    """

    lo: NDArray[np.float64]
    hi: NDArray[np.float64]
    anchor: NDArray[np.float64] | None = None

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

    @property
    def sides(self) -> int:
        """Number of sides."""
        return int(self.lo.shape[0])

    @property
    def inhabited(self) -> NDArray[np.bool_]:
        """Which sides have states, shape (n_sides,)."""
        some: NDArray[np.bool_] = np.logical_and.reduce(self.lo < self.hi, axis=1)
        return some

    @property
    def dimension(self) -> int:
        """Number of coordinates of x."""
        return int(self.lo.shape[1])


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
