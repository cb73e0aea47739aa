"""Two corners of a box of parameters: what they may differ in, and parameters between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from limitsets.errors import AnswerError, shown
from limitsets.maps.contract import coerce, kind_of


def require_corners(lower: Any, upper: Any) -> None:
    """Refuse corners that are not two ends of ranges of numbers.

    Parameters
    ----------
    lower, upper : NamedTuple
        Parameters of one registered class, nested ones too.

    Raises
    ------
    AnswerError
        They differ in anything but numbers and arrays of numbers of one shape, or the upper one lies below.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.maps.corners import require_corners
    >>> require_corners(maps.Logistic(3.2), maps.Logistic(3.1))
    Traceback (most recent call last):
    ...
    limitsets.errors.AnswerError: the upper corner of r is 3.1; allowed: at least the lower one, 3.2; swap them
    """
    if type(upper) is not type(lower):
        allowed = f"parameters of {kind_of(lower).name}"
        raise AnswerError("the upper corner of the parameters", type(upper).__name__, allowed, "pass such")
    _require(coerce(lower), coerce(upper), "")


def _require(low: Any, high: Any, name: str) -> None:
    if isinstance(low, tuple) and type(high) is type(low):
        names: tuple[str, ...] = getattr(low, "_fields")  # noqa: B009  # a tuple of parameters is a NamedTuple
        for field, a, b in zip(names, low, high, strict=True):
            _require(a, b, f"{name}.{field}" if name else field)
    elif isinstance(low, float | np.ndarray) and type(high) is type(low) and np.shape(low) == np.shape(high):
        if not (np.asarray(low) <= np.asarray(high)).all():
            allowed = f"at least the lower one, {shown(low)}"
            raise AnswerError(f"the upper corner of {name}", shown(high), allowed, "swap them")
    elif type(high) is not type(low) or np.shape(low) != np.shape(high) or low != high:
        raise AnswerError(
            f"the upper corner of {name}",
            shown(high),
            f"{shown(low)}, as in the lower one: corners differ in numbers and arrays of numbers alone",
            "prove the claims for each of the two in a call of its own",
        )


def between(lower: Any, upper: Any, share: Callable[[], float] = lambda: 0.5) -> Any:
    """Give parameters between two corners: each number so much of the way up, by default half.

    Parameters
    ----------
    lower, upper : NamedTuple
        The corners, as `require_corners` has them.
    share : callable
        Asked once for each number or array: from 0 to 1.

    Returns
    -------
    NamedTuple
        Of the same class.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.maps.corners import between
    >>> between(maps.Henon(1.25, 0.25), maps.Henon(1.5, 0.25))
    Henon(a=1.375, b=0.25)
    """
    if isinstance(lower, tuple):
        return type(lower)(*(between(a, b, share) for a, b in zip(lower, upper, strict=True)))
    if lower is None or isinstance(lower, bool | np.bool_):
        return lower
    weight = share()
    inside = np.clip((1.0 - weight) * lower + weight * upper, lower, upper)
    return inside if isinstance(lower, np.ndarray) else float(inside)
