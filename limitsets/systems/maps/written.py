"""Maps from plain functions of numbers: `limitsets.map` makes the class, the side and the codes of the contract.

A class is made once for functions of one meaning: their code, and that of all they call, with the constants they read.
So other values, the same function again, and a cell of a notebook that runs again unchanged compile nothing; an edited
helper makes another class.  What the class is registered with is text that hands the coordinates and parameters to the
functions by their names: compiled code knows no ``f(*x, *params)``.
"""

from __future__ import annotations

import inspect
import math
from collections import namedtuple
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from limitsets.base import MapError, shown
from limitsets.numbers.jit.cache import is_known, meaning
from limitsets.systems.maps.contract import register, register_on_arrays

# Kernels of a map of one function, and of two with a margin.
ONE = {"image": "def image(params, x, side):\n    return {first}, side, 0"}
TWO = {
    "image": (
        "def image(params, x, side):\n    if {margin} > 0.0:\n        return {second}, side, 1\n"
        "    return {first}, side, 0"
    ),
    "image_on": (
        "def image_on(params, x, side, branch):\n    if branch == 1:\n        return {second}, side\n"
        "    return {first}, side"
    ),
    "margin": "def margin(params, x, side):\n    return {margin}",
}

# Coordinates at which the results are counted: a function need not be defined at each.
TRIED = (0.5, 1.5, -0.5, 0.125)

# Meaning of the functions -> the class of their map, and what its key names by place in memory, kept alive.
_CLASSES: dict[Any, tuple[type, list[Any]]] = {}

# Class -> its functions, by what they are to the map: first, second, margin.
_FUNCTIONS: dict[type, dict[str, Callable[..., Any]]] = {}


def map(  # noqa: A001  # limitsets.map, as limitsets.maps
    formula: Callable[..., Any] | None = None,
    /,
    *,
    pieces: tuple[Callable[..., Any], Callable[..., Any]] | None = None,
    margin: Callable[..., Any] | None = None,
    vectorised: bool = False,
    **values: float,
) -> Any:
    """Make a map of a plain function of coordinates and parameters.

    Parameters
    ----------
    formula : callable
        A function of one to three coordinates, then parameters: it returns the new coordinate, or a tuple of them.
        Names with a value, here or as a default of the function, are parameters; the others, which come first, are
        coordinates.  Defined by `def`, here or in another file, with all that it calls; it reads nothing of a function
        around it.
    pieces : tuple of two callables, optional
        In place of `formula`, for a map of two branches: branch 0, then branch 1.
    margin : callable, optional
        With `pieces`: a function of the same coordinates; where it is positive, branch 1 is taken.
    vectorised : bool
        Whether `formula` takes the coordinates of n states as arrays of shape (n,), and returns such: any callable,
        with scipy or a trained network inside.  It is called as it is, not compiled: for transitions by samples,
        attractors, basins, orbits, and resilience with ``starts=``; all else refuses such a map.
    **values : float
        Values of the parameters, in their own units.

    Returns
    -------
    NamedTuple
        The map with these values, for every function that takes a map: of one side, number 0.  Its method
        `with_values` gives it with others; neither compiles anything again.

    Raises
    ------
    MapError
        For what is no plain function (with `vectorised`: no function of arrays), a parameter without a value, a value
        that is no number or that no function takes, or another number of results than coordinates.

    Examples
    --------
    >>> import limitsets as ls
    >>> def henon(x, y, a, b):
    ...     return 1 - a * x**2 + y, b * x
    >>> at_record = ls.map(henon, a=1.4, b=0.3)
    >>> at_record.with_values(a=1.2).a
    1.2
    >>> ls.orbit(at_record, (0.0, 0.0), 0, 2).x
    array([[ 0. ,  0. ], [ 1. ,  0. ], [-0.4,  0.3]])
    """
    if not isinstance(vectorised, bool):
        allowed = "True or False"
        raise MapError("the argument vectorised of map", shown(vectorised), allowed, "pass vectorised=True")
    if vectorised:
        return _of_arrays(formula, pieces is None and margin is None, values)
    functions = _functions_of(formula, pieces, margin)
    takes = {name: tuple(_parameters_of(f)) for name, f in functions.items()}
    values = _defaults_of(functions, values) | values
    coordinates = _coordinates_of(functions, takes, values)
    fields = tuple(dict.fromkeys(name for names in takes.values() for name in names if name in values))
    numbers = {name: _number(name, values[name]) for name in fields}
    _require_known(values, fields)
    for name, f in functions.items():
        arguments = [name for name in takes[name] if name not in coordinates]
        wanted = 1 if name == "margin" else len(coordinates)
        _require_results(f, [numbers[name] for name in arguments], coordinates, wanted)
    return _class_of(functions, takes, coordinates, fields)(**numbers)


