"""The one exception family of the package.

Every error names the thing that is wrong, the value it has, what would be allowed and what to do; a caller can
read these as attributes, a person reads them as one sentence.  Numerical outcomes (no attractor within a budget,
an undecided cell) are values of the answers, never exceptions.
"""

from __future__ import annotations

import functools
import math
import numbers

# Letters of a text that an error shows.
LONGEST = 64


class LimitsetsError(Exception):
    """Base of every error this package raises on purpose.

    Parameters
    ----------
    thing : str
        What is wrong, in the user's words: ``"the length of the arm"``.
    value : object
        The value found.
    allowed : str
        What would be accepted.
    remedy : str
        What to do about it.
    key : str, optional
        Where it stands in the scene: ``"arm.length"``.
    file : str, optional
        The file it was read from.

    Examples
    --------
    >>> print(LimitsetsError("the number of cells", -3, "an integer from 1", "pass cells=1024"))
    the number of cells is -3; allowed: an integer from 1; pass cells=1024
    """

    def __init__(
        self,
        thing: str,
        value: object,
        allowed: str,
        remedy: str,
        *,
        key: str | None = None,
        file: str | None = None,
    ) -> None:
        self.thing, self.value, self.allowed, self.remedy = thing, value, allowed, remedy
        self.key, self.file = key, file
        place = ": ".join(part for part in (file, key) if part)
        sentence = f"{thing} is {value!r}; allowed: {allowed}; {remedy}"
        super().__init__(f"{place}: {sentence}" if place else sentence)

    def __reduce__(self) -> tuple[object, ...]:
        """Rebuild from the parts, so that an error crosses process borders whole."""
        kind = functools.partial(type(self), key=self.key, file=self.file)
        return kind, (self.thing, self.value, self.allowed, self.remedy)


class SceneError(LimitsetsError):
    """A scene's text or values cannot be what they say."""


class GeometryError(SceneError):
    """A part that cannot be, or that cannot rest where it should."""


class TipsError(GeometryError):
    """A part with a side on which it cannot rest, in a scene that does not simulate what it does there."""


class MapError(LimitsetsError):
    """A map's parameters, kernels or states do not fit the map contract."""


class GridError(LimitsetsError):
    """A domain, grid or cell set that cannot be built or combined."""


class AnswerError(LimitsetsError):
    """A question that the map, grid or graph at hand cannot be asked."""


class DataError(LimitsetsError):
    """A file of measurements that cannot be what it says; the key names row and column."""


def shown(value: object) -> object:
    """Shorten a value for an error: what a scene holds may be a million characters long."""
    if isinstance(value, str):
        return value if len(value) <= LONGEST else value[:LONGEST] + "..."
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 64:
        return f"an integer of {value.bit_length()} bits"
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else f"{value}"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        return f"a list of {len(value)}"
    return f"a {type(value).__name__}"
