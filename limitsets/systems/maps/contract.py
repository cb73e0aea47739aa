"""The map contract: the functions of a discrete-time map on (x, side), its registration, and corners of its parameters.

A map is a NamedTuple of parameters; its class decides which kernels run (`limitsets.jit.generic`).  Drivers are
written once, here and in the rooms above, and know maps only through these functions:

======================================  =============================================================================
``image(params, x, side)``              ``(x', side', code)``: one step (required)
``image_on(params, x, side, branch)``   ``(x', side', slope)``, or ``(x', side')``: one step on a forced branch, for
                                        one-sided limits, slopes and Newton's method
``image_box(lo, hi, x_lo, x_hi, side)`` ``(count, slot, slot, witness)``: one or two boxes, each ``(lo', hi', side',
                                        branch)``, that hold the image of a box of states for all parameters between
                                        two; count -1 where nothing could be proved
``fallback_box(...)``                   as `image_box`, slow and sure; asked where that can prove nothing
``on_side_box(lo, hi, side)``           as `on_side`, for the two parameter corners of `image_box`
``on_side(params, side)``               gathers what one side needs, once for a whole batch; the class of what it
                                        returns then has the methods `image`, `image_on` and so on
``fallback(params, x, side)``           as `image`, slow and sure; asked where `image` answers ``UNSETTLED``
``margin(params, x, side)``             a number whose sign decides between branch 0 (not positive) and branch 1, of a
                                        map of two branches
``displacement(params, x, side)``       x' - x computed without cancellation
``scattered(params, start, step)``      the parameters as they are at step number `step` of start number `start`, where
                                        they differ at every step; asked by orbits, not by the images of cells
======================================  =============================================================================

Without an `image_box` boxes are derived (`limitsets.systems.maps.derived`): of a map of one branch from `image_on` or
`image`, of a map of two from `image_on` and `margin`.  `image_on` may leave the slope out, which is derived then.  A
box by hand, written with `limitsets.interval`, pays where a tighter one is known, or where an image ends on the
border of the domain, which no rounding may pass.  A cell counts as one of which nothing is proved where its image is
nan or unbounded, and where a function was asked beyond where it is defined (the contract of that room), whatever
count the kernel gives.

In two and three dimensions x is a tuple and the slope a tuple of rows.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, MapError, shown
from limitsets.numbers.jit import cover_foreign_class
from limitsets.systems.maps import codes, derived, kernels

EXITS_OF_A_MAP = {"outside": codes.OUTSIDE}


@dataclass(frozen=True)
class MapKind:
    """What the drivers know of a class of maps.

    Attributes
    ----------
    name : str
        For messages and reports.
    dimension : int
        1, 2 or 3: the number of coordinates of x.
    branches : tuple of str
        Names of the branches; the code of a step is an index into it.
    exits : dict of str to int
        Names and codes of the ways out, in the order of the sinks of a graph; "undefined" is the last.
    has_image_on, has_image_box, has_margin, has_displacement : bool
        Which of the optional kernels exist.
    own_box : bool
        Whether `image_box` was registered, and not derived.
    on_arrays : callable or None
        Of a map of a numpy function of arrays, which nothing compiles: ``on_arrays(params, xs)`` gives the coordinate
        arrays of the images.
    """

    name: str
    dimension: int
    branches: tuple[str, ...]
    exits: dict[str, int]
    has_image_on: bool
    has_image_box: bool
    has_margin: bool
    has_displacement: bool
    own_box: bool = False
    on_arrays: Callable[..., tuple[NDArray[np.float64], ...]] | None = None

    @property
    def formulas(self) -> tuple[str, ...]:
        """Names of the kernels that derived boxes and slopes are of."""
        one = "image_on" if self.has_image_on else "image"
        return (one, "margin") if self.has_margin else (one,)


_KINDS: dict[Any, MapKind] = {}


def register(
    cls: type,
    *,
    image: Callable[..., Any],
    image_on: Callable[..., Any] | None = None,
    image_box: Callable[..., Any] | None = None,
    on_side: Callable[..., Any] | None = None,
    on_side_box: Callable[..., Any] | None = None,
    fallback_box: Callable[..., Any] | None = None,
    fallback: Callable[..., Any] | None = None,
    margin: Callable[..., Any] | None = None,
    displacement: Callable[..., Any] | None = None,
    scattered: Callable[..., Any] | None = None,
    dimension: int = 1,
    branches: tuple[str, ...] = ("map",),
    exits: dict[str, int] | None = None,
) -> type:
    """Make a class of parameters a map, at the speed of the built-in ones.

    Parameters
    ----------
    cls : type
        A NamedTuple class whose fields are floats, arrays with one entry per side, NamedTuples of such, or None.
        A second class of one name and the same fields is shown with a number, ``Tent\u00b72``.
        Build its values with `limitsets.maps.coerce`, or give floats and float64 arrays.
    image : callable
        ``image(params, x, side) -> (x', side', code)``; code is the index of the branch taken, or
        `limitsets.maps.OUTSIDE` (-2).  A step to nan is `limitsets.maps.UNDEFINED` (-5), whatever code comes with it.
        A module-level function, not decorated.
    image_on, image_box, on_side, on_side_box, fallback, fallback_box, margin, displacement : callable, optional
    scattered : callable, optional
        See this module's table.
    dimension : int
        1, 2 or 3.
    branches : tuple of str
        Names of the branches.
    exits : dict, optional
        Names and codes of the ways out; default ``{"outside": -2}``.  ``{"undefined": -5}`` is put behind them.

    Returns
    -------
    type
        `cls`, so that it can be used as a decorator with ``functools.partial``.

    Raises
    ------
    MapError
        For a class that is no NamedTuple, is registered already, a kernel that is no module-level function, or a
        `margin` of a map of one branch, or of more than two, between which no sign decides.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> import limitsets as ls
    >>> class Tent(NamedTuple):
    ...     slope: float
    >>> def tent(params, x, side):
    ...     return (params.slope * x, side, 0) if x < 0.5 else (params.slope * (1.0 - x), side, 1)
    >>> _ = ls.register(Tent, image=tent, branches=("left", "right"))
    >>> ls.orbit(Tent(2.0), 0.2, 0, 3).x
    array([0.2, 0.4, 0.8, 0.4])
    """
    if not (isinstance(cls, type) and issubclass(cls, tuple) and hasattr(cls, "_fields")):
        raise MapError(
            "the class of parameters", cls, "a NamedTuple class", "write class Params(NamedTuple): ..."
        )
    if cls in _KINDS:
        raise MapError(
            "the class of parameters",
            cls.__name__,
            "a class not registered before",
            "give the new map a new class",
        )
    if dimension not in (1, 2, 3):
        raise MapError("the dimension of the map", dimension, "1, 2 or 3", "pass dimension=1, 2 or 3")
    if margin is not None and len(branches) != 2:
        raise MapError(
            "the number of branches of a map with margin",
            len(branches),
            "2: its sign chooses between branch 0 and branch 1",
            'name both, branches=("left", "right"), or leave margin out',
        )
    given = {
        "image": image,
        "image_on": image_on,
        "image_box": image_box,
        "on_side": on_side,
        "on_side_box": on_side_box,
        "fallback_box": fallback_box,
        "fallback": fallback,
        "margin": margin,
        "displacement": displacement,
        "scattered": scattered,
    }
    mine = {name: f for name, f in given.items() if f is not None}
    for name, function in mine.items():
        plain = getattr(function, "py_func", function)
        if (
            not callable(plain)
            or getattr(plain, "__closure__", None)
            or getattr(plain, "__name__", "") == "<lambda>"
        ):
            raise MapError(
                f"the kernel {name}",
                function,
                "a function defined at module level",
                "move it out of the function",
            )
        _require_arguments(cls, name, plain)
    cover_foreign_class(cls, list(mine.values()))
    for name, function in mine.items():
        getattr(kernels, "forced" if name == "image_on" else name).on(cls, function)
    boxes = derived.derive(
        cls,
        forced=image_on is not None,
        decided=margin is not None,
        branches=len(branches),
        boxes=image_box is not None,
    )
    _KINDS[cls] = MapKind(
        cls.__name__,
        dimension,
        tuple(branches),
        exits={**(EXITS_OF_A_MAP if exits is None else exits), "undefined": codes.UNDEFINED},
        has_image_on=image_on is not None,
        has_image_box=boxes,
        has_margin=margin is not None,
        has_displacement=displacement is not None,
        own_box=image_box is not None,
    )
    # Compiled code knows classes of values by name and fields alone: it would take the second such class for the first.
    alike = sum((kind.name, each._fields) == (cls.__name__, cls._fields) for each, kind in _KINDS.items())
    if alike > 1:
        cls.__name__ = f"{cls.__name__}\u00b7{alike}"  # an identifier, which the cache on disk asks for
    return cls


def register_on_arrays(
    cls: type, dimension: int, on_arrays: Callable[..., tuple[NDArray[np.float64], ...]]
) -> None:
    """Make a class of parameters a map of one side whose images a numpy function gives, of all states at once."""
    exits = {**EXITS_OF_A_MAP, "undefined": codes.UNDEFINED}
    _KINDS[cls] = MapKind(
        cls.__name__, dimension, ("map",), exits, has_image_on=False, has_image_box=False, has_margin=False,
        has_displacement=False, on_arrays=on_arrays,
    )  # fmt: skip


def compiled_kind_of(params: Any, door: str) -> MapKind:
    """Return what is known of a map, as `kind_of`; refuse one of a numpy function of arrays, which is not compiled.

    Raises
    ------
    MapError
        Its class was never registered, or is of such a function: the line names `door`, the call that needs more.
    """
    kind = kind_of(params)
    if kind.on_arrays is not None:
        raise MapError(
            f"the map of {door}",
            f"{kind.name}, of vectorised=True",
            "one of a function of numbers, which is compiled",
            "write it without arrays and leave vectorised=True out; as it is it has transitions by samples, attractors,"
            " basins, orbits, and resilience with starts=",
        )
    return kind


# Arguments of each kernel, as the table of this module has them.
ARGUMENTS = {
    "image": ("params", "x", "side"),
    "image_on": ("params", "x", "side", "branch"),
    "image_box": ("params_lo", "params_hi", "lo", "hi", "side"),
    "fallback_box": ("params_lo", "params_hi", "lo", "hi", "side"),
    "on_side": ("params", "side"),
    "on_side_box": ("params_lo", "params_hi", "side"),
    "fallback": ("params", "x", "side"),
    "margin": ("params", "x", "side"),
    "displacement": ("params", "x", "side"),
    "scattered": ("params", "start", "step"),
}


def _require_arguments(cls: type, name: str, function: Callable[..., Any]) -> None:
    """Refuse a kernel that cannot be called with its arguments."""
    signature, wanted = inspect.signature(function), ARGUMENTS[name]
    try:
        signature.bind(*wanted)
    except TypeError:
        raise MapError(
            f"the arguments of the kernel {name} of {cls.__name__}",
            f"{function.__name__}{signature}",
            f"{len(wanted)} of them ({', '.join(wanted)})",
            "correct its first line",
        ) from None


def require_codes(params: Any, code: NDArray[np.int64]) -> None:
    """Refuse codes of steps that the map's registration does not name."""
    kind = kind_of(params)
    known = [*range(len(kind.branches)), *kind.exits.values(), codes.OUTSIDE_MODEL]
    wrong = code[~np.isin(code, known)]
    if wrong.size:
        branches = ", ".join(f"{k} {name}" for k, name in enumerate(kind.branches))
        exits = ", ".join(f"{number} {name}" for name, number in kind.exits.items())
        raise MapError(
            f"the code that the kernel image of {kind.name} gives",
            int(wrong[0]),
            f"a branch ({branches}) or an exit ({exits})",
            "correct the kernel, or name every branch in register(..., branches=(...))",
        )


