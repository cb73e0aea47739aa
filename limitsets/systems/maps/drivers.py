"""Loops over whole arrays, written once for every map: images, orbits, random numbers by counters.

A batch is all on one side: what the side needs is gathered once and the loop vectorises.  States of a map in more
than one dimension travel as a tuple of arrays, one per coordinate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import MapError, Table, Tabled, arguments_checked, shown
from limitsets.numbers.jit import kernel
from limitsets.systems.cells import Domain
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import (
    compiled_kind_of,
    kind_of,
    or_register,
    require_codes,
    require_dimension,
    require_sides,
)
from limitsets.systems.maps.kernels import (
    Closing,
    displacement,
    entries_of,
    fallback,
    image,
    image_on,
    in_domain,
    on_side,
    pick,
    put,
    scattered,
)

# ----------------------------------------------------------------
# Random numbers that depend on a seed and on counters only: for noise that differs at every step of every
# start.
#
# Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011): ten rounds of two
# 32-bit multiplications turn four counters and a key of two into four random words.  Nothing is kept from one call to
# the next, so results do not depend on the order of the work, on batches or on threads.


Words: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64]

# np.uint64 throughout: numba turns a mixture of signed and unsigned integers into floats.
LOW = np.uint64(0xFFFFFFFF)
HALF = np.uint64(32)
MULTIPLIER_0, MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
WEYL_0, WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)


@kernel
def philox(seed: int, a: int, b: int) -> Words:
    """Four random 32-bit words for a seed and two 64-bit counters."""
    k0, k1 = np.uint64(seed) & LOW, np.uint64(seed) >> HALF
    c0, c1 = np.uint64(a) & LOW, np.uint64(a) >> HALF
    c2, c3 = np.uint64(b) & LOW, np.uint64(b) >> HALF
    for _ in range(10):
        first, second = MULTIPLIER_0 * c0, MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (
            (second >> HALF) ^ c1 ^ k0,
            second & LOW,
            (first >> HALF) ^ c3 ^ k1,
            first & LOW,
        )
        k0, k1 = (k0 + WEYL_0) & LOW, (k1 + WEYL_1) & LOW
    return c0, c1, c2, c3


@kernel
def uniform_pair(seed: int, a: int, b: int) -> tuple[float, float]:
    """Two numbers in (0, 1), each with 52 random bits; never 0 or 1."""
    c0, c1, c2, c3 = philox(seed, a, b)
    first = ((c0 << HALF) | c1) >> np.uint64(12)
    second = ((c2 << HALF) | c3) >> np.uint64(12)
    return (float(first) + 0.5) * 2.0**-52, (float(second) + 0.5) * 2.0**-52


@kernel
def normal_pair(seed: int, a: int, b: int) -> tuple[float, float]:
    """Two independent standard normal numbers, by the method of Box and Muller; none beyond 8.5."""
    u, v = uniform_pair(seed, a, b)
    radius = math.sqrt(-2.0 * math.log(u))
    return radius * math.cos(2.0 * math.pi * v), radius * math.sin(2.0 * math.pi * v)


# ----------------------------------------------------------------
# Loops over whole arrays, written once for every map.


@kernel
def judged(x: Any, code: Any) -> Any:
    """Code of a step to x: `UNDEFINED` where a coordinate is nan, for no comparison with it is true."""
    # of an array or a list this does not compile, and a comparison would fail as it runs
    float(entries_of(x)[0])
    return codes.UNDEFINED if (x != x) & (code != codes.UNSETTLED) else code


@kernel
def step(params: Any, x: Any, side: Any) -> Any:
    """One step of any map, the sure way where the fast one cannot vouch for its answer."""
    after, side_after, code = image(params, x, side)
    if code == codes.UNSETTLED:
        after, side_after, code = fallback(params, x, side)
    return after, side_after, judged(after, code)


@kernel(entry=True)
def fill_images(params: Any, side: int, xs: Any, after: Any, side_after: Any, code_after: Any) -> Any:
    """Images of states on one side; how many of them the fast kernel could not vouch for."""
    here = on_side(params, side)
    for k in range(xs[0].size):
        x, to, code = image(here, pick(xs, k), side)
        put(after, k, x)
        side_after[k] = to
        code_after[k] = judged(x, code)
    again = 0
    for k in range(xs[0].size):
        if code_after[k] == codes.UNSETTLED:
            x, to, code = fallback(here, pick(xs, k), side)
            put(after, k, x)
            side_after[k] = to
            code_after[k] = judged(x, code)
            again += 1
    return again


@kernel(entry=True)
def _images_on(params: Any, side: int, branch: int, xs: Any, after: Any, side_after: Any) -> None:
    here = on_side(params, side)
    for k in range(xs[0].size):
        x, to, _ = image_on(here, pick(xs, k), side, branch)
        put(after, k, x)
        side_after[k] = to


@kernel(entry=True)
def _orbit(params: Any, start: int, xs: Any, sides: Any, code_after: Any, axes: Closing | None) -> Any:
    """Fill an orbit from its first state; the number of steps made before an exit."""
    for k in range(code_after.size):
        x, side, code = step(scattered(params, start, k), pick(xs, k), sides[k])
        put(xs, k + 1, in_domain(x, side, axes))
        sides[k + 1] = side
        code_after[k] = code
        if code < 0:
            return k + 1
    return code_after.size


@kernel(entry=True)
def _advance(
    params: Any,
    first: int,
    count: int,
    xs: Any,
    sides: Any,
    code_after: Any,
    steps: Any,
    axes: Closing | None,
) -> None:
    for k in range(steps.size):
        x, side, code = pick(xs, k), sides[k], 0
        made = 0
        while made < count and code >= 0:
            after, side, code = step(scattered(params, first + k, made), x, side)
            x = in_domain(after, side, axes)
            made += 1
        put(xs, k, x)
        sides[k] = side
        code_after[k] = code
        steps[k] = made


@kernel(entry=True)
def _displacement(params: Any, x: float, side: int) -> Any:
    return displacement(on_side(params, side), x, side)


def displacements(params: Any, x: ArrayLike, side: int) -> NDArray[np.float64]:
    """x' - x of many states on one side, without cancellation, for a map with `displacement`."""
    require_sides(params, side, side)
    return np.array([_displacement(params, float(at), side) for at in np.asarray(x, dtype=np.float64)])


