"""Domains of textbook maps as in the literature, as plain pairs of numbers.

Pairs, and not `limitsets.cells.Domain`: rooms on one floor do not import each other.
"""

from __future__ import annotations

from typing import Any

from limitsets.errors import MapError

DOMAINS: dict[type, tuple[tuple[float, float], ...]] = {}
"""Class of a map -> one pair (lo, hi) per coordinate; each map's file adds its own."""


def domain_of(params: Any) -> list[tuple[float, float]]:
    """Return the domain that a textbook map is usually looked at on.

    Parameters
    ----------
    params : NamedTuple
        A textbook map.

    Returns
    -------
    list of (float, float)
        One pair (lo, hi) per coordinate.

    Raises
    ------
    MapError
        For a map that is none of them.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.domain_of(maps.Leslie())
    [(-0.001, 90.0), (-0.001, 70.0)]
    """
    pairs = DOMAINS.get(type(params))
    if pairs is None:
        known = ", ".join(sorted(cls.__name__ for cls in DOMAINS))
        raise MapError("the map", type(params).__name__, f"one of {known}", "give the domain yourself")
    return list(pairs)
