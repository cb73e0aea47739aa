"""The noise of a map of a line as callers pass it, and as the checker has it; the cells on which it is followed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, shown
from limitsets.base.arrays import Array
from limitsets.proofs.prover.certificate import require_checker
from limitsets.proofs.prover.certificate_of_map import parameters_of
from limitsets.proofs.prover.programs import periods_of, recorded_map
from limitsets.proofs.prover.recording import decimal, names_of
from limitsets.systems.cells import Grid
from limitsets.systems.maps.contract import require_corners

if TYPE_CHECKING:
    from limitsets.checker.any_map import Map as CheckedMap
    from limitsets.checker.noisy_map import NoisyMap

# Cells are cut, each so often at most, and all together, where the slope varies by more than this factor, but for cells
# below this share of a side; and where an image is longer than the mean by this factor.
MOST_CUTS, MOST_IN_ALL, VARIES, TINY, LONG = 400, 2000, 1.5, 2.0**-33, 2.0
# The least noise, and its name in a mapping.
LEAST, LANDING = 1e-90, "landing"
# Parts in which the range of a parameter that varies is cut.
STRATA = 32

Bounds = float | Mapping[str, float]
"""How far from its image a step lands at most, evenly; or by name what deviates: "landing", and a parameter."""


class Noise(NamedTuple):
    """What deviates at every step: as it was given, how far steps land from the image, the parameter and how far."""

    given: float | dict[str, float]
    landing: float
    varied: tuple[str, float] | None

    def section(self) -> dict[str, Any]:
        """Give the keys that a certificate has of it."""
        known: dict[str, Any] = {"landing": decimal(self.landing)}
        if self.varied is not None:
            name, bound = self.varied
            known["varied"] = {"name": name, "within": decimal(bound), "strata": STRATA}
        return known

    def checked(self, starts: Sequence[tuple[int, float, float]], edges: list[Array]) -> NoisyMap:
        """Give it as the checker has it, with starts and nodes."""
        from limitsets.checker.laws import uniform_law
        from limitsets.checker.noisy_map import NoisyMap, Varied

        varied = (
            None if self.varied is None else Varied(self.varied[0], Fraction(decimal(self.varied[1])), STRATA)
        )
        exact = [(side, Fraction(lo), Fraction(hi)) for side, lo, hi in starts]
        return NoisyMap("", uniform_law(Fraction(decimal(self.landing)), 1), varied, exact, edges)

    def words(self) -> str:
        """Say what deviates."""
        return noise_in_words(self.given)


def noise_of(lower: Any, noise: Bounds) -> Noise:
    """Read the noise of a map."""
    given = noise if isinstance(noise, Mapping) else {LANDING: noise}
    numbers = {name: float(each) if isinstance(each, Real) else math.nan for name, each in given.items()}
    bounds, parameters = {LANDING: 0.0} | numbers, dict(names_of(lower))
    if LANDING in parameters:
        raise AnswerError(
            "a parameter", LANDING, "another name", "rename it: such noise is of where steps land"
        )
    for name, bound in bounds.items():
        if not (name == LANDING or (name in parameters and LEAST <= bound < math.inf)):
            allowed = f"at least {LEAST}, of {' or '.join([LANDING, *parameters])}"
            raise AnswerError(f"the noise of {name}", bound, allowed, "correct it, or leave it out")
    if len(bounds) > 2:
        raise AnswerError("the noise", sorted(bounds), "of one parameter", "leave the others out")
    landing, *varied = bounds.items()
    return Noise(bounds if varied else landing[1], landing[1], next(iter(varied), None))


def noise_in_words(noise: Bounds) -> str:
    """Say what deviates."""
    bounds = dict(noise) if isinstance(noise, Mapping) else {LANDING: noise}
    landing = bounds.pop(LANDING, 0.0)
    laws = [f"steps land within {landing:g} of the image"] if landing else []
    laws += [f"{name} deviates by at most {bound:g} at every step" for name, bound in bounds.items()]
    return f"{' and '.join(laws)}, evenly"


def require_noise(
    lower: Any, upper: Any, grid: Grid, noise: float | None, without: str, least: float = LEAST
) -> None:
    """Refuse what is no map of a line on a grid that ends, with steps that land within `noise` of the image."""
    require_corners(lower, upper)
    widest = float((grid.domain.hi - grid.domain.lo).max())
    if noise is None or not least <= noise < 0.5 * widest:
        room = f"at least {least}, and below {0.5 * widest:.6g}, half of the grid"
        raise AnswerError("the noise", noise, room, without)
    require_checker()
    from limitsets.checker.noisy_map import FARTHEST

    if not float(np.abs([grid.domain.lo, grid.domain.hi]).max()) < FARTHEST:
        raise AnswerError("the grid", shown(grid), f"numbers below {FARTHEST:.6g}", "choose a unit of x")


def as_checked(lower: Any, upper: Any, grid: Grid) -> CheckedMap:
    """Give a map as the checker has it; to be called with its precision."""
    from limitsets.checker.any_map import Map, read_map, read_parameters

    shape = read_map(recorded_map(lower, grid.sides) | {"periodic": periods_of(grid.domain)})
    return Map(shape, read_parameters(parameters_of(lower, upper), shape.names, "the map"))


def nodes_for(the_map: CheckedMap, fine: Grid, jumps: Sequence[tuple[int, float]]) -> list[Array]:
    """Give the nodes of each side on cells, which are cut further; to be called with the checker's precision."""
    from limitsets.checker.map_cells import closed_axis

    nodes = []
    for side, ((axis,), (period,)) in enumerate(zip(fine.edges, the_map.periods, strict=True)):
        seam = [] if period is None else [(side, x) for x in axis[[0, -1]].tolist()]
        cut = refined(the_map, side, axis, [*jumps, *seam])
        nodes.append(cut if period is None else closed_axis(cut[:-1], period))
    return nodes


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
