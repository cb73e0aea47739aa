"""The noisy chain of a scene on its cells: which places absorb, one throw of a bound, and the certificate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.scattering import Scattering, Uniform
from limitsets.feeder.scene import Scene
from limitsets.proofs.chances.averages import CLOSE, FAR, Average, Nodes, extra, nodes_of
from limitsets.proofs.chances.deficits import Staircase, landing_average, staircase
from limitsets.proofs.chances.landings import OneSide, crossings, one_side
from limitsets.proofs.chances.throws import throw_average
from limitsets.proofs.prover.certificate import pack, tidy
from limitsets.proofs.prover.parameters import ParameterBox

Place = tuple[int, float, float]

EXITS = "exits"
# Number of strata into which each law is cut: a uniform law needs them only for the curvature of the landing place.
SPEED_STRATA, LANDING_STRATA = 16, 1
NORMAL_SPEED, NORMAL_LANDING = 96, 192
# Number of cells of the function of the landing place for each cell of the function of the start.
FINER = 4
# Cells are narrower near the joint, up to this share of the arm, where no scatter of the landing smooths functions.
GRADED = 0.43


@dataclass(frozen=True, eq=False)
class Chain:
    """One throw, as averages, and where it ends.

    Attributes
    ----------
    nodes : Nodes
        Nodes of the functions.
    throw : Average
        Average over the speed.
    landing : Average or None
        Average over the landing place; None where it does not deviate.
    free : ndarray of bool, shape (n,)
        Nodes from which a throw is made, or at the border of such places.
    absorbs : dict of str to ndarray of bool, shape (n,)
        Nodes of each absorbing set, its borders included; the exits are one.
    speed, landing_law : Staircase
        The laws.
    """

    nodes: Nodes
    throw: Average
    landing: Average | None
    free: Mask
    absorbs: dict[str, Mask]
    speed: Staircase
    landing_law: Staircase

    def fixed(self, value: Mapping[str, float]) -> Array:
        """Return the largest value on absorbing places, -inf where there is none."""
        largest = np.full(self.free.size, -np.inf)
        for name, nodes in self.absorbs.items():
            largest[nodes] = np.maximum(largest[nodes], value[name])
        return largest

    def first(self, fixed: Array) -> Array:
        """Return the function that is 0 where a throw is made."""
        return np.where(self.free, np.maximum(fixed, 0.0), fixed)

    def above(self, values: Array, fixed: Array, more: float = 0.0) -> Array:
        """Bound `more` and the mean of V after one throw from above; V is fixed on absorbing places."""
        mean = self.throw.above(values if self.landing is None else self.landing.above(values)) + more
        return np.where(self.free, np.maximum(fixed, mean), fixed)


def _absorbing(
    nodes: Nodes, box: ParameterBox, absorbing: Mapping[str, Sequence[Place]]
) -> tuple[dict[str, Mask], Mask]:
    lo, hi = box.bare
    side, x = nodes.side(), nodes.place
    absorbs = {EXITS: (x <= hi.a[side]) | (x >= lo.arm_length)}
    free = (x >= lo.a[side]) & (x <= hi.arm_length)
    for name, places in absorbing.items():
        absorbs[name] = np.zeros(x.size, dtype=bool)
        for number, begin, end in places:
            here = side == number
            # Beyond the arm's end there is nothing but the exit.
            absorbs[name] |= here & (x >= begin) & (x <= min(end, hi.arm_length)) & (x >= lo.a[side])
            free &= ~(here & (x > begin) & ((x < end) | (end >= hi.arm_length)))
    return absorbs, free


def _special(
    sides: list[OneSide], box: ParameterBox, absorbing: Mapping[str, Sequence[Place]], law: Staircase
) -> list[list[list[float]]]:
    """Per side clusters of nodes: where functions jump, and where the speed begins and ceases to decide the branch."""
    lo, hi = box.bare
    close = CLOSE * hi.arm_length
    below, above = lo.arm_length, hi.arm_length
    clusters = []
    for side in sides:
        a = side.spans["a"]
        rows = [
            [a[0] - close, a[0], a[1], a[1] + close],
            [below - close, below, above, above + close],
        ]
        for places in absorbing.values():
            ends = {end for number, *pair in places if number == side.number for end in pair}
            rows += [[x - close, x, x + close] for x in ends if a[1] + 4 * close < x < below - 4 * close]
        for delta in {float(law.borders[0]), float(law.borders[-1])}:
            for x in crossings(side, a[1] + 8 * close, below - 8 * close, delta):
                rows.append([x - 2 * close, x - close, x + close, x + 2 * close])
        clusters.append(rows)
    return clusters


def _nodes_on_arm(
    ends: list[tuple[float, float]],
    special: list[list[list[float]]],
    absorbing: Mapping[str, Sequence[Place]],
    cells: int,
    *,
    far: float,
    graded: float,
) -> tuple[Nodes, float]:
    """Spread the cells over the sides, none of them on places that absorb; with the width of a cell."""
    flat = [[x for row in rows for x in row] for rows in special]
    gone = [
        [(x, min(y, above)) for places in absorbing.values() for k, x, y in places if k == number]
        for number, (_, above) in enumerate(ends)
    ]
    length = sum(y - x + extra(graded) for x, y in ends) - sum(y - x for row in gone for x, y in row)
    width = length / (cells * len(ends))
    return nodes_of(ends, width, flat, far, gone, graded), width


def chain_of(
    box: ParameterBox, scatter: Scattering, absorbing: Mapping[str, Sequence[Place]], cells: int
) -> Chain:
    """Build the averages of a scene's throws.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters.
    scatter : Scattering
        What differs at every throw.
    absorbing : mapping of str to sequence of (int, float, float)
        By name the absorbing places: side, from x, to x.
    cells : int
        Cells per side.

    Raises
    ------
    AnswerError
        A throw with effects, a law or a quantity of which nothing is proved, or kappa so small that the impact may
        have several solutions.
    """
    if box.effects:
        remedy = "leave the effects out; the transfer operator has them, without proof"
        raise AnswerError("the throw", "one with effects", "the minimal model", remedy)
    if scatter.tilt is not None:
        raise AnswerError("the noise", scatter.words(), "of speed and landing place", "leave the tilt out")
    normal = [type(law).__name__ == "Gaussian" for law in (scatter.speed, scatter.landing)]
    speed = staircase(scatter.speed, NORMAL_SPEED if normal[0] else SPEED_STRATA, "the speed")
    landing = staircase(scatter.landing, NORMAL_LANDING if normal[1] else LANDING_STRATA, "the landing place")
    lo, hi = box.bare
    sides = [one_side(lo, hi, k) for k in range(lo.a.size)]
    if not speed.borders[0] > -1.0:
        raise AnswerError(
            "the least deviation of the speed", float(speed.borders[0]), "above -1", "lower the noise"
        )
    least = lo.kappa / (1.0 + float(speed.borders[-1])) ** 2
    far = max(math.hypot(side.spans["a"][1], side.spans["d"][1]) for side in sides)
    if not least > far * (1.0 + 1e-9):
        allowed = f"above {far:.6g}, the distance of the centre of mass from a vertex"
        raise AnswerError(
            "the least kappa", least, allowed, "throw more slowly: the impact is not unique below"
        )
    arm, close = hi.arm_length, CLOSE * hi.arm_length
    special = _special(sides, box, absorbing, speed)
    ends = [(side.spans["a"][0] - close, arm + close) for side in sides]
    graded = GRADED * arm if landing.certain else 0.0
    nodes, width = _nodes_on_arm(ends, special, absorbing, cells, far=FAR * arm, graded=graded)
    target, average = nodes, None
    if not landing.certain:
        reach = float(landing.borders[-1])
        shifted = [
            [end + by for row in rows for end in (row[0] - close, row[-1] + close) for by in (-reach, reach)]
            for rows in special
        ]
        outer = [(low - reach - 4 * close, high + reach + 4 * close) for low, high in ends]
        target = nodes_of(outer, width / FINER, shifted, 2.0 * FAR * arm)
        average = landing_average(nodes, target, landing)
    absorbs, free = _absorbing(nodes, box, absorbing)
    numbers = np.flatnonzero(free)
    breaks = np.flatnonzero(np.diff(numbers) > 1) + 1
    runs = [run for run in np.split(numbers, breaks) if run.size > 1]
    throw = throw_average(sides, nodes, target, speed, runs)
    return Chain(nodes, throw, average, free=free, absorbs=absorbs, speed=speed, landing_law=landing)


# ----------------------------------------------------------------
# The certificate of brackets: laws, starts, places that absorb, nodes; the checker makes the steps itself.
#
# The checker bounds a throw in its own way, which needs somewhat finer cells for the same width: the certificate cuts
# each cell, and claims the proved brackets, widened by an allowance.  The file has the layout of every certificate
# (docs/certificates.md).


# Strata of the speed for the checker: between their ends it takes landing places to be linear.
STRATA = 32
QUANTILES = ("50 %", "95 %", "99 %")


def write(
    path: str | Path,
    scene: Scene,
    scatter: Scattering,
    places: tuple[Sequence[Place], Mapping[str, Sequence[Place]]],
    nodes: Nodes,
    within: Mapping[str, Array],
    mean: tuple[float, float],
    *,
    allowance: float,
    finer: int,
    recheck: bool,
) -> Path:
    """Write it, replacing an older file whole; `places` are the starts, and by name those that absorb."""
    starts, absorbing = places
    section: dict[str, Any] = {
        "scene": tidy({word: each for word, each in scene.text.items() if word not in _LEFT_OUT})
        | {"model": {"flight": scene.flight, "flip": scene.flip}},
        "laws": _laws(scatter, scene.unit),
        "starts": _places(starts, scene.unit),
        "absorbing": {name: _places(each, scene.unit) for name, each in absorbing.items()},
        "strata": STRATA,
        "names": [name for name in within if name != EXITS],
        "quantiles": [],
        "mean": None,
    }
    claimed = {
        name: np.stack([np.maximum(low - allowance, 0.0), np.minimum(high + allowance, 1.0)])
        for name, (low, high) in within.items()
        if name in section["names"]
    }
    for name, pair in claimed.items():
        for share in QUANTILES:
            ends = _quantile(pair, float(share.split()[0]) / 100.0)
            if ends is not None:
                section["quantiles"].append([name, share, *ends])
    low, high = mean
    if low > 0.0 or math.isfinite(high):
        section["mean"] = [
            max(low * (1.0 - allowance), 0.0).hex(),
            (high * (1.0 + allowance)).hex() if math.isfinite(high) else None,
        ]
    arrays = {f"within.{k}": np.ascontiguousarray(pair.T) for k, pair in enumerate(claimed.values())}
    for side in range(len(scene.sides)):
        # the outermost nodes lie far beyond everything
        arrays[f"edges.{side}"] = _cut(nodes.place[nodes.of_side(side)][1:-1], finer)
    claims = [{"claim": "probabilities", "section": section}]
    pack(path, section["scene"]["model"], claims, arrays, recheck=recheck)
    return Path(path)


_LEFT_OUT = ("effects", "model", "cavity", "feedback", "tray")


def _laws(scatter: Scattering, unit: str) -> dict[str, dict[str, str]]:
    """Write the laws; only even ones, with scatter of the landing place, are rechecked."""
    speed, landing = scatter.speed, scatter.landing
    if not isinstance(landing, Uniform) or not isinstance(speed, Uniform | None):
        allowed = "a uniform law of the landing place, and of the speed a uniform one or none"
        remedy = "the checker knows no others: the brackets are proved, and not rechecked"
        raise AnswerError("the laws of the certificate", scatter.words(), allowed, remedy)
    laws = {"landing.x": {"uniform": f"{_plain(landing.bound)} {unit}"}}
    if speed is not None and speed.bound > 0.0:
        laws["throw.speed"] = {"uniform": f"{_plain(speed.bound, 2)} %"}
    return laws


def _plain(number: float, places: int = 0) -> str:
    """Write the decimals that a float prints with, moved by some places."""
    from decimal import Decimal

    return f"{Decimal(repr(float(number))).scaleb(places):f}"


def _places(places: Sequence[Place], unit: str) -> list[list[Any]]:
    return [
        [side, f"{_plain(lo)} {unit}", f"{_plain(hi)} {unit}" if math.isfinite(hi) else None]
        for side, lo, hi in places
    ]


def _cut(places: Array, finer: int) -> Array:
    """Cut the cells, but not those where functions jump."""
    width = np.diff(places)
    wide = np.flatnonzero(width > 1e-3 * np.median(width))
    more = [places[wide] + width[wide] * (k / finer) for k in range(1, finer)]
    return np.unique(np.concatenate([places, *more]))


def _quantile(pair: Array, share: float) -> tuple[int, int] | None:
    """Bound the throws within which so many end, by brackets that are claimed; None beyond the throws counted."""
    first, last = np.flatnonzero(pair[1] >= share), np.flatnonzero(pair[0] >= share)
    return (int(first[0]), int(last[0])) if last.size else None