def kind_of(params: Any) -> MapKind:
    """Return what is known of a map.

    Parameters
    ----------
    params : NamedTuple
        The map's parameters, of a registered class.

    Returns
    -------
    MapKind
        Its dimension, branches and exits, and what its class was registered with.

    Raises
    ------
    MapError
        Its class was never registered.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.kind_of(maps.Henon(1.4, 0.3)).dimension
    2
    """
    kind = _KINDS.get(type(params))
    if kind is None:
        value, remedy = type(params).__name__, "register it with limitsets.register"
        if type(getattr(params, "map", None)) in _KINDS:
            remedy = "pass its .map"
        elif isinstance(params, type):
            fields = ", ".join(f"{name}=..." for name in getattr(params, "_fields", ()))
            value, remedy = f"the class {params.__name__}", f"pass {params.__name__}({fields})"
        raise MapError("the map", value, "parameters of a registered class", remedy)
    return kind


_SLOPES: dict[type, bool] = {}


def has_slope(params: Any) -> bool:
    """Whether slopes of a map are known: it has `image_on`, or a smooth `image` of one branch that can be derived.

    Parameters
    ----------
    params : NamedTuple
        The map's parameters, of a registered class.

    Returns
    -------
    bool
        True where `limitsets.maps` can give slopes.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.has_slope(maps.Logistic(3.2))
    True
    """
    kind, cls = kind_of(params), type(params)
    if kind.on_arrays is not None:
        return False
    if kind.has_image_on or len(kind.branches) > 1:
        return kind.has_image_on
    if cls not in _SLOPES:
        try:
            derived.try_slope(coerce(params), kind.dimension)
            _SLOPES[cls] = True
        except MapError:
            _SLOPES[cls] = False
    return _SLOPES[cls]


