"""The claim `long-run` of a map: averages along orbits whose steps scatter, from every start in some places.

docs/certificates.md, "Long-run averages".  What is averaged, g, is counted where a step lands, so that ln |f'| may have
poles: where f' = 0, and at a cube root whose slope is infinite.  The file has a function u for either end, and checked
is K(g + u) - u <= c at every place of N.  For g stands a function that is affine between nodes and nowhere below g but
on cells with a pole; there its excess over 0 has a bounded integral, which counts with the largest density of landings.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .any_map import Map
from .balls import ONE, ZERO, Arb, Array, about, prove
from .file import Arrays, require, rows
from .landings import upper
from .long_run import END_SIGNS, Gain, check_end, check_starts_stay, kept_cells, nodes_of
from .means import INFLATE
from .noisy_circle import ChainOfCircles, chain_of_circles
from .noisy_map import (
    OF_NOISY,
    BranchOfCell,
    NoisyMap,
    Stratum,
    between_ends,
    chain_of_map,
    mesh_of_map,
    noise_of_map_in_words,
    read_noisy,
    strata_of,
    stretches_in_words,
)
from .observable import (
    Allowed,
    Averaged,
    Observed,
    OnCell,
    function_in_words,
    known_bounds,
    observed_of,
    read_function,
)
from .program import Program
from .steps import Chain

OF_LONG_RUN = f"{OF_NOISY} functions"
ENDS = ("lower", "upper")


class LongRunOfMap(NamedTuple):
    """What is claimed: read, and not yet believed."""

    noisy: NoisyMap
    functions: list[Averaged]  # `lower` and `upper` are the functions u


# ----------------------------------------------------------------
# Reading.


def read_long_run_of_map(
    section: dict[str, Any], arrays: Arrays, prefix: str, allowed: Allowed, where: str
) -> LongRunOfMap:
    """Read the claim of a box of parameters."""
    noisy = read_noisy(section, arrays, prefix, allowed, where)
    listed = rows(section["functions"], f"{where}: functions", 1, 99)
    columns = [arrays.read(f"{prefix}long-run.{end}", "<f8", len(listed)) for end in ("upper", "lower")]
    alike = all(len(column) == noisy.nodes for column in columns)
    require(alike, f"{where}: a function has not one number for each node")
    by_function = [column.reshape(len(column), -1).T for column in columns]
    functions = [
        read_function(
            one, [0], allowed, f"{where}: function {k}", [each[k] for each in by_function] + [np.zeros(0)]
        )
        for k, one in enumerate(listed)
    ]
    return LongRunOfMap(noisy, functions)


def long_run_of_map_in_words(c: LongRunOfMap) -> Iterator[str]:
    """Put the claim in words."""
    yield f"{noise_of_map_in_words(c.noisy)}; from every start in {stretches_in_words(c.noisy.starts)}"
    yield "almost surely averages over n steps, counted from the first landing on, lie in the end between the two"
    for one in c.functions:
        lo, hi = known_bounds(one, 0)
        yield f"    {lo!r} to {hi!r}: {function_in_words(one, ['take branch 0', 'take branch 1'])}"
    yield "    means over stationary laws on cells that no step leaves lie there too"


# ----------------------------------------------------------------
# What is counted.


class Majorant(NamedTuple):
    """A function that is affine between nodes, and how much what it stands for may exceed it in all (an integral)."""

    values: Array
    excess: float


def majorants(
    chain: Chain | ChainOfCircles,
    strata: list[Stratum],
    pieces: list[list[BranchOfCell]],
    functions: list[Averaged],
) -> list[list[Majorant]]:
    """Bound what is counted from above, by function and sign, its negative for the lower end."""
    values = np.zeros((len(functions), 2, len(chain.mesh.place)))
    excess = np.zeros((len(functions), 2))
    for stratum, some in zip(strata, pieces, strict=True):
        own, much = majorants_of(stratum.whole, values.shape, some, functions)
        values += stratum.weight * own
        excess += stratum.weight * much
    return [
        [Majorant(v, float(much) * INFLATE) for v, much in zip(*pair, strict=True)]
        for pair in zip(values, excess, strict=True)
    ]


def majorants_of(
    the_map: Map, shape: tuple[int, ...], pieces: list[BranchOfCell], functions: list[Averaged]
) -> tuple[Array, Array]:
    """Bound what is counted in a stratum, and what it may exceed that by: by function, sign, and the first by node."""
    ranges = the_map.piece([]).balls
    observed = [observed_of(one, the_map.program_of, ranges) for one in functions]
    values, excess = np.full(shape, -np.inf), np.zeros(shape[:2])
    for piece in pieces:
        program = the_map.image[piece.side, piece.branch]
        at = on_cell(program, piece, piece.ends, ranges)
        ends = [on_cell(program, piece, (x, x), ranges) for x in piece.ends]
        for k, (one, bounds) in enumerate(zip(functions, observed, strict=True)):
            for sign, row in enumerate(rows_of(bounds, at, ends)):
                if not np.isfinite(row).all():
                    much = pole(program, piece, ranges, sign) if one.word == "lyapunov" else math.inf
                    where = f"side {piece.side}, x in {list(piece.ends)!r}"
                    prove(math.isfinite(much), f"{where}: what is averaged has no bound there")
                    excess[k, sign] += much
                    row = [0.0, 0.0]
                values[k, sign, [piece.at, piece.at + 1]] = np.maximum(
                    values[k, sign, piece.at : piece.at + 2], row
                )
    values[np.isneginf(values)] = 0.0
    return values, excess


def on_cell(program: Program, piece: BranchOfCell, ends: tuple[float, float], ranges: list[Arb]) -> OnCell:
    """Give a cell, or one of its ends, as functions take it."""
    middle, alone = (arb(ends[0]) + arb(ends[1])) / 2, ends[0] == ends[1]
    return OnCell(
        piece.side, piece.branch, ends, arb(ends[0]).union(arb(ends[1])), middle=middle,
        bend=ZERO if alone else piece.bend / piece.slope,
        slope=lambda: abs(program.gradients([middle, *ranges])[0][0]),
    )  # fmt: skip


def rows_of(bounds: Observed, at: OnCell, ends: list[OnCell]) -> tuple[list[float], list[float]]:
    """Bound a function and its negative at the two nodes of a cell, so that the chord is nowhere below.

    A function exceeds its chord by at most |I| (B - A)/4 where its slope is from A to B: by twice what its mean may be
    off.  What it is at a node counts no less than the least on the cell: it may jump there.
    """
    low, high, least, most, _ = bounds(at)
    more = (high - low) * INFLATE
    own = [bounds(each) for each in ends]
    above = [max(one[3], least) + more for one in own]
    return [-(min(one[2], most) - more) for one in own], above


def pole(program: Program, piece: BranchOfCell, ranges: list[Arb], sign: int) -> float:
    """Bound the integral of the positive part of ln |f'| over a cell (1), or of its negative (0).

    From above it is at most |I| ln(1 + the mean of |f'|), by Jensen's inequality.  From below: where |f''| >= m,
    |f'| <= exp(-s) on a length of at most 2 exp(-s)/m; integrate over s from 0 on.
    """
    x = arb(piece.ends[0]).union(arb(piece.ends[1]))
    length = arb(piece.ends[1]) - arb(piece.ends[0])
    least, mean = piece.slope.abs_lower(), piece.slope
    if not piece.slope.is_finite():
        least, mean = slope_beside_root(program, [x, *ranges], length)
    if sign:
        return upper(length * (1 + mean.abs_upper()).log())
    if least > 0:
        return upper(length * least.min(ONE).log().abs_upper())
    bend = piece.bend.abs_lower() if piece.bend.is_finite() else ZERO
    return upper(length * (1 + (2 / (bend * length)).max(ONE).log())) if bend > 0 else math.inf


def slope_beside_root(program: Program, inputs: list[Arb], length: Arb) -> tuple[Arb, Arb]:
    """Enclose the least |f'| on a cell that holds the zero of one cube root's argument, and bound the mean of |f'|.

    f' = Q + P r with r the slope of the root, which has one sign, is unbounded, and whose integral is the root's rise.
    """
    roots = [(k, *program.at(inputs, [k, a]), a) for k, a in program.entries_of("cbrt")]
    roots = [each for each in roots if each[1].contains(0)]
    if len(roots) != 1:
        return ZERO, arb("nan")
    ((k, root, argument, a),) = roots
    inner = program.gradients(inputs, out=[a])[0][0]
    slopes = program.gradients(inputs, apart=k)[0]
    rest, factor = slopes[0].abs_upper(), slopes[-1]
    if not (inner > 0 or inner < 0):
        return ZERO, arb("nan")
    rate = inner.abs_lower() / (3 * argument.abs_upper().root(3) ** 2)
    return factor.abs_lower() * rate - rest, rest + factor.abs_upper() * 2 * root.rad() / length


# ----------------------------------------------------------------
# The inequality.


class GainOfEnd(NamedTuple):
    """What bounds K(g + u), or K(u - g), at the nodes of N, and the largest size of what stands for g."""

    bound: Gain
    size: float


def gains_of(the_map: Map, c: LongRunOfMap) -> tuple[Chain | ChainOfCircles, Array, list[list[GainOfEnd]]]:
    """Prove the steps: the chain, the cells of N by their left nodes, what bounds each function and its negative."""
    law = c.noisy.law
    strata = strata_of(the_map, c.noisy.varied)
    chain: Chain | ChainOfCircles
    if the_map.shape.closes:
        chain, pieces = chain_of_circles(the_map, strata, c.noisy.edges, law)
        kept = np.isin(np.arange(len(chain.mesh.place)), between_ends(chain.mesh))
    else:
        mesh = mesh_of_map(c.noisy.edges, law)
        chain, pieces = chain_of_map(strata, mesh, law, between_ends(mesh), {})
        kept = kept_cells(chain, law)
    prove(bool(kept.any()), "from every cell some step may lead out")
    nodes, free = nodes_of(kept), np.full(len(chain.mesh.place), -np.inf)

    def gain(counted: Majorant) -> GainOfEnd:
        prove(counted.excess == 0.0 or not law.certain, "ln |f'| has a pole: landings have to scatter too")
        more = counted.excess * law.most * INFLATE if counted.excess else 0.0

        def bound(u: Array) -> tuple[Array, Array]:
            return nodes, chain.above(u + counted.values, free, more)[nodes]

        return GainOfEnd(bound, float(np.abs(counted.values).max()))

    inner = [[piece for piece in some if kept[piece.at]] for some in pieces]
    counted = majorants(chain, strata, inner, c.functions)
    return chain, kept, [[gain(of) for of in pair] for pair in counted]


def check_long_run_of_map(the_map: Map, c: LongRunOfMap) -> None:
    """Check the claim."""
    chain, kept, gains = gains_of(the_map, c)
    check_starts_stay(c.noisy.starts, chain.mesh, kept)
    for k, one in enumerate(c.functions):
        with about(f"function {k}"):
            for sign, u, end, of in zip(
                END_SIGNS, (one.lower, one.upper), one.bounds[0], gains[k], strict=True
            ):
                check_end(sign, u, end, of.bound, 4.0 + of.size)
