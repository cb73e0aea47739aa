"""What is averaged along orbits: words, ranges of x and functions, as a user names them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, LimitsetsError, shown
from limitsets.base.arrays import Array
from limitsets.proofs.prover.average_steps import Values
from limitsets.proofs.prover.certificate_of_map import hexed
from limitsets.proofs.prover.programs import evaluate
from limitsets.proofs.prover.recording import names_of, recorded

JOG, FLIP = 0, 1
Span = tuple[int, float, float]
"""A side and the ends of a range on it."""


class Observable(NamedTuple):
    """A function that is averaged: a name, how a certificate names it, its values, where it jumps, by side."""

    name: str
    section: dict[str, Any]
    values: Values
    jumps: Sequence[tuple[int, float]] = ()


Quotient = tuple[str, int, int]
"""A name, and the numbers of two functions in a list of some."""


@dataclass(frozen=True)
class Asked:
    """The functions that are averaged, and quotients of two of them."""

    functions: tuple[Observable, ...]
    quotients: tuple[Quotient, ...] = ()

    @property
    def jumps(self) -> list[tuple[int, float]]:
        """Where functions jump, by side."""
        return [jump for each in self.functions for jump in each.jumps]


class Subject(NamedTuple):
    """What may be averaged of a map or a scene.

    Attributes
    ----------
    params : NamedTuple
        The parameters that a function may use.
    places : mapping of int to (float, float)
        By side where states lie.
    length : callable
        Reads the end of a range.
    thrown : sequence of int
        Of a scene the sides that parts are thrown from, none of a map.
    """

    params: Any
    places: Mapping[int, tuple[float, float]]
    length: Callable[[Any], float] = float
    thrown: Sequence[int] = ()


@np.errstate(divide="ignore")  # a slope of 0, where nothing is proved
def _logarithm(_: Array, slope: Array, __: int, ___: int) -> Array:
    return np.asarray(np.log(np.abs(slope)))


def _steps(name: str, steps: Sequence[tuple[int, int]]) -> Observable:
    """Count steps from some sides on some branches."""
    listed = {"steps": [list(pair) for pair in steps]}
    return Observable(name, listed, lambda x, _, *key: np.full(x.size, 1.0 if key in steps else 0.0))


def _formula(of: Callable[[Any], Any], params: Any) -> Observable:
    program = recorded(lambda _, x, __: of(x), params, 1, 0)
    numbers = dict(names_of(params))
    formula = {key: program[key] for key in ("ops", "out")}
    name = getattr(of, "__name__", "function")
    return Observable(
        "function" if name == "<lambda>" else name,
        {"formula": formula},
        lambda x, *_: np.asarray(evaluate(program, x[:, None], numbers)[:, 0]),
    )


def _is_ranges(of: Any) -> bool:
    """Whether a list is one of pairs of ends, and not of functions."""
    pairs = isinstance(of, list | tuple) and all(isinstance(one, list | tuple) for one in of)
    return pairs and not any(isinstance(end, list | tuple | Mapping) for one in of for end in one)


def _share(of: Any, subject: Subject) -> Observable | None:
    """Read ranges whose share of steps is asked for, by side or on all sides; None if these are none."""
    alone = _is_ranges(of) and len(of) > 0
    by_side = dict.fromkeys(subject.places, of) if alone else of
    if not isinstance(by_side, Mapping) or not by_side or not all(map(_is_ranges, by_side.values())):
        return None
    spans = [
        (_side(side, subject), *_ends(pair, subject)) for side, listed in by_side.items() for pair in listed
    ]
    on = _on_sides(spans, subject, all_of_them=not alone)
    listed = [{"side": side, "box": hexed(np.array([[lo, hi]]))} for side, lo, hi in on]

    def share(x: Array, _: Array, side: int, __: int) -> Array:
        inside = [(lo <= x) & (x <= hi) for s, lo, hi in on if s == side]
        return np.asarray(np.any([np.zeros(x.size, dtype=bool), *inside], axis=0), dtype=np.float64)

    ends = [(side, end) for side, *both in on for end in both]
    several = len(subject.places) > 1 and not alone
    words = [f"{lo:g}_to_{hi:g}" + (f"_on_side_{side}" if several else "") for side, lo, hi in spans]
    name = f"share_of_{'_and_'.join(dict.fromkeys(words))}"
    return Observable(name, {"share": listed}, share, ends)


def _on_sides(spans: Sequence[Span], subject: Subject, *, all_of_them: bool) -> list[Span]:
    """Require that ranges meet the places of their sides, all of them or one at least, and return those."""
    places = subject.places
    on = [(side, lo, hi) for side, lo, hi in spans if lo < places[side][1] and places[side][0] < hi]
    if not on or (all_of_them and len(on) < len(spans)):
        side, lo, hi = next(span for span in spans if span not in on)
        first, last = places[side]
        allowed = f"one that meets {first:.6g} to {last:.6g}, where states of side {side} lie"
        raise AnswerError("the range to average over", f"{lo:g} to {hi:g}", allowed, "name another")
    return on


def _side(side: Any, subject: Subject) -> int:
    """Require that a side is there."""
    if isinstance(side, bool) or side not in subject.places:
        allowed = ", ".join(map(str, subject.places))
        raise AnswerError("the side of a range", shown(side), allowed, "name one of these")
    return int(side)


def _ends(pair: Sequence[Any], subject: Subject) -> tuple[float, float]:
    """Read the ends of a range."""
    allowed = "two numbers, or lengths of a scene with a unit, the lower one first"
    try:
        lo, hi = (subject.length(end) for end in pair)
        ordered = lo < hi
    except (TypeError, ValueError) as error:
        if isinstance(error, LimitsetsError):  # of a unit, which says more
            raise
        ordered = False
    if not ordered:
        raise AnswerError("the range to average over", shown(pair), allowed, "write (8.0, 20.0)")
    return lo, hi


def _flips(sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    return [_steps("flips_per_throw", [(side, FLIP) for side in sides])], []


def _side_shares(sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    return [_steps(f"share_of_throws_from_side_{k}", [(k, JOG), (k, FLIP)]) for k in sides], []


def _jogs_per_visit(sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    ways = [(k, branch, word) for k in sides for branch, word in ((JOG, "jogs"), (FLIP, "flips"))]
    counts = [_steps(f"{word}_per_throw_on_side_{k}", [(k, branch)]) for k, branch, word in ways]
    return counts, [(f"mean_jogs_per_visit_of_side_{k}", 2 * at, 2 * at + 1) for at, k in enumerate(sides)]


OF_THROWS = {"flips_per_throw": _flips, "side_shares": _side_shares, "jogs_per_visit": _jogs_per_visit}
"""What can be asked of a scene alone, by its word."""


def _asked_alone(one: Any, subject: Subject) -> tuple[list[Observable], list[Quotient]]:
    """Read one thing that is asked for."""
    words = ["lyapunov", *(OF_THROWS if subject.thrown else ())]
    if isinstance(one, str) and one in words:
        if one == "lyapunov":
            return [Observable(one, {"lyapunov": True}, _logarithm)], []
        return OF_THROWS[one](subject.thrown)
    if callable(one):
        return [_formula(one, subject.params)], []
    share = None if isinstance(one, str) else _share(one, subject)
    if share is not None:
        return [share], []
    near = get_close_matches(one, words, 1) if isinstance(one, str) else []
    allowed = f"{', '.join(words)}, a function of x, or ranges [(lo, hi)] whose share of steps is asked for"
    remedy = f"did you mean {near[0]!r}?" if near else "name one of these"
    raise AnswerError("the function to average", shown(one), allowed, remedy)


def asked_for(of: Any, subject: Subject) -> Asked:
    """Read what is averaged, one function or a list of some.

    Raises
    ------
    AnswerError
        What is none of the functions, and ranges that are not there.
    """
    several = isinstance(of, list | tuple) and not _is_ranges(of)
    functions, quotients = list[Observable](), list[Quotient]()
    for one in of if several else [of]:
        more, between = _asked_alone(one, subject)
        quotients += [(name, i + len(functions), j + len(functions)) for name, i, j in between]
        functions += more
    names = [each.name for each in functions]
    alike = [names[:k].count(name) for k, name in enumerate(names)]
    named = [
        each._replace(name=f"{each.name}_{count + 1}") if count else each
        for each, count in zip(functions, alike, strict=True)
    ]
    return Asked(tuple(named), tuple(quotients))