def _fewest_entries(params: Any) -> int | None:
    """Length of the shortest array among the parameters, None where there is none."""
    fewest: int | None = None
    for field in params:
        count: int | None = None
        if isinstance(field, float):
            continue
        if isinstance(field, np.ndarray):
            count = len(field)
        elif isinstance(field, tuple):
            count = _fewest_entries(field)
        elif isinstance(field, str | complex):
            coerce(params)  # which refuses it by its name
        if count is not None and (fewest is None or count < fewest):
            fewest = count
    return fewest


def require_sides(params: Any, least: int, most: int) -> None:
    """Refuse sides that a map has not: compiled code would read whatever lies beyond its arrays.

    A map whose parameters hold no array, with one entry per side, is not known to have a last side.
    """
    known = _fewest_entries(params)
    if least < 0 or (known is not None and most >= known):
        raise MapError(
            "the side",
            least if least < 0 else most,
            "an integer from 0" if known is None else f"an integer from 0 to {known - 1}",
            "name a side of the map",
        )


def require_dimension(params: Any, what: str, dimension: int) -> None:
    """Refuse a domain or a grid of another dimension than the map's.

    Raises
    ------
    AnswerError
        It has too many axes, or too few.
    """
    kind = kind_of(params)
    if kind.dimension != dimension:
        allowed = f"{kind.dimension}, that of {kind.name}"
        remedy = "give one (lo, hi) for each coordinate of x" + or_register(params, dimension)
        raise AnswerError(f"the dimension of the {what}", dimension, allowed, remedy)