def _functions_of(formula: Any, pieces: Any, margin: Any) -> dict[str, Callable[..., Any]]:
    """Check what is given as functions: `first`, and `second` and `margin` of a map of two branches."""
    given = {"first": formula}
    if pieces is not None or margin is not None:
        if formula is not None or not isinstance(pieces, tuple | list) or len(pieces) != 2 or margin is None:
            raise MapError(
                "the functions of a map of two branches",
                "a function and pieces"
                if formula is not None
                else "pieces without margin, or not two of them",
                "pieces=(f, g), margin=m, and no other function; a parameter has another name than these",
                "write limitsets.map(pieces=(f, g), margin=m, a=1.0)",
            )
        given = {"first": pieces[0], "second": pieces[1], "margin": margin}
    plain = {name: getattr(f, "py_func", f) for name, f in given.items()}
    for f in plain.values():
        if not isinstance(f, FunctionType) or f.__name__ == "<lambda>" or f.__closure__:
            value = shown(f) if not isinstance(f, FunctionType) else f.__name__
            remedy = "write def f(x, a): return ..."
            if getattr(f, "__closure__", None):
                remedy = f"give it {', '.join(f.__code__.co_freevars)} as a parameter, or define it at module level"
            raise MapError(
                "a function of the map", value, "a function defined by def that stands alone", remedy
            )
    return plain


def _name(f: Any) -> str:
    """Name a function, or the class of what is called as one."""
    return str(getattr(f, "__name__", type(f).__name__))


