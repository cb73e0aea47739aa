"""The formulas of a map as a certificate has them: a program for each side and branch, and a margin for each side.

`recording` makes them, and nothing in them is believed: the reader compares what is printed with what was meant.  Here
they are compared with the compiled functions at random places.  A program can differ only in what Python and compiled
code do differently for all x at once (`isinstance`, whole numbers beyond 64 bits), for no comparison of x is recorded.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from limitsets.base import AnswerError, arguments_checked
from limitsets.base.arrays import Array
from limitsets.proofs.prover.recording import LEAVES, decimal, entries_of, names_of, recorded
from limitsets.systems.cells import Domain, Grid, as_domain
from limitsets.systems.maps import codes, coerce, images, images_on, kernels, kind_of
from limitsets.systems.maps.contract import (
    between,
    compiled_kind_of,
    require_corners,
    require_dimension,
    require_sides,
)
from limitsets.systems.maps.critical import margins

# Places at which a program is compared, and how far it may be off, of the value and the extent.
PLACES, NEAR = 512, 1e-9

# Half the width of the box of these places where no domain is given.
HALF = 2.0

MOST_SIDES = 64

# Longest list of lines that is printed whole; of a longer one as many at each end.
WHOLE, ENDS = 40, 10

# Letters from which on a part of a formula stands in a line of its own.
LONG = 90

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.]{0,40}")

SIGNS = {"add": ("+", 1), "sub": ("-", 1), "mul": ("*", 2), "div": ("/", 2)}

# In doubles, on whole arrays.
NUMPY: dict[str, Callable[..., Any]] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "min": np.minimum, "max": np.maximum,
    "atan2": np.arctan2, "neg": np.negative, "abs": np.abs, "sqrt": np.sqrt, "cbrt": np.cbrt, "exp": np.exp,
    "log": np.log, "sin": np.sin, "cos": np.cos, "tan": np.tan, "tanh": np.tanh, "floor": np.floor,
}  # fmt: skip

# A parameter that could be read as something else is printed with "p." before it.
AMBIGUOUS = re.compile(
    rf"[xt]\d*(\..*)?|p\..*|{'|'.join(NUMPY)}|pow|margin|branch|side|pi|tau|e|inf|nan|if|else|mod",
    re.IGNORECASE,
)


# ---------------------------------------------------------------- the table


def recorded_map(params: Any, sides: int) -> dict[str, Any]:
    """Record a map: the table `map` of a certificate of format 3.

    Parameters
    ----------
    params : NamedTuple
        A map, of a registered class.
    sides : int
        How many sides it has.

    Returns
    -------
    dict
        `dimension`, `sides`, `branches`, `parameters` (names), `programs`, `margins` and `periodic`.

    Raises
    ------
    AnswerError
        For a map that cannot be recorded: what it does, and where.
    """
    kind, params = kind_of(params), coerce(params)
    forced = ("side", "branch") if kind.has_image_on else ("side",)
    _require_recordable(type(params), kind, sides)
    names = [name for name, _ in names_of(params)]
    for name in names:
        if not NAME.fullmatch(name):
            raise AnswerError(
                "the parameter", name, "a name of at most 41 letters from A to z, digits and _", "rename it"
            )
    step = (kernels.forced if kind.has_image_on else kernels.image).methods[type(params)]
    programs, margin_of_side = [], []
    for side in range(sides):
        for branch in range(len(kind.branches)):
            program = recorded(step, params, kind.dimension, *(side, branch)[: len(forced)])
            if len(program["out"]) != kind.dimension or not 0 <= program["to"] < sides:
                raise AnswerError(
                    f"the image of {kind.name} on side {side}",
                    f"{len(program['out'])} numbers, on side {program['to']}",
                    f"{kind.dimension} numbers, on a side from 0 to {sides - 1}",
                    "correct what it returns, or give the number of sides",
                )
            programs.append({"side": side, "branch": branch, **program})
        if not kind.has_margin:  # names of branches alone: every branch has the one formula
            first, *others = programs[-len(kind.branches) :]
            if any({**program, "branch": first["branch"]} != first for program in others):
                _refuse_branches(kind)
            del programs[len(programs) - len(others) :]
        else:
            program = recorded(kernels.margin.methods[type(params)], params, kind.dimension, side)
            margin_of_side.append({"side": side, "ops": program["ops"], "out": program["out"]})
    return {
        "dimension": kind.dimension,
        "sides": sides,
        "branches": len(kind.branches) if kind.has_margin else 1,
        "parameters": names,
        "programs": programs,
        "margins": margin_of_side,
        "periodic": [[None] * kind.dimension for _ in range(sides)],
    }


def names_alone(params: Any) -> bool:
    """Whether the branches of a map are names alone: it has several, no `margin`, and one formula for all of them."""
    kind = kind_of(params)
    if kind.has_margin or len(kind.branches) == 1 or not kind.has_image_on:
        return False
    step, params = kernels.forced.methods[type(params)], coerce(params)
    try:
        branches = [recorded(step, params, kind.dimension, 0, branch) for branch in range(len(kind.branches))]
    except AnswerError:
        return False
    return all(each == branches[0] for each in branches)


def _require_recordable(cls: type, kind: Any, sides: int) -> None:
    """Refuse maps of which a certificate could not speak."""
    extra = next((name for name in ("scattered", "on_side") if cls in getattr(kernels, name).methods), None)
    if extra:
        remedy = "register the map without; a feeder is certified as a scene"
        raise AnswerError("the map", f"{kind.name}, which has {extra}", "a map whose parameters stay", remedy)
    if len(kind.branches) != 2 and kind.has_margin:
        _refuse_branches(kind)
    if not 1 <= sides <= MOST_SIDES:
        raise AnswerError("the number of sides", sides, f"1 to {MOST_SIDES}", "pass sides=1")


def _refuse_branches(kind: Any) -> NoReturn:
    raise AnswerError(
        "the map",
        f"{kind.name}, of {len(kind.branches)} branches, with{'' if kind.has_margin else 'out'} margin",
        "a map of one formula, or of two with image_on and margin",
        "register image_on and margin for two branches",
    )


# ---------------------------------------------------------------- the comparison


def evaluate(program: dict[str, Any], x: Array, parameters: dict[str, float]) -> Array:
    """Run a program in doubles.

    Parameters
    ----------
    program : dict
        Its `ops` and `out`.
    x : ndarray, shape (m, d)
        Places.
    parameters : dict of str to float
        By name.

    Returns
    -------
    ndarray, shape (m, number of outputs)
        The outputs.

    Examples
    --------
    >>> import numpy as np
    >>> square = {"ops": [["x", 0], ["pow", 0, 2], ["p", "a"], ["mul", 2, 1]], "out": [3]}
    >>> evaluate(square, np.array([[3.0]]), {"a": 2.0})
    array([[18.]])
    """
    values: list[Any] = []
    with np.errstate(all="ignore"):
        for word, *rest in program["ops"]:
            if word in LEAVES:
                values.append(
                    x[:, rest[0]] if word == "x" else parameters[rest[0]] if word == "p" else float(rest[0])
                )
            elif word == "pow":
                values.append(np.power(values[rest[0]], float(rest[1])))
            else:
                values.append(NUMPY[word](*(values[k] for k in rest)))
    return np.stack([np.broadcast_to(values[k], len(x)) for k in program["out"]], axis=1)


def require_same(lower: Any, upper: Any, table: dict[str, Any], domain: Domain) -> None:
    """Compare the programs of a map with its compiled functions, at random places of the domain.

    Parameters
    ----------
    lower, upper : NamedTuple
        Corners of the parameters: both are asked, and parameters at random between.
    table : dict
        What `recorded_map` gave.
    domain : Domain
        Where places are drawn.

    Raises
    ------
    AnswerError
        A program and its function differ.
    """
    require_corners(lower, upper)
    random, ends = np.random.default_rng(0), (coerce(lower), coerce(upper))
    kind = kind_of(lower)
    for params in (*ends, between(*ends, random.random)):
        numbers = dict(names_of(params))
        for program in (*table["programs"], *table["margins"]):
            side, extent = program["side"], domain.hi[program["side"]] - domain.lo[program["side"]]
            x = domain.lo[side] + random.random((PLACES, len(extent))) * extent
            if "branch" not in program:
                name, to = "margin", side
                compiled: Any = margins(params, x, side)[:, None]
                size = float(extent.max())
            elif kind.has_image_on:
                name, size = "image_on", extent
                compiled, to = images_on(params, x, side, program["branch"])
            else:
                name, size, step = "image", extent, images(params, x, side)
                compiled, to = step.x, np.where(step.code == codes.UNDEFINED, program["to"], step.side)
            value, compiled = evaluate(program, x, numbers), np.reshape(compiled, (PLACES, -1))
            with np.errstate(invalid="ignore"):
                far = ~(np.abs(value - compiled) <= NEAR * (np.abs(compiled) + size))
            far &= np.isfinite(value) | np.isfinite(compiled)
            wrong = far.any(axis=1) | (np.asarray(to) != program.get("to", side))
            if wrong.any():
                k = int(wrong.argmax())
                raise AnswerError(
                    f"the recorded formula of {name} of {kind.name} at x = {', '.join(map(str, x[k]))}, side {side}",
                    f"{', '.join(map(str, value[k]))}, on side {program.get('to', side)}",
                    f"{', '.join(map(str, compiled[k]))}, as it is compiled",
                    "write it without isinstance, try, whole numbers beyond 64 bits and globals that change",
                )


# ---------------------------------------------------------------- the text


def _operand(texts: list[tuple[str, int]], k: int, least: int) -> str:
    """Text number k, in brackets where it binds less strongly."""
    text, level = texts[k]
    return text if level >= least else f"({text})"


def _formula(operation: list[Any], texts: list[tuple[str, int]]) -> tuple[str, int]:
    """Write one operation, and how strongly it binds: 1 sums and signs, 2 products, 3 powers and numbers, 4 names."""
    word, *rest = operation
    if word == "x":
        return f"x{rest[0]}", 4
    if word == "p":
        return f"p.{rest[0]}" if AMBIGUOUS.fullmatch(rest[0]) else rest[0], 4
    if word == "c":
        return rest[0], 1 if rest[0].startswith("-") else 3
    if word == "pow":
        base, power = _operand(texts, rest[0], 4), str(rest[1])
        return f"{base}^{power}" if rest[1] > 0 else f"{base}^({power})", 3
    if word == "neg":
        return f"-{_operand(texts, rest[0], 3)}", 1
    if word in SIGNS:
        sign, level = SIGNS[word]
        return f"{_operand(texts, rest[0], level)} {sign} {_operand(texts, rest[1], level + 1)}", level
    return f"{word}({', '.join(texts[k][0] for k in rest)})", 4


def _lines(program: dict[str, Any], outputs: list[str]) -> list[str]:
    """Write a program: parts that occur twice, or are long, as ``t1 = ...`` before the outputs."""
    operations = program["ops"]
    uses = np.bincount([k for op in operations for k in entries_of(op)], minlength=len(operations))
    lines: list[str] = []
    texts: list[tuple[str, int]] = []
    for k, operation in enumerate(operations):
        text, level = _formula(operation, texts)
        whole = k in program["out"] and uses[k] == 0
        if (
            operation[0] not in LEAVES
            and not whole
            and (uses[k] + (k in program["out"]) > 1 or len(text) > LONG)
        ):
            lines.append(f"    t{len(lines) + 1} = {text}")
            text, level = f"t{len(lines)}", 4
        texts.append((text, level))
    return lines + [f"    {name} = {texts[k][0]}" for name, k in zip(outputs, program["out"], strict=True)]


@dataclass(frozen=True, eq=False)
class Formulas:
    """The formulas of a map as a certificate has them.

    Attributes
    ----------
    map : NamedTuple
        The map.
    table : dict
        `dimension`, `sides`, `branches`, `parameters` (names), `programs` (one for each side and branch: `side`,
        `branch`, `to`, `ops`, `out`), `margins`, `periodic`.  An operation is a list of its word and of what it takes:
        numbers of earlier operations, or the axis of x, a parameter's name, a decimal, a whole power.
    begins : list of list of float, or None
        By side and axis where the domain begins: along axes that close x is taken from there on.
    """

    map: Any
    table: dict[str, Any]
    begins: list[list[float]] | None = None

    def _periods(self, names: list[str], side: int) -> list[str]:
        """Say which results are taken modulo a period, and from where on."""
        if self.begins is None:
            return []
        axes = zip(names, self.table["periodic"][side], self.begins[side], strict=True)
        return [f"    {name} modulo {p}, in [{lo!r}, {lo!r} + {p})" for name, p, lo in axes if p is not None]

    @functools.cached_property
    def lines(self) -> list[str]:
        """All lines; the text of a long list has those of both ends."""
        names, lines = [f"x{axis}'" for axis in range(self.table["dimension"])], []
        for program in self.table["programs"]:
            lines += [f"side {program['side']}, branch {program['branch']}, to side {program['to']}:"]
            lines += _lines(program, names)
            lines += self._periods(names, program["to"])
        for program in self.table["margins"]:
            lines += [f"side {program['side']}: branch 1 if and only if margin > 0, else branch 0"]
            lines += _lines(program, ["margin"])
        return (
            [*lines, "the proof is of these formulas, not of the function image"]
            if self.table["margins"]
            else lines
        )

    def __str__(self) -> str:
        """Write the lines that a report has."""
        lines = self.lines
        if len(lines) > WHOLE:
            hidden = f"    ... {len(lines) - 2 * ENDS} more lines ..."
            lines = [*lines[:ENDS], hidden, *lines[-ENDS:]]
        return "\n".join(lines)

    __repr__ = __str__


def periods_of(domain: Domain) -> list[list[str | None]]:
    """Write the periods of the axes by side: a decimal, a whole turn as "tau", None where an axis ends."""
    named = {0.0: None, math.tau: "tau"}
    return [[named[p] if p in named else decimal(p) for p in axes] for axes in domain.period.tolist()]


def begins_of(domain: Domain) -> list[list[str | None]]:
    """Write by side and axis where the domain begins along axes that close, None along the others."""
    return [
        [lo.hex() if closes else None for lo, closes in zip(axes, domain.periodic, strict=True)]
        for axes in domain.lo.tolist()
    ]


@arguments_checked
def formulas(params: Any, domain: Grid | Domain | ArrayLike | None = None, *, sides: int = 1) -> Formulas:
    """Tell the formulas that a certificate of a map would hold, without a proof.

    The registered functions `image_on` and `margin` (`image` of a map of one branch without `image_on`) run once for
    each side and branch on numbers that record.  What is recorded is compared with the compiled functions at 512 random
    places of each.

    Parameters
    ----------
    params : NamedTuple
        A map, of a registered class or from `limitsets.map`.
    domain : Grid, Domain or sequence of (lo, hi), optional
        Where it is compared; default from -2 to 2 on each axis.
    sides : int
        How many sides it has, where no domain tells.

    Returns
    -------
    Formulas
        Its text shows the formulas, `table` has the programs.

    Raises
    ------
    AnswerError
        For a map that cannot be recorded: the function, the operation and the remedy; or one whose recorded formulas
        differ from the compiled functions.

    Examples
    --------
    >>> import limitsets as ls
    >>> def ricker(x, y, alpha):
    ...     return y, y * np.exp(alpha - x)
    >>> print(ls.formulas(ls.map(ricker, alpha=0.6)))
    side 0, branch 0, to side 0:
        x0' = x1
        x1' = x1 * exp(alpha - x0)
    """
    kind = compiled_kind_of(params, "formulas")
    require_sides(params, sides - 1, sides - 1)
    corner = np.full((sides, kind.dimension), HALF)
    given = domain.domain if isinstance(domain, Grid) else domain
    box = Domain(-corner, corner) if given is None else as_domain(given)
    require_dimension(params, "domain", box.dimension)
    answer = Formulas(
        params, recorded_map(params, box.sides) | {"periodic": periods_of(box)}, box.lo.tolist()
    )
    require_same(params, params, answer.table, box)
    return answer