def or_register(params: Any, dimension: int) -> str:
    """Say how a map of one's own is registered with another dimension; nothing of the package's maps."""
    if type(params).__module__.split(".")[0] == "limitsets":
        return ""
    return f"; if x has {dimension}, pass dimension={dimension} to limitsets.register"


def coerce(params: Any) -> Any:
    """Give a map's parameters the one form kernels are compiled for.

    Integers become floats and arrays become C-contiguous, writeable float64: any other form is another type to
    numba, and would compile everything once more.

    Parameters
    ----------
    params : NamedTuple, number, array or None
        The parameters, or one of them.

    Returns
    -------
    NamedTuple, float, ndarray or None
        The same values in that form.

    Raises
    ------
    MapError
        A parameter is none of these.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.coerce(maps.Logistic(4))
    Logistic(r=4.0)
    """
    return _coerced(params, "a parameter of the map")


def _coerced(params: Any, what: str) -> Any:
    if params is None or isinstance(params, (bool, np.bool_)):
        return params
    if isinstance(params, tuple) and hasattr(params, "_fields"):
        name = type(params).__name__
        return type(params)(
            *map(_coerced, params, (f"the field {each} of {name}" for each in params._fields))
        )
    if isinstance(params, (int, float, np.integer, np.floating)):
        return float(params)
    if isinstance(params, (np.ndarray, list)):
        return np.array(params, dtype=np.float64, order="C")
    raise MapError(
        what,
        params,
        "a number, an array, a NamedTuple of such, or None",
        "give a number, without quotes" if isinstance(params, str) else "convert it first",
    )


# ----------------------------------------------------------------
# Two corners of a box of parameters: what they may differ in, and parameters between them.


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
    >>> from limitsets.systems.maps.contract import require_corners
    >>> require_corners(maps.Logistic(3.2), maps.Logistic(3.1))
    Traceback (most recent call last):
    ...
    limitsets.base.errors.AnswerError: the upper corner of r is 3.1; allowed: at least the lower one, 3.2; swap them
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


def with_number(params: Any, name: str, value: float) -> Any:
    """Give parameters with one number changed, in others by a point: ``arm.length``, ``k.0`` of an array.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.systems.maps.contract import with_number
    >>> with_number(maps.Henon(1.4, 0.3), "a", 1.25)
    Henon(a=1.25, b=0.3)
    """
    field, _, rest = name.partition(".")
    if isinstance(params, tuple):
        held = with_number(getattr(params, field), rest, value) if rest else value
        return params._replace(**{field: held})  # type: ignore[attr-defined]  # a NamedTuple
    changed = params.copy()
    changed[int(field)] = value
    return changed


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
    >>> from limitsets.systems.maps.contract import between
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
