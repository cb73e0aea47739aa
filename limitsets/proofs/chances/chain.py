"""The noisy chain of a scene on its cells: which places absorb, where nodes stand, and the certificate.

What one throw makes of a bound is proved by the checker's own code (`limitsets/checker/steps.py`), here and when a
certificate is rechecked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.scattering import SIGMAS, Gaussian, Scattering, Uniform
from limitsets.feeder.scene import Scene
from limitsets.proofs.chances.nodes import CLOSE, Nodes, extra, nodes_of
from limitsets.proofs.prover.certificate import in_certificate, pack, require_checker
from limitsets.proofs.prover.parameters import parameter_box

if TYPE_CHECKING:
    from limitsets.checker.brackets import Setting
    from limitsets.checker.means import Rows
    from limitsets.checker.steps import Chain as Steps

Place = tuple[int, float, float]

EXITS = "exits"
# Number of strata into which a uniform law of the speed is cut: between their ends landing places are taken as linear.
STRATA = 16
# Cells are narrower near the joint, up to this share of the arm, where no scatter of the landing smooths functions.
GRADED = 0.43
# Places at which those are looked for where the branch of a throw changes, and how often these are halved.
SAMPLES, BISECTIONS = 4096, 48


@dataclass(frozen=True, eq=False)
class Chain:
    """The chain of a scene, with what its certificate says of it.

    Attributes
    ----------
    section : dict
        Scene, laws, starts and absorbing places, as a certificate has them.
    nodes : Nodes
        Nodes of the functions.
    steps : checker.steps.Chain
        The throws, as the checker proves them: `above` bounds the mean of a function after a throw.
    row : checker.means.Rows
        Makes the mean over the starts.
    pack : callable
        Writes a certificate: called with the file, the section of the claim, arrays, and how to recheck it.
    """

    section: dict[str, Any]
    nodes: Nodes
    steps: Steps
    row: Rows
    pack: Callable[..., object]


def chain_of(
    scene: Scene,
    scatter: Scattering,
    starts: Sequence[Place],
    absorbing: Mapping[str, Sequence[Place]],
    cells: int,
    told: Callable[[int], None] = lambda more: None,
) -> Chain:
    """Prove a scene's throws on cells.

    Parameters
    ----------
    scene : Scene
        The scene.
    scatter : Scattering
        What differs at every throw.
    starts : sequence of (int, float, float)
        Side, from x, to x.
    absorbing : mapping of str to sequence of (int, float, float)
        By name the absorbing places: side, from x, to x.
    cells : int
        Cells per side.
    told : callable
        Told how many nodes more have been thrown from.

    Raises
    ------
    AnswerError
        A throw with effects, a law or a quantity of which nothing is proved, kappa so small that the impact may have
        several solutions, places that overlap; or python-flint is not installed.
    """
    require_checker()
    import flint

    from limitsets.checker.balls import PRECISION
    from limitsets.checker.brackets import chain_on

    with flint.ctx.workprec(PRECISION):
        section, setting, nodes = setting_of(scene, scatter, starts, absorbing, cells)
        steps, row = chain_on(setting, [nodes.place[nodes.of_side(k)] for k in range(len(scene.sides))], told)

    def packed(path: str | Path, section: dict[str, Any], arrays: dict[str, Array], **how: Any) -> None:
        claims = [{"claim": "probabilities", "section": section}]
        pack(path, section["scene"]["model"], claims, arrays | edges_of(nodes), **how)

    return Chain(section, nodes, steps, row, packed)


def setting_of(
    scene: Scene,
    scatter: Scattering,
    starts: Sequence[Place],
    absorbing: Mapping[str, Sequence[Place]],
    cells: int,
) -> tuple[dict[str, Any], Setting, Nodes]:
    """Say of which chain is spoken, as a certificate and as the checker has it, and spread its cells.

    To be called with the checker's precision; refuses what `chain_of` refuses.
    """
    _require_known(scene, scatter)
    from limitsets.checker.brackets import read_setting
    from limitsets.checker.file import BadFileError

    section: dict[str, Any] = {
        "scene": in_certificate(scene.text, "effects", "cavity", "feedback", "tray"),
        "laws": _laws(scatter, scene.unit),
        "starts": in_words(starts, scene.unit),
        "absorbing": {name: in_words(each, scene.unit) for name, each in absorbing.items()},
        "strata": STRATA,
    }
    try:
        setting = read_setting(section)
    except BadFileError as error:
        raise AnswerError("the chain", scene.name, "one that the checker takes", str(error)) from None
    return section, setting, _nodes_on_arm(scene, setting, absorbing, cells)


def require_places(scene: Scene, thing: str, places: Sequence[Place]) -> None:
    """Require places of the arm, one at least."""
    for place in places:
        side, lo, hi = place
        if not (
            side in range(len(scene.sides)) and float(scene.sides.a[side]) < lo < min(hi, scene.arm_length)
        ):
            allowed = "(side, from x, to x) with the first x on the arm and below the second"
            raise AnswerError(thing, place, allowed, "correct it")
    if not places:
        raise AnswerError(thing, "none", "(side, from x, to x)", "give one")


def _require_known(scene: Scene, scatter: Scattering) -> None:
    """Refuse what nothing is proved of."""
    box = parameter_box(scene)
    if box.effects:
        remedy = "leave the effects out; the transfer operator has them, without proof"
        raise AnswerError("the throw", "one with effects", "the minimal model", remedy)
    if scatter.tilt is not None:
        raise AnswerError("the noise", scatter.words(), "of speed and landing place", "leave the tilt out")
    for name, law in (("the speed", scatter.speed), ("the landing place", scatter.landing)):
        if not isinstance(law, Uniform | Gaussian | None):
            remedy = "use one of them, or the transfer operator (limitsets robustness), which proves nothing"
            raise AnswerError(f"the law of {name}", law, "Uniform or Gaussian", remedy)
    most = _number(scatter.speed) * (SIGMAS if isinstance(scatter.speed, Gaussian) else 1.0)
    if not most < 1.0:
        raise AnswerError("the least deviation of the speed", -most, "above -1", "lower the noise")
    lo, hi = box.bare
    least = lo.kappa / (1.0 + most) ** 2
    far = float(np.hypot(hi.a, hi.d).max())
    if not least > far * (1.0 + 1e-9):
        allowed = f"above {far:.6g}, the distance of the centre of mass from a vertex"
        raise AnswerError(
            "the least kappa", least, allowed, "throw more slowly: the impact is not unique below"
        )


def _number(law: Any) -> float:
    """Return the number of a law that is known: the bound, or the standard deviation."""
    return 0.0 if law is None else float(law.bound if isinstance(law, Uniform) else law.sigma)


def _special(
    scene: Scene, setting: Setting, absorbing: Mapping[str, Sequence[Place]]
) -> list[list[list[float]]]:
    """Per side clusters of nodes: where functions jump, and where the speed begins and ceases to decide the branch."""
    lo, hi = parameter_box(scene).bare
    close, below, above = CLOSE * hi.arm_length, lo.arm_length, hi.arm_length
    clusters = []
    for number in range(lo.a.size):
        a = lo.a[number], hi.a[number]
        rows = [
            [a[0] - close, a[0], a[1], a[1] + close],
            [below - close, below, above, above + close],
        ]
        for places in absorbing.values():
            ends = {end for side, *pair in places if side == number for end in pair}
            inner = [x for x in ends if a[1] + 6 * close < x < below - 6 * close]
            # the place itself, as decimals, is off by a rounding: one of the cells beside x has it inside
            rows += [[x + k * close for k in (-2, -1, 0, 1, 2)] for x in inner]
        for delta in {float(setting.noisy.speed.ends[0]), float(setting.noisy.speed.ends[-1])}:
            for x in _crossings(setting, number, a[1] + 8 * close, below - 8 * close, delta):
                rows.append([x - 2 * close, x - close, x + close, x + 2 * close])
        clusters.append(rows)
    return clusters


def _crossings(setting: Setting, side: int, lo: float, hi: float, delta: float) -> list[float]:
    """Propose the places between two at which throws with a deviation of the speed change between jog and flip."""
    from limitsets.checker.noisy_throw import deciding_floats, guess_angles

    own = setting.noisy.sides[side]
    kappa = float(setting.noisy.kappa.mid()) / (1.0 + delta) ** 2

    def flips(x: Array) -> Mask:
        speed = np.full(x.shape, kappa)
        return deciding_floats(own, guess_angles(own, x, speed), x, speed) > 0.0

    x = np.linspace(lo, hi, SAMPLES)
    branch = flips(x)
    at = np.flatnonzero(branch[1:] != branch[:-1])
    low, high, first = x[at], x[at + 1], branch[at]
    for _ in range(BISECTIONS if at.size else 0):
        middle = 0.5 * (low + high)
        same = flips(middle) == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return [float(each) for each in 0.5 * (low + high)]


def _nodes_on_arm(
    scene: Scene, setting: Setting, absorbing: Mapping[str, Sequence[Place]], cells: int
) -> Nodes:
    """Spread the cells over the sides, none of them on places that absorb."""
    lo, hi = parameter_box(scene).bare
    arm, close = hi.arm_length, CLOSE * hi.arm_length
    ends = [(float(a) - close, arm + close) for a in lo.a]
    graded = GRADED * arm if setting.noisy.landing.certain else 0.0
    special = [[x for row in rows for x in row] for rows in _special(scene, setting, absorbing)]
    gone = [
        [(x, min(y, above)) for places in absorbing.values() for k, x, y in places if k == number]
        for number, (_, above) in enumerate(ends)
    ]
    length = sum(y - x + extra(graded) for x, y in ends) - sum(y - x for row in gone for x, y in row)
    return nodes_of(ends, length / (cells * len(ends)), special, gone, graded)


# ----------------------------------------------------------------
# The certificate of brackets: laws, starts, places that absorb, nodes; a recheck makes the steps again.
#
# It claims the proved brackets, widened by an allowance for the roundings of another machine's sums.  The file has the
# layout of every certificate (docs/certificates.md).


QUANTILES = ("50 %", "95 %", "99 %")


def write(
    path: str | Path,
    chain: Chain,
    within: Mapping[str, Array],
    forever: tuple[tuple[float, float], Mapping[str, tuple[float, float]], Mapping[str, Array]],
    *,
    allowance: float,
    **how: Any,
) -> None:
    """Write it, replacing an older file whole; `forever` are the mean, what is `ever`, and the functions of both."""
    names = [name for name in within if name != EXITS]
    section: dict[str, Any] = chain.section | {"names": names, "quantiles": [], "mean": None}
    claimed = {
        name: np.stack([np.maximum(low - allowance, 0.0), np.minimum(high + allowance, 1.0)])
        for name, (low, high) in within.items()
        if name in names
    }
    for name, pair in claimed.items():
        for share in QUANTILES:
            ends = _quantile(pair, float(share.split()[0]) / 100.0)
            if ends is not None:
                section["quantiles"].append([name, share, *ends])
    (low, high), ever, functions = forever
    section["ever"] = [
        [name, max(lo - allowance, 0.0).hex(), min(hi + allowance, 1.0).hex()]
        for name, (lo, hi) in ever.items()
    ]
    if low > 0.0 or math.isfinite(high):
        section["mean"] = [
            max(low * (1.0 - allowance), 0.0).hex(),
            (high * (1.0 + allowance)).hex() if math.isfinite(high) else None,
        ]
    arrays = dict(functions) | {
        f"within.{k}": np.ascontiguousarray(pair.T) for k, pair in enumerate(claimed.values())
    }
    chain.pack(path, section, arrays, **how)


def edges_of(nodes: Nodes) -> dict[str, Array]:
    """Give the nodes of each side as a certificate has them."""
    return {f"edges.{side}": nodes.place[nodes.of_side(side)] for side in range(nodes.first.size - 1)}


def _laws(scatter: Scattering, unit: str) -> dict[str, dict[str, str]]:
    """Write the laws of what deviates."""
    laws = {}
    for name, law, moved, word in (
        ("landing.x", scatter.landing, 0, unit),
        ("throw.speed", scatter.speed, 2, "%"),
    ):
        if _number(law) > 0.0:
            kind = "uniform" if isinstance(law, Uniform) else "gaussian"
            laws[name] = {kind: f"{_plain(_number(law), moved)} {word}"}
    return laws


def _plain(number: float, places: int = 0) -> str:
    """Write the decimals that a float prints with, moved by some places."""
    from decimal import Decimal

    return f"{Decimal(repr(float(number))).scaleb(places):f}"


def in_words(places: Sequence[Place], unit: str) -> list[list[Any]]:
    """Write places as a certificate has them."""
    return [
        [side, f"{_plain(lo)} {unit}", f"{_plain(hi)} {unit}" if math.isfinite(hi) else None]
        for side, lo, hi in places
    ]


def _quantile(pair: Array, share: float) -> tuple[int, int] | None:
    """Bound the throws within which so many end, by brackets that are claimed; None beyond the throws counted."""
    first, last = np.flatnonzero(pair[1] >= share), np.flatnonzero(pair[0] >= share)
    return (int(first[0]), int(last[0])) if last.size else None