def columns(x: ArrayLike, dimension: int) -> tuple[NDArray[np.float64], ...]:
    """States of shape (n,) or (n, dimension) as a tuple of coordinate arrays, as kernels take them."""
    states = np.asarray(x, dtype=np.float64)
    if dimension == 1 and states.ndim == 1:
        return (np.ascontiguousarray(states),)
    if states.ndim != 2 or states.shape[1] != dimension:
        raise MapError(
            "the shape of the states",
            states.shape,
            f"(n, {dimension}), or (n,) in one dimension",
            "reshape them",
        )
    return tuple(map(np.ascontiguousarray, states.T))


def rows(xs: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
    """Undo `columns`."""
    return xs[0] if len(xs) == 1 else np.stack(xs, axis=1)


@dataclass(frozen=True)
class Images:
    """Images of many states that share a side.

    Attributes
    ----------
    x : ndarray, shape (n,) or (n, dimension)
        Where they land, in the map's unit.
    side, code : ndarray of int, shape (n,)
        On which side, and what happened (`limitsets.systems.maps.codes`).
    second_pass : float
        Share of the states that the fast kernel could not vouch for.
    """

    x: NDArray[np.float64]
    side: NDArray[np.int64]
    code: NDArray[np.int64]
    second_pass: float


@arguments_checked
def images(params: Any, x: ArrayLike, side: int) -> Images:
    """Images of many states on one side.

    Parameters
    ----------
    params : NamedTuple
        A map.
    x : array_like, shape (n,) or (n, dimension)
        States.
    side : int
        Their side.

    Returns
    -------
    Images
        Where they land, and what happened.

    Raises
    ------
    MapError
        For states of another shape, or a side the map has not.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.images(maps.Doubling(2.0), [0.1, 0.6], 0).x
    array([0.2, 0.2])
    """
    kind = kind_of(params)
    xs = columns(x, kind.dimension)
    require_sides(params, side, side)
    count = xs[0].size
    if kind.on_arrays is not None:
        after = kind.on_arrays(params, xs)
        return Images(rows(after), np.zeros(count, np.int64), _codes_of(after), 0.0)
    after = tuple(np.empty(count) for _ in xs)
    side_after, code = np.empty(count, np.int64), np.empty(count, np.int64)
    again = fill_images(params, side, xs, after, side_after, code)
    return Images(rows(after), side_after, code, again / max(count, 1))


def _codes_of(after: tuple[NDArray[np.float64], ...]) -> NDArray[np.int64]:
    """Codes of images of a function of arrays: branch 0, or `UNDEFINED` where a coordinate is nan."""
    undefined = np.logical_or.reduce([np.isnan(values) for values in after])
    return np.where(undefined, codes.UNDEFINED, 0).astype(np.int64)


def _arrays_after(params: Any, xs: Any, domain: Domain | None) -> tuple[NDArray[np.float64], ...]:
    """Images by a function of arrays, turned to a domain."""
    after: tuple[NDArray[np.float64], ...] = kind_of(params).on_arrays(params, xs)  # type: ignore[misc]
    return after if domain is None else columns(domain.wrapped(rows(after), 0), len(after))


def closing_of(domain: Domain | None) -> Closing | None:
    """Give the axes of a domain that close, as kernels take them; None where none does."""
    return None if domain is None or not domain.closes else Closing(domain.lo, domain.period)


def _advanced_on_arrays(
    params: Any, count: int, xs: Any, sides: Any, code_after: Any, steps: Any, domain: Domain | None
) -> None:
    """Do what `_advance` does, of all starts that go on at once."""
    code_after[:], steps[:], sides[:] = 0, 0, 0
    going = np.arange(steps.size)
    for _ in range(count):
        if not going.size:
            return
        after = _arrays_after(params, tuple(values[going] for values in xs), domain)
        for values, each in zip(xs, after, strict=True):
            values[going] = each
        code_after[going] = _codes_of(after)
        steps[going] += 1
        going = going[code_after[going] >= 0]


@arguments_checked
def images_on(
    params: Any, x: ArrayLike, side: int, branch: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Find images of many states on one side if they all took one branch.

    Parameters
    ----------
    params : NamedTuple
        The map.
    x : array_like, shape (m,) or (m, dimension)
        The states.
    side : int
        Their side.
    branch : int
        The branch.

    Returns
    -------
    ndarray, shape (m,) or (m, dimension)
        The images.
    ndarray of int, shape (m,)
        Their sides.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> x, side = ls.maps.images_on(scene.map, [21.0], 2, ls.maps.FLIP)
    >>> x.round(2), side
    (array([16.55]), array([0]))
    """
    xs = columns(x, compiled_kind_of(params, "images_on").dimension)
    require_sides(params, side, side)
    after = tuple(np.empty(xs[0].size) for _ in xs)
    side_after = np.empty(xs[0].size, np.int64)
    _images_on(params, side, branch, xs, after, side_after)
    return rows(after), side_after


@dataclass(frozen=True)
class Orbit(Tabled):
    """Successive states of one start.

    Attributes
    ----------
    x : ndarray, shape (m + 1,) or (m + 1, dimension)
        States, the start first, in the map's unit.
    side : ndarray of int, shape (m + 1,)
        Their sides.
    code : ndarray of int, shape (m,)
        What each step was.
    stopped : str or None
        Why there are fewer steps than asked for: the name of an exit, or "stalled" where a step moves by less than
        the spacing of floating-point numbers at x, which is no fixed point.
    """

    x: NDArray[np.float64]
    side: NDArray[np.int64]
    code: NDArray[np.int64]
    stopped: str | None

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        codes: list[int | None] = [None, *self.code.tolist()]
        rows = zip(range(len(codes)), self.x.tolist(), self.side.tolist(), codes, strict=True)
        return (Table(("step", "x", "side", "code"), rows, "Orbit", "computed, not proved"),)


def start_of(params: Any, x: Any, side: int) -> tuple[float, ...]:
    """Check one start of a map; its coordinates, or MapError."""
    kind = kind_of(params)
    try:
        start = np.atleast_1d(np.asarray(x, dtype=np.float64))
    except (TypeError, ValueError):  # a text, a list of lists, ...
        start = np.empty(0)
    numbers = "a finite number" if kind.dimension == 1 else f"{kind.dimension} finite numbers"
    if start.shape != (kind.dimension,) or not np.isfinite(start).all():
        remedy = "give x as a number, in the map's own unit" if isinstance(x, str) else "give one state"
        if start.ndim == 1 and 0 < start.size <= 3:
            remedy += or_register(params, start.size)
        raise MapError("the start x", shown(x), numbers, remedy)
    require_sides(params, side, side)
    return tuple(float(v) for v in start)


def start_in(params: Any, x: Any, side: int, domain: Domain | None) -> tuple[float, ...]:
    """Check one start of a map, as `start_of`, and turn it to a domain."""
    start = start_of(params, x, side)
    if domain is None:
        return start
    require_dimension(params, "domain", domain.dimension)
    require_sides(params, 0, domain.sides - 1)
    if side >= domain.sides:
        raise MapError("the side", side, f"one of the {domain.sides} of the domain", "name one of these")
    return tuple(domain.wrapped(np.array([start]), side)[0].tolist())


@arguments_checked
def orbit(params: Any, x: Any, side: int, count: int, *, domain: Domain | None = None) -> Orbit:
    """Follow one start for `count` steps, or until it leaves or stalls.

    Parameters
    ----------
    params : NamedTuple
        A map.
    x : float or sequence of float
        Start, in the map's unit; the formulas of a map know no domain, so that of the throw it may lie beyond the arm's
        end.
    side : int
        Side of the start.
    count : int
        Steps.
    domain : Domain, optional
        Of a grid with axes that close, ``grid.domain``: start and states are turned to it, each before the next step.
        Without it the orbit follows the formulas wherever they lead.

    Returns
    -------
    Orbit
        The states, and why it stopped early if it did.

    Raises
    ------
    MapError
        For a start that is no state of the map.

    Examples
    --------
    >>> import limitsets as ls
    >>> ls.orbit(ls.maps.Logistic(4.0), 0.75, 0, 2).x
    array([0.75, 0.75, 0.75])
    >>> def turn(x):
    ...     return x + 0.375
    >>> circle = ls.grid([(0.0, 1.0)], periodic=True)
    >>> ls.orbit(ls.map(turn), 0.5, 0, 3, domain=circle.domain).x
    array([0.5  , 0.875, 0.25 , 0.625])
    """
    start = start_in(params, x, side, domain)
    if count < 0:
        raise MapError("the number of steps", count, "an integer from 0", "pass count=100")
    xs, sides, code = empty_orbit(start, side, count)
    on_arrays = kind_of(params).on_arrays
    if on_arrays is None:
        return as_orbit(params, xs, sides, code, _orbit(params, 0, xs, sides, code, closing_of(domain)))
    sides[:], code[:], made = 0, 0, 0
    while made < count and not (made and code[made - 1] < 0):
        after = _arrays_after(params, tuple(values[made : made + 1] for values in xs), domain)
        for values, each in zip(xs, after, strict=True):
            values[made + 1] = each[0]
        code[made] = _codes_of(after)[0]
        made += 1
    return as_orbit(params, xs, sides, code, made)


def empty_orbit(start: tuple[float, ...], side: int, count: int) -> tuple[Any, Any, Any]:
    """Arrays for an orbit of `count` steps, the first state in its place: states, sides, codes."""
    xs = tuple(np.empty(count + 1) for _ in start)
    for values, value in zip(xs, start, strict=True):
        values[0] = value
    sides = np.empty(count + 1, np.int64)
    sides[0] = side
    return xs, sides, np.empty(count, np.int64)


def as_orbit(params: Any, xs: Any, sides: Any, code: Any, made: int) -> Orbit:
    """Cut an orbit off where it left or stalled, and say why."""
    kind = kind_of(params)
    require_codes(params, code[:made])
    stopped = None
    if made and code[made - 1] < 0:
        stopped = next(name for name, exit_code in kind.exits.items() if exit_code == code[made - 1])
    elif kind.has_displacement and kind.dimension == 1:
        still = np.flatnonzero((xs[0][1 : made + 1] == xs[0][:made]) & (sides[1 : made + 1] == sides[:made]))
        for k in still[:1]:  # the states repeat from there on
            if _displacement(params, float(xs[0][k]), int(sides[k])) != 0.0:
                made, stopped = int(k), "stalled"
    return Orbit(rows(tuple(values[: made + 1] for values in xs)), sides[: made + 1], code[:made], stopped)


@arguments_checked
def advance(
    params: Any, x: ArrayLike, side: ArrayLike, count: int, *, first: int = 0, domain: Domain | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Send many starts `count` steps ahead: states, sides, last codes, steps made before an exit.

    Steps that round away are counted like all others; `orbit` tells them apart ("stalled").

    Where the parameters scatter, the starts are numbered on from `first`, and what they draw depends on nothing else:
    the same starts in several batches, or threads, do the same.

    Parameters
    ----------
    params : NamedTuple
        The map.
    x : array_like, shape (m,) or (m, dimension)
        The starts.
    side : array_like of int, shape (m,)
        Their sides; or one for all.
    count : int
        Number of steps.
    first : int
        Number of the first start.
    domain : Domain, optional
        With axes that close: each state is turned to it, as by `orbit`.

    Returns
    -------
    ndarray, shape (m,) or (m, dimension)
        The states at the end.
    ndarray of int, shape (m,)
        Their sides.
    ndarray of int, shape (m,)
        Codes of the last steps.
    ndarray of int, shape (m,)
        Number of steps before an exit.

    Examples
    --------
    >>> from limitsets import maps
    >>> x, side, code, steps = maps.advance(maps.Logistic(3.2), [0.3, 0.4], [0, 0], 1000)
    >>> steps
    array([1000, 1000])
    """
    xs = tuple(values.copy() for values in columns(x, kind_of(params).dimension))
    sides = np.array(np.broadcast_to(np.asarray(side, dtype=np.int64), xs[0].shape))
    if sides.size:
        require_sides(params, int(sides.min()), int(sides.max()))
    code, steps = np.empty(sides.size, np.int64), np.empty(sides.size, np.int64)
    if kind_of(params).on_arrays is None:
        _advance(params, first, count, xs, sides, code, steps, closing_of(domain))
    else:
        _advanced_on_arrays(params, count, xs, sides, code, steps, domain=domain)
    return rows(xs), sides, code, steps