def _parameters_of(f: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Names that a function takes; refuse those that cannot be handed over one by one."""
    parameters = dict(inspect.signature(f).parameters)
    for name, parameter in parameters.items():
        if parameter.kind not in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            raise MapError(
                f"an argument of {_name(f)}",
                str(parameter),
                "coordinates and parameters, each by a name of its own, no *args",
                f"write def {_name(f)}(x, a): ...",
            )
        if name.startswith("_") or name == "with_values":
            raise MapError(
                f"an argument of {_name(f)}", name, "a name that begins with a letter", "rename it"
            )
    return parameters


def _defaults_of(functions: dict[str, Callable[..., Any]], values: dict[str, float]) -> dict[str, float]:
    """Values that the functions bring themselves, of parameters to which none is given."""
    defaults: dict[str, float] = {}
    for f in functions.values():
        for name, parameter in _parameters_of(f).items():
            if parameter.default is parameter.empty or name in values:
                continue
            value = _number(name, parameter.default)
            if defaults.setdefault(name, value) != value:
                raise MapError(
                    f"the default of {name} in {_name(f)}",
                    value,
                    f"{defaults[name]}, as in the function before",
                    f"pass {name}=..., or give it one default",
                )
    return defaults


def _coordinates_of(
    functions: dict[str, Callable[..., Any]], takes: dict[str, tuple[str, ...]], values: dict[str, float]
) -> tuple[str, ...]:
    """Names of the coordinates: those without a value, which come first."""
    first = _name(functions["first"])
    coordinates = tuple(name for name in takes["first"] if name not in values)
    for name, f in functions.items():
        open_names = tuple(each for each in takes[name] if each not in values)
        if takes[name][: len(open_names)] != open_names:
            late = next(each for each, begun in zip(open_names, takes[name], strict=False) if each != begun)
            raise MapError(
                f"the parameter {late} of {_name(f)}",
                "without a value",
                "a value for each name after the coordinates",
                f"pass {late}=..., or let the coordinates come first",
            )
        if open_names != coordinates:
            raise MapError(
                f"the coordinates of {_name(f)}",
                ", ".join(open_names),
                f"{', '.join(coordinates)}, as of {first}: the names without a value",
                "give all functions of the map the same coordinates, and each parameter a value",
            )
    if not 1 <= len(coordinates) <= 3:
        raise MapError(
            f"the coordinates of {first}",
            ", ".join(coordinates) or "none",
            "one to three names without a value",
            "give each parameter a value, and no coordinate one: limitsets.map(f, a=1.0)",
        )
    return coordinates


def _require_known(values: dict[str, float], fields: tuple[str, ...]) -> None:
    """Refuse the value of a name that is no parameter."""
    for name in values:
        if name not in fields:
            allowed = f"values of {', '.join(fields) or 'no parameter'}"
            raise MapError("a value", f"{name}=...", allowed, "correct the name")


def _number(name: str, value: Any) -> float:
    """Return the value of a parameter as a float."""
    known = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not known or not math.isfinite(value):
        raise MapError(f"the value of {name}", shown(value), "a finite number", f"pass {name}=1.0")
    return float(value)


def _require_results(
    f: Callable[..., Any], arguments: list[float], names: tuple[str, ...], wanted: int
) -> None:
    """Run a function once in Python, and refuse other results than as many numbers as are wanted."""
    result = None
    for start in TRIED:
        try:
            with np.errstate(all="ignore"):
                result = f(*(start + 0.25 * k for k in range(len(names))), *arguments)
            break
        except (ArithmeticError, ValueError):  # not defined there
            continue
        except Exception as error:
            raise MapError(
                f"what {_name(f)} does at {names[0]} = {start}",
                f"{type(error).__name__}: {error}",
                "numbers from numbers",
                "correct the function",
            ) from error
    else:
        return  # compiled code has its say
    count = len(result) if isinstance(result, tuple) else 1
    numbers = result if isinstance(result, tuple) else (result,)
    if isinstance(result, tuple) != (wanted > 1) or count != wanted:
        each = f"one for each of {', '.join(names)}" if wanted > 1 else f"of {', '.join(names)}"
        raise MapError(
            f"what {_name(f)} returns",
            f"a tuple of {count}" if isinstance(result, tuple) else shown(result),
            f"a tuple of {wanted} numbers, {each}" if wanted > 1 else "one number, and no tuple",
            "names without a value are coordinates: give each parameter one, or correct what is returned",
        )
    for number in numbers:
        if not isinstance(number, int | float | np.integer | np.floating) or isinstance(number, bool):
            raise MapError(
                f"what {_name(f)} returns",
                shown(number),
                "numbers" if wanted > 1 else "a number",
                "correct what is returned"
                if wanted > 1
                else "of a comparison a > b return the difference a - b",
            )


# ---------------------------------------------------------------- functions of arrays


def _called(formula: Any, name: str) -> Callable[..., Any]:
    """Make the call of a function of arrays, which refuses arrays of other shapes."""

    def on_arrays(params: Any, xs: tuple[Any, ...]) -> tuple[Any, ...]:
        with np.errstate(all="ignore"):
            after = formula(*(each.copy() for each in xs), *params)
        after = (after,) if len(xs) == 1 and not isinstance(after, tuple | list) else after
        shapes = [np.shape(each) for each in after] if isinstance(after, tuple | list) else [np.shape(after)]
        if not isinstance(after, tuple | list) or shapes != [xs[0].shape] * len(xs):
            each = f"{'an array' if len(xs) == 1 else f'a tuple of {len(xs)} arrays'} of shape {xs[0].shape}"
            remedy = "return one array for each coordinate, of the shape of x"
            raise MapError(
                f"what {name} returns", f"of shape {', '.join(str(shape) for shape in shapes)}", each, remedy
            )
        return tuple(np.asarray(each, dtype=np.float64) for each in after)

    return on_arrays


def _of_arrays(formula: Any, alone: bool, values: dict[str, float]) -> Any:
    """Make a map of a numpy function of arrays, which is called as it is."""
    if not alone or not callable(formula) or isinstance(formula, type):
        given = shown(formula) if alone else "pieces or margin"
        remedy = "write def f(x, y, a): return np.where(x > 0, ...), ..."
        raise MapError("the map of vectorised=True", given, "one function of arrays alone", remedy)
    name = _name(formula).replace("<lambda>", "function")
    takes = tuple(_parameters_of(formula))
    values = _defaults_of({"first": formula}, values) | values
    coordinates = _coordinates_of({"first": formula}, {"first": takes}, values)
    fields = tuple(each for each in takes if each in values)
    _require_known(values, fields)
    on_arrays = _called(formula, name)
    key = ("vectorised", fields, id(formula))
    if key not in _CLASSES:
        cls = _class_with_fields(name, fields, formula.__doc__, coordinates)
        _FUNCTIONS[cls] = {"vectorised": formula}
        register_on_arrays(cls, len(coordinates), on_arrays)
        _CLASSES[key] = cls, [formula]
    made = _CLASSES[key][0](**{each: _number(each, values[each]) for each in fields})
    starts = np.array(TRIED)
    try:
        on_arrays(made, tuple(starts + 0.25 * k for k in range(len(coordinates))))
    except MapError:
        raise
    except Exception as error:
        raise MapError(
            f"what {name} does with {len(starts)} states",
            f"{type(error).__name__}: {error}",
            "arrays from arrays",
            "write it for arrays of shape (n,), without if",
        ) from error
    return made


# ---------------------------------------------------------------- the class


def _class_with_fields(name: str, fields: tuple[str, ...], doc: str | None, coordinates: Any) -> Any:
    """Make the class of parameters, which is not registered yet."""
    own = {
        "__slots__": (),
        "__module__": __name__,
        "__doc__": doc or f"The map {name}, of {', '.join(coordinates)}.",
        "__reduce__": _reduced,
        "with_values": _with_values,
    }
    fields_alone = namedtuple(name, fields)  # type: ignore[misc]  # noqa: PYI024  # names known only now
    return type(name, (fields_alone,), own)


def _class_of(
    functions: dict[str, Callable[..., Any]],
    takes: dict[str, tuple[str, ...]],
    coordinates: tuple[str, ...],
    fields: tuple[str, ...],
) -> Any:
    """Return the class of a map, registered once."""
    alive: list[Any] = []
    key = (fields, *(meaning(f, alive) for f in functions.values()))
    if key not in _CLASSES:
        _CLASSES[key] = _registered(functions, takes, coordinates, fields), alive
    cls = _CLASSES[key][0]
    _FUNCTIONS[cls] = functions  # other processes import the newest: the file of an older one may be gone
    return cls


def _registered(
    functions: dict[str, Callable[..., Any]],
    takes: dict[str, tuple[str, ...]],
    coordinates: tuple[str, ...],
    fields: tuple[str, ...],
) -> type:
    """Make the class of parameters, and register it with kernels that call the functions by their names."""
    first = functions["first"]
    cls: type = _class_with_fields(first.__name__, fields, first.__doc__, coordinates)
    x = {name: f"x[{k}]" if len(coordinates) > 1 else "x" for k, name in enumerate(coordinates)}
    calls = {
        name: f"{name}_function({', '.join(x.get(each, f'params.{each}') for each in takes[name])})"
        for name in functions
    }
    scope: dict[str, Any] = {f"{name}_function": _of_user(f) for name, f in functions.items()}
    scope["__name__"] = scope["first_function"].__module__
    kernels = ONE if len(functions) == 1 else TWO
    for text in kernels.values():
        exec(compile(text.format(**calls), __file__, "exec"), scope)  # noqa: S102  # our own text
    names = tuple(functions[name].__name__ for name in ("first", "second") if name in functions)
    branches = ("map",) if len(functions) == 1 else names if len(set(names)) == 2 else ("first", "second")
    register(cls, **{name: scope[name] for name in kernels}, dimension=len(coordinates), branches=branches)
    # By this name pickle finds the class of a signature that is kept on disk.
    cls.__qualname__ = f"{cls.__name__}({', '.join(fields)})"
    globals()[cls.__qualname__] = cls
    return cls


def _reduced(self: Any) -> Any:
    """Pickle the functions in place of the class: another process has none of its name."""
    return _again, (_FUNCTIONS[type(self)], self._asdict())


def _again(functions: dict[str, Any], values: dict[str, Any]) -> Any:
    """Make a map from what stands in its place in a pickle."""
    if len(functions) == 1:
        ((word, function),) = functions.items()
        return map(function, vectorised=word == "vectorised", **values)
    return map(pieces=(functions["first"], functions["second"]), margin=functions["margin"], **values)


def modules_of(cls: type) -> set[str]:
    """Names of the modules in which the functions of a map stand, or the class that was registered."""
    return {f.__module__ for f in _FUNCTIONS[cls].values()} if cls in _FUNCTIONS else {cls.__module__}


def _with_values(self: Any, **values: float) -> Any:
    """Give the map with other values of some parameters.

    Raises
    ------
    MapError
        For a name that is no parameter, or a value that is no number.
    """
    _require_known(values, self._fields)
    return self._replace(**{name: _number(name, value) for name, value in values.items()})


def _of_user(f: Any) -> Any:
    """Return a function as one from outside the package: an example in a docstring of ours is a user's too."""
    if not is_known(f):
        return f
    copy = FunctionType(f.__code__, f.__globals__, f.__name__, f.__defaults__)
    copy.__module__ = "__main__"
    return copy
