"""Averages of a map of a line whose steps scatter: between which numbers they lie in the end, from every start.

The checker proves one inequality for each number (`limitsets/checker/map_long_run.py`); how its function is found does
not matter: u gains what one step counts, less a constant, until it stays (relative value iteration; Puterman, "Markov
Decision Processes", 1994, section 8.5).
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import AnswerError, Column, Progress, Table, as_table, picked, shown, silent
from limitsets.base.arrays import Array, Arrays, Ints, Mask
from limitsets.proofs.prover.averages import outward
from limitsets.proofs.prover.averages_of_map import asked_of_map, cut_at_changes
from limitsets.proofs.prover.certificate import Saved, require_checker
from limitsets.proofs.prover.certificate_of_map import Part, parameters_of, write_map
from limitsets.proofs.prover.programs import periods_of, recorded_map
from limitsets.proofs.prover.proof import Claim
from limitsets.proofs.prover.recording import decimal, names_of
from limitsets.systems.cells import Grid
from limitsets.systems.maps import kind_of
from limitsets.systems.maps.contract import require_corners

if TYPE_CHECKING:
    from limitsets.checker.any_map import Map as CheckedMap

# Cells are cut, each so often at most, and all together, where the slope varies by more than this factor, but for cells
# below this share of a side; and where an image is longer than the mean by this factor.
MOST_CUTS, MOST_IN_ALL, VARIES, TINY, LONG = 400, 2000, 1.5, 2.0**-33, 2.0
# Steps at most, and by how much the gain of a step may still differ between nodes.
MOST_STEPS, STILL = 3000, 1e-6
# They end too where so many steps bring the bound nearer by less than this share of that difference.
PATIENCE, SOON = 100, 1e-3
# A step goes so far towards what it gains, so that nothing swings.
DAMPED = 0.8
# The least noise, and its name in a mapping.
LEAST, LANDING = 1e-90, "landing"
WITHOUT = "leave it out for averages without noise"
# Parts in which the range of a parameter that varies is cut.
STRATA = 32
# A certificate claims bounds that are wider by this, for the roundings of another machine's sums.
ALLOWANCE = 1e-9


@dataclass(frozen=True, eq=False)
class LongRunOfMap(Saved):
    """Proved bounds of averages along orbits whose steps scatter, from every start in some places, almost surely.

    Attributes
    ----------
    map, upper : NamedTuple
        The corners of the parameters; the bounds hold for every fixed value between.
    grid : Grid
        The cells.
    noise : float or mapping of str to float
        Steps land evenly within this distance of the image, independent of each other; or by name what deviates evenly
        at every step and by how much: "landing", and a parameter.
    starts : tuple of (int, float, float)
        Side, from x, to x: from these no step leads out.
    numbers : dict of str to (float, float)
        By name between which two numbers the average lies in the end.
    section, arrays : dict
        The claim `long-run` as a certificate has it.
    seconds : float
        Time it took.
    """

    map: Any
    upper: Any
    grid: Grid
    noise: float | Mapping[str, float]
    starts: tuple[tuple[int, float, float], ...]
    numbers: dict[str, tuple[float, float]]
    section: dict[str, Any]
    arrays: Arrays
    seconds: float

    @property
    def claims(self) -> tuple[Claim, ...]:
        """The one claim, which is proved."""
        return (Claim("long-run", "proved", "", self.section),)

    @property
    def average(self) -> LongRunOfMap:
        """The answer itself: it is asked for as averages without noise are."""
        return self

    @property
    def lo(self) -> float:
        """The least number in which the average of the first function can end."""
        return next(iter(self.numbers.values()))[0]

    @property
    def hi(self) -> float:
        """The largest."""
        return next(iter(self.numbers.values()))[1]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (name.replace("_", " "), *outward(lo, hi), hi - lo) for name, (lo, hi) in self.numbers.items()
        ]
        heads = ("average", Column("lo", show=".12g"), Column("hi", show=".12g"), Column("width", show=".2g"))
        said = (
            f"proved: from every start in {in_words(self.starts)}, almost surely, averages over ever more steps end "
            f"between lo and hi, where {noise_in_words(self.noise)}"
        )
        return (Table(heads, rows, "Averages along orbits with noise", said),)

    def __str__(self) -> str:
        return self.table().text()

    def to_json(self) -> list[dict[str, Any]]:
        """Give the claim as plain tables for JSON, a list of one, as other proofs of a map do."""
        rows = [
            {"name": name, "component": None, "lo": lo, "hi": hi} for name, (lo, hi) in self.numbers.items()
        ]
        one = as_table(
            **picked(self.claims[0], "claim", "verdict"),
            of=", ".join(kind_of(self.map).formulas),
            map=type(self.map).__name__,
            parameters=[end._asdict() for end in (self.map, self.upper)],
            cells=self.grid.n_cells,
            noise=self.noise,
            starts=self.starts,
            section=self.section,
            averages=rows,
            timings={"certify": self.seconds},
        )
        return [one]

    def _write(self, path: str | Path, **how: Any) -> None:
        part = Part((self.map, self.upper), {"long-run": self.section}, self.arrays)
        write_map(path, self.grid.domain, [part], goal=None, **how)


def in_words(starts: Sequence[tuple[int, float, float]]) -> str:
    """Name places; the side where there are several."""
    several = len({side for side, _, _ in starts}) > 1
    return ", ".join(
        f"{lo:.9g} to {hi:.9g}" + (f" on side {side}" if several else "") for side, lo, hi in starts
    )


def noise_in_words(noise: float | Mapping[str, float]) -> str:
    """Say what deviates."""
    bounds = dict(noise) if isinstance(noise, Mapping) else {LANDING: noise}
    landing = bounds.pop(LANDING, 0.0)
    laws = [f"steps land within {landing:g} of the image"] if landing else []
    laws += [f"{name} deviates by at most {bound:g} at every step" for name, bound in bounds.items()]
    return f"{' and '.join(laws)}, evenly"


def long_run_of_map(
    lower: Any, upper: Any, grid: Grid, of: Any, noise: float | Mapping[str, float], progress: Progress | None
) -> LongRunOfMap:
    """Prove between which numbers averages lie in the end where each step lands evenly within `noise` of the image.

    Of a mapping "landing" is that distance, and another key a parameter that deviates so far from its value.

    Raises
    ------
    AnswerError
        Noise that is not above 0, or of two parameters, an axis that closes, functions without a bound, or cells that
        steps leave.
    """
    begun, tell = time.perf_counter(), progress or silent
    own, landing, varied = _laws(lower, noise)
    require_noise(lower, upper, grid, landing, WITHOUT, LEAST if varied is None else 0.0)
    import flint

    from limitsets.checker.balls import PRECISION, UnprovedError
    from limitsets.checker.file import BadFileError
    from limitsets.checker.laws import uniform_law
    from limitsets.checker.long_run import END_SIGNS
    from limitsets.checker.map_long_run import ENDS, LongRunOfMap as Claimed, gains_of
    from limitsets.checker.noisy_map import Varied
    from limitsets.checker.observable import Allowed, read_function

    asked = asked_of_map(of, lower, grid)
    fine = cut_at_changes(lower, upper, grid, asked.jumps, turns=True)
    listed: list[dict[str, Any]] = [
        {"of": one.section} | {end: [(0.0).hex()] for end in ENDS} for one in asked.functions
    ]
    with flint.ctx.workprec(PRECISION):
        the_map = as_checked(lower, upper, grid)
        shape, unknown = the_map.shape, [np.zeros(0)] * 3
        allowed = Allowed(shape.sides, shape.branches, shape.names)
        functions = [read_function(one, [0], allowed, "the function", unknown) for one in listed]
        tell("cells", 0, 1)
        edges = [refined(the_map, side, axes[0], asked.jumps) for side, axes in enumerate(fine.edges)]
        law = uniform_law(Fraction(decimal(landing)), 1)
        parameter = None if varied is None else Varied(varied[0], Fraction(decimal(varied[1])), STRATA)
        try:
            chain, kept, gains = gains_of(the_map, Claimed("", law, parameter, [], edges, functions))
        except (BadFileError, UnprovedError) as error:
            allow = "so small that steps stay on some cells, where what is averaged has a bound"
            remedy = f"widen the grid, lower the noise, or let landings scatter too: {error}"
            raise AnswerError("the noise", noise, allow, remedy) from None
        mesh, columns = chain.mesh, np.zeros((len(ENDS), len(chain.mesh.place), len(listed)))
        for k, (sign, word) in itertools.product(range(len(listed)), enumerate(ENDS)):
            tell(asked.functions[k].name, 2 * k + sign, 2 * len(listed))
            bound, columns[sign, :, k] = settled(gains[k][sign].bound, mesh.place, mesh.first)
            listed[k][word] = [(END_SIGNS[sign] * (bound + ALLOWANCE)).hex()]
    arrays = {f"nodes.{side}": each for side, each in enumerate(edges)} | {
        f"long-run.{end}": column if len(listed) > 1 else column[:, 0]
        for end, column in zip(ENDS, columns, strict=True)
    }
    starts = stretches(kept, mesh.place, mesh.first)
    section: dict[str, Any] = {
        "landing": decimal(landing),
        "starts": [{"side": side, "box": [[lo.hex(), hi.hex()]]} for side, lo, hi in starts],
        "functions": listed,
    }
    if varied is not None:
        section["varied"] = {"name": varied[0], "within": decimal(varied[1]), "strata": STRATA}
    numbers = {}
    for one, each in zip(asked.functions, listed, strict=True):
        lo, hi = (float.fromhex(each[end][0]) for end in ENDS)
        shares = {"share", "steps"} & set(one.section)  # these lie between 0 and 1 by themselves
        numbers[one.name] = (max(lo, 0.0), min(hi, 1.0)) if shares else (lo, hi)
    return LongRunOfMap(
        lower, upper, fine, own, tuple(starts), numbers=numbers, section=section,
        arrays=arrays, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _laws(
    lower: Any, noise: float | Mapping[str, float]
) -> tuple[float | dict[str, float], float, tuple[str, float] | None]:
    """Read noise: as the answer has it, how far steps land from the image, and the parameter that deviates, and how."""
    given = noise if isinstance(noise, Mapping) else {LANDING: noise}
    bounds, parameters = (
        {LANDING: 0.0} | {name: float(bound) for name, bound in given.items()},
        dict(names_of(lower)),
    )
    if LANDING in parameters:
        raise AnswerError(
            "a parameter", LANDING, "another name", "rename it: such noise is of where steps land"
        )
    for name, bound in bounds.items():
        if name != LANDING and not (name in parameters and LEAST <= bound < math.inf):
            allowed = f"at least {LEAST}, of {' or '.join([LANDING, *parameters])}"
            raise AnswerError(f"the noise of {name}", bound, allowed, "correct it, or leave it out")
    if len(bounds) > 2:
        raise AnswerError("the noise", sorted(bounds), "of one parameter", "leave the others out")
    landing, *varied = bounds.items()
    return (bounds if varied else landing[1]), landing[1], next(iter(varied), None)


def require_noise(
    lower: Any, upper: Any, grid: Grid, noise: float | None, without: str, least: float = LEAST
) -> None:
    """Refuse what is no map of a line on a grid that ends, with steps that land within `noise` of the image."""
    require_corners(lower, upper)
    widest = float((grid.domain.hi - grid.domain.lo).max())
    if noise is None or not least <= noise < 0.5 * widest:
        room = f"at least {least}, and below {0.5 * widest:.6g}, half of the grid"
        raise AnswerError("the noise", noise, room, without)
    if grid.domain.closes:
        raise AnswerError("the grid", "an axis that closes", "one that ends", "noise is of lines that end")
    require_checker()
    from limitsets.checker.map_long_run import FARTHEST

    if not float(np.abs([grid.domain.lo, grid.domain.hi]).max()) < FARTHEST:
        raise AnswerError("the grid", shown(grid), f"numbers below {FARTHEST:.6g}", "choose a unit of x")


def as_checked(lower: Any, upper: Any, grid: Grid) -> CheckedMap:
    """Give a map as the checker has it; to be called with its precision."""
    from limitsets.checker.any_map import Map, read_map, read_parameters

    shape = read_map(recorded_map(lower, grid.sides) | {"periodic": periods_of(grid.domain)})
    return Map(shape, read_parameters(parameters_of(lower, upper), shape.names, "the map"))


def refined(the_map: CheckedMap, side: int, edges: Array, jumps: Sequence[tuple[int, float]]) -> Array:
    """Cut cells on which the slope varies by a half or has no bounds, and those with an image longer than most.

    Near a pole of ln |f'| cells become the shorter the nearer it is; small ones, of changes and turns, stay.  Beside
    the places where what is averaged jumps there are nodes so close that the jump costs nothing.
    """
    from limitsets.checker.any_map import possible

    tiny, cells = TINY * (edges[-1] - edges[0]), list[tuple[float, float, float]]()
    left = MOST_IN_ALL + edges.size
    for ends in itertools.pairwise(edges.tolist()):
        stack, cuts = [ends], min(MOST_CUTS, left)
        left -= cuts
        while stack:
            lo, hi = stack.pop()
            piece = the_map.piece([(lo, hi)])
            branches = possible(the_map, side, piece)[0]
            slope = the_map.image[side, branches[0]].bend(piece.balls)[1]
            least, most = (float(each) for each in (slope.abs_lower(), slope.abs_upper()))
            if len(branches) == 1 and cuts > 0 and hi - lo > tiny and not most <= VARIES * least:
                stack += [(0.5 * (lo + hi), hi), (lo, 0.5 * (lo + hi))]
                cuts -= 1
                continue
            cells.append((lo, hi, most * (hi - lo) if math.isfinite(most) else 0.0))
        left += cuts
    lo, hi, long = np.array(cells).T
    parts = np.maximum(np.ceil(long / max(LONG * float(long.mean()), tiny)), 1.0).astype(int)
    inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(lo, hi, parts.tolist(), strict=True)]
    beside = np.array([x + k * tiny for s, x in jumps if s == side for k in (-1, 1)])
    return np.unique(np.concatenate([*inner, hi[-1:], beside[(beside > edges[0]) & (beside < edges[-1])]]))


def stretches(kept: Mask, place: Array, first: Ints) -> list[tuple[int, float, float]]:
    """List the stretches of cells, given by their left nodes: side, from x, to x."""
    places = []
    for side, (begin, end) in enumerate(itertools.pairwise(first.tolist())):
        borders = begin + np.flatnonzero(np.diff(kept[begin:end].astype(np.int8), prepend=0, append=0))
        places += [(side, lo, hi) for lo, hi in place[borders].reshape(-1, 2).tolist()]
    return places


def settled(gain: Callable[[Array], tuple[Ints, Array]], place: Array, first: Ints) -> tuple[float, Array]:
    """Find a function that gains about as much everywhere; with the most that it gains.

    Parameters
    ----------
    gain : callable
        From a function at all nodes: numbers of nodes, and at these the mean after a step, with what is counted.
    place, first : ndarray
        Places of the nodes, and the number of the first of each side.
    """
    u = np.zeros(place.size)
    nodes, gained = gain(u)
    own = np.searchsorted(first, np.arange(place.size), side="right")
    # beyond the cells u goes on as at the nearest of their nodes; on sides without cells it is 0
    near = np.arange(place.size)
    for number in np.unique(own[nodes]):
        mine, some = np.flatnonzero(own == number), nodes[own[nodes] == number]
        right = np.clip(np.searchsorted(place[some], place[mine]), 1, max(some.size - 1, 1))
        left = place[mine] - place[some][right - 1] < place[some][right % some.size] - place[mine]
        near[mine] = some[np.where(left, right - 1, right % some.size)]
    best, every = (math.inf, u), list[float]()
    for _ in range(MOST_STEPS):
        more = gained - u[nodes]
        lowest, highest = float(more.min()), float(more.max())
        best = min(best, (highest, u), key=lambda each: each[0])
        every.append(best[0])
        before = every[-PATIENCE] if len(every) > PATIENCE else math.inf
        if highest - lowest < STILL or before - best[0] < SOON * (highest - lowest):
            break
        u = u.copy()
        u[nodes] += DAMPED * (more - 0.5 * (lowest + highest))
        u = u[near]
        nodes, gained = gain(u)
    return best
