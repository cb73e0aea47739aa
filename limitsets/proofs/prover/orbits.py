"""Orbits replayed in interval arithmetic, and periodic orbits: existence, local uniqueness, stability or instability.

G is the throw composed along an itinerary, x a number near one of its fixed points, I a small interval around x.

*It exists*: along I every decision between jog and flip is proved to be the one of the itinerary, so that G is the map
itself there, and continuous; G(x) - x has proved and opposite signs at the two ends of I.
*Its period is no smaller*: after every proper divisor of the period the orbit of I is elsewhere.
*It is alone in I*, and repels or attracts: |dG/dx| > 1, or < 1, is proved on all of I; either way G(x) - x is monotone.

A search in floats (`limitsets.sets`) proposes the numbers.  The proof does not claim that the search found every orbit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.thrower.effects.landing import Landing
from limitsets.feeder.thrower.effects.roll import Roll
from limitsets.feeder.thrower.full_box import landed, rested_one_way
from limitsets.feeder.thrower.motion import all_enclosed, gather_full_box
from limitsets.feeder.thrower.params import gather_box, with_kappa
from limitsets.feeder.thrower.throw_box import NOTHING, sure_throw_box, throw_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import entry_of, proof_kernel
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.parameters import ParameterBox
from limitsets.systems.maps import codes
from limitsets.systems.sets import Cycle, cycles_of

# ----------------------------------------------------------------
# Orbits replayed in interval arithmetic: every decision proved, every state enclosed.
#
# Every start of an interval, and every kappa, has the same itinerary: where the impact is the one root of a concave
# function, kappa > sqrt(a^2 + d^2), the last state is a continuous function of both.


@proof_kernel(entry=True)
def _replay(lo_map: Any, hi_map: Any, kappa: Any, landing: Any, lo: Any, hi: Any, side: Any) -> int:
    """Fill the enclosures after the first; the number of throws whose decision is proved."""
    for k in range(lo.size - 1):
        b = with_kappa(gather_box(lo_map, hi_map, side[k]), kappa[0, k], kappa[1, k])
        state, jog, _, _, _ = throw_box(b, Interval(lo[k], hi[k]))
        if state == codes.JOG:
            after, side[k + 1] = jog, b.side
        elif state == codes.FLIP:
            after, side[k + 1] = jog - b.shift, b.next
        else:
            return k
        after = after + landing[k]
        lo[k + 1], hi[k + 1] = after.lo, after.hi
    return int(lo.size - 1)


@proof_kernel(entry=True)
def _replay_full(lo_map: Any, hi_map: Any, kappa: Any, landing: Any, lo: Any, hi: Any, side: Any) -> int:
    """As `_replay`, with effects."""
    for k in range(lo.size - 1):
        part = gather_full_box(lo_map, hi_map, side[k], Interval(kappa[0, k], kappa[1, k]))
        x = Interval(lo[k], hi[k])
        state, jog, phi, _, _ = sure_throw_box(part.own, x)
        if (state == NOTHING) | (not all_enclosed(part.effects)):
            return k
        count = landed(entry_of(part.effects, Landing), part, x, phi, jog)
        ways = rested_one_way(entry_of(part.effects, Roll), part, count)
        if ways.number != 1:
            return k
        after = Interval(ways.first.lo, ways.first.hi) + landing[k]
        lo[k + 1], hi[k + 1] = after.lo, after.hi
        side[k + 1] = (side[k] + ways.first.turned) % lo_map.bare.a.size
    return int(lo.size - 1)


def replay(
    box: ParameterBox,
    start: tuple[float, float],
    side: int,
    kappa: Array,
    landing: Array,
) -> tuple[Array, Array, Ints]:
    """Enclose an orbit.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters.
    start : (float, float)
        Least and largest start.
    side : int
        Its side.
    kappa : ndarray, shape (2, throws)
        Bounds of kappa at each throw; fewer throws are returned where a decision cannot be proved.
    landing : ndarray, shape (throws,)
        How far beyond the model's place each throw lands.

    Returns
    -------
    lo, hi : ndarray, shape (m + 1,)
        Enclosures of the states, the start first.
    side : ndarray of int, shape (m + 1,)
        Their sides.
    """
    throws = kappa.shape[1]
    lo, hi, sides = np.empty(throws + 1), np.empty(throws + 1), np.empty(throws + 1, np.int64)
    lo[0], hi[0], sides[0] = *start, side
    follow = _replay_full if box.effects else _replay
    made = follow(box.lo, box.hi, np.ascontiguousarray(kappa), landing, lo, hi, sides)
    return lo[: made + 1], hi[: made + 1], sides[: made + 1]


# ----------------------------------------------------------------
# Periodic orbits: proof of existence, of local uniqueness, and of stability or instability.


Pair = tuple[float, float]

# Largest periods to search, in turn, until an orbit is found.
PERIODS = (16, 32, 64)

# Half widths of I that are tried, relative to x: from some rounding errors up to what still resolves the orbits.
FIRST, GROWTH, TRIES = 2.0**-44, 4.0, 14

# The multiplier of a section is wider by this share of it.
SLACK = 2.0**-34


# ---------------------------------------------------------------- an itinerary


@proof_kernel(entry=True)
def _follow(
    lo_map: Any, hi_map: Any, branches: Any, lo: Any, hi: Any, side: Any, decided: Any, slope: Any
) -> int:
    """Fill the enclosures after the first, and that of the slope; how many throws have an image at all."""
    product = Interval(1.0, 1.0)
    for k in range(branches.size):
        b = gather_box(lo_map, hi_map, side[k])
        state, jog, _, factor, _ = throw_box(b, Interval(lo[k], hi[k]))
        if state == NOTHING:
            return k
        decided[k] = state == branches[k]
        if branches[k] == codes.FLIP:
            after, side[k + 1] = jog - b.shift, b.next
        else:
            after, side[k + 1] = jog, b.side
        lo[k + 1], hi[k + 1] = after.lo, after.hi
        product = product * factor
    slope[0], slope[1] = product.lo, product.hi
    return branches.size  # type: ignore[no-any-return]  # kernels take arrays as Any


class Followed(NamedTuple):
    """An interval of starts along a forced itinerary.

    Attributes
    ----------
    lo, hi : ndarray, shape (m + 1,)
        Enclosures of the states, the start first; shorter where a throw has no proved image.
    side : ndarray of int, shape (m + 1,)
        Their sides.
    decided : ndarray of bool, shape (m,)
        Whether the branch is proved to be the one that the map takes.
    slope : (lo, hi)
        Enclosure of the derivative of the last state with respect to the start; nan where the orbit is shorter.
    """

    lo: Array
    hi: Array
    side: Ints
    decided: Mask
    slope: Pair


def follow(box: ParameterBox, lo: float, hi: float, side: int, branches: ArrayLike) -> Followed:
    """Enclose the images of the starts in [lo, hi] along the given branches, whatever branch the map would take.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters.
    lo, hi, side : float, float, int
        The starts.
    branches : array_like of int, shape (m,)
        0 for a jog, 1 for a flip.
    """
    word = np.ascontiguousarray(branches, dtype=np.int64)
    m = word.size
    los, his, sides = np.empty(m + 1), np.empty(m + 1), np.empty(m + 1, np.int64)
    decided, slope = np.zeros(m, dtype=np.bool_), np.full(2, np.nan)
    los[0], his[0], sides[0] = lo, hi, side
    made = _follow(box.lo, box.hi, word, los, his, sides, decided, slope)
    return Followed(
        los[: made + 1],
        his[: made + 1],
        sides[: made + 1],
        decided[:made],
        (float(slope[0]), float(slope[1])),
    )


# ---------------------------------------------------------------- one periodic orbit


@dataclass(frozen=True, eq=False)
class ProvedCycle:
    """A periodic orbit that is proved to exist, one and no more in its interval.

    Attributes
    ----------
    lo, hi : ndarray, shape (p,)
        Enclosures of its points in the order of the throws; the first is the interval in which it is alone.
    side, branches : ndarray of int, shape (p,)
        The side of each point, and the branch from it.
    multiplier : (lo, hi)
        Enclosure of the derivative of F^p on the first interval, and so along the orbit.
    """

    lo: Array
    hi: Array
    side: Ints
    branches: Ints
    multiplier: Pair

    @property
    def period(self) -> int:
        """p, the smallest one."""
        return int(self.side.size)

    @property
    def attracts(self) -> bool:
        """Whether |multiplier| < 1 is proved; otherwise |multiplier| > 1 is."""
        return self.multiplier[0] > -1.0 and self.multiplier[1] < 1.0

    def section(self) -> dict[str, Any]:
        """Return what a recheck needs."""
        return {
            "side": int(self.side[0]),
            "itinerary": self.branches.tolist(),
            "interval": [float(self.lo[0]).hex(), float(self.hi[0]).hex()],
            "multiplier": [end.hex() for end in self._stated()],
            "attracts": self.attracts,
        }

    def _stated(self) -> Pair:
        """Return the multiplier a little wider, so that other arithmetic can confirm it; never as far as to 1 or -1."""
        lo, hi = self.multiplier
        spare = min(abs(end - one) for end in (lo, hi) for one in (-1.0, 1.0))
        slack = min(SLACK * max(abs(lo), abs(hi), 1.0), 0.5 * spare)
        return lo - slack, hi + slack


def _crosses(box: ParameterBox, lo: float, hi: float, side: int, word: Ints) -> bool:
    """Whether G(x) - x is proved to have opposite signs at lo and hi."""
    first, last = follow(box, lo, lo, side, word), follow(box, hi, hi, side, word)
    if first.lo.size <= word.size or last.lo.size <= word.size:
        return False
    up = first.hi[-1] < lo and last.lo[-1] > hi
    down = first.lo[-1] > lo and last.hi[-1] < hi
    return bool(up or down)


def _comes_back_earlier(orbit: Followed, period: int) -> bool:
    """Whether it is not excluded that the orbit closes after a proper divisor of the period."""
    return any(
        orbit.side[k] == orbit.side[0] and orbit.lo[k] <= orbit.hi[0] and orbit.hi[k] >= orbit.lo[0]
        for k in range(1, period)
        if period % k == 0
    )


def proved_cycle(box: ParameterBox, cycle: Cycle) -> ProvedCycle | str:
    """Prove that there is a periodic orbit near one found in floats.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters; the orbit is proved for each of them.
    cycle : Cycle
        The orbit as found.

    Returns
    -------
    ProvedCycle or str
        The orbit, or what is missing.
    """
    word, x, side = np.ascontiguousarray(cycle.branches), float(cycle.x[0]), int(cycle.side[0])
    radius = FIRST * max(abs(x), 1.0)
    for _ in range(TRIES):
        crossing = _crosses(box, x - radius, x + radius, side, word)
        # half the radius would do; with the whole, other arithmetic of about the same accuracy proves the signs too
        lo, hi = x - 2.0 * radius, x + 2.0 * radius
        radius *= GROWTH
        if not (crossing and _crosses(box, lo, hi, side, word)):
            continue
        orbit = follow(box, lo, hi, side, word)
        p = word.size
        if orbit.lo.size <= p or not orbit.decided.all():
            return "a decision along it is not proved"
        if orbit.side[-1] != side:
            return "it ends on another side"
        if _comes_back_earlier(orbit, p):
            return "its period may be smaller"
        least, most = orbit.slope
        if not (least > 1.0 or most < -1.0 or (least > -1.0 and most < 1.0)):
            return f"its multiplier, in [{least:.9g}, {most:.9g}], may be 1 in modulus"
        return ProvedCycle(orbit.lo[:p], orbit.hi[:p], orbit.side[:p], word, orbit.slope)
    return "no interval is found at whose ends F^p(x) - x has opposite signs"


# ---------------------------------------------------------------- all that are found


@dataclass(frozen=True, eq=False)
class ProvedCycles:
    """Periodic orbits in the attracting cells.

    Attributes
    ----------
    cycles : tuple of ProvedCycle
        Those that are proved, by period.
    missing : tuple of str
        One line for each orbit that the search found and that is not proved.
    up_to : int
        Largest period of the search.
    """

    cycles: tuple[ProvedCycle, ...]
    missing: tuple[str, ...]
    up_to: int

    def section(self) -> dict[str, Any]:
        """Return what a recheck needs."""
        return {"cycles": [cycle.section() for cycle in self.cycles], "complete": False}


def _inside(attraction: Attraction, cycle: ProvedCycle) -> bool:
    """Whether the orbit stays in the attracting cells: by invariance one point in them is enough."""
    side, lo, hi = int(cycle.side[0]), float(cycle.lo[0]), float(cycle.hi[0])
    return any(bottom <= lo and hi <= top for bottom, top in attraction.cells.extents().get(side, ()))


def proved_cycles(attraction: Attraction, up_to: int | None = None) -> ProvedCycles:
    """Search the attracting cells for periodic orbits and prove what is found.

    Parameters
    ----------
    attraction : Attraction
        Cells, attracting ones among them.
    up_to : int, optional
        Largest period; default, each of `PERIODS` in turn until one is found.

    Returns
    -------
    ProvedCycles

    Raises
    ------
    AnswerError
        For noise: an orbit of one throw of the noise is not an orbit of another.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.proofs.prover.attraction import attraction
    >>> from limitsets.proofs.prover.cover import cover
    >>> from limitsets.proofs.prover.parameters import parameter_box
    >>> box = parameter_box(ls.load("paper-designed"))
    >>> for cycle in proved_cycles(attraction(cover(box, 2048)), 8).cycles:
    ...     print(cycle.period, cycle.attracts, round(cycle.multiplier[0], 3))
    7 False 4.343
    8 False 5.468
    """
    box = attraction.cover.box
    if box.noise:
        raise AnswerError(
            "periodic orbits", f"noise of {', '.join(box.noise)}", "no noise", "ask without noise"
        )
    extents = attraction.cells.extents()
    for most in PERIODS if up_to is None else (up_to,):
        cycles = cycles_of(box.lo, extents, attraction.cover.grid.domain, most) if extents else ()
        if cycles:
            break
    proved: list[ProvedCycle] = []
    missing: list[str] = []
    for cycle in cycles:
        answer = proved_cycle(box, cycle)
        if isinstance(answer, ProvedCycle) and not _inside(attraction, answer):
            answer = "its box is not in the attracting cells"
        if isinstance(answer, ProvedCycle):
            proved.append(answer)
        else:
            missing.append(f"period {cycle.period} at side {cycle.side[0]}, x = {cycle.x[0]:.9g}: {answer}")
    return ProvedCycles(tuple(proved), tuple(missing), most)
