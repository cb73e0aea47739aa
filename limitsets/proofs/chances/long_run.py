"""Averages of a scene over ever more throws that scatter: between which numbers they lie from every start, proved.

The checker proves one inequality for each number (`limitsets/checker/long_run.py`); how its function is found does not
matter: u gains what one throw counts, less a constant, until it stays (relative value iteration; Puterman, "Markov
Decision Processes", 1994, section 8.5).
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import (
    BETWEEN,
    AnswerError,
    Column,
    Progress,
    Table,
    added_up,
    arguments_checked,
    as_table,
    picked,
    shown_in_notebooks,
    silent,
)
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.scattering import Scattering, Uniform, scattering_of
from limitsets.feeder.scene import Scene, load
from limitsets.numbers.interval import guard
from limitsets.proofs.chances.chain import Chain, Place, chain_of, edges_of, in_words, require_places
from limitsets.proofs.prover import certify
from limitsets.proofs.prover.certificate import Saved, pack
from limitsets.proofs.prover.certifying import require_cells
from limitsets.proofs.prover.long_run_of_map import ALLOWANCE, settled, stretches

if TYPE_CHECKING:
    from limitsets.checker.landings import Noisy
    from limitsets.checker.steps import Chain as Steps

CELLS = 4000
# Attracting cells are looked for with landings that scatter by these shares of the arm more, in turn.
ROOM = (2.0**-8, 2.0**-10, 0.0)
# Beyond the starts cells go on by this share of the arm, so that no throw leads out of all of them.
BESIDE = 2.0**-13


@dataclass(frozen=True, eq=False)
class LongRunAverages(Saved):
    """Proved bounds of averages over ever more throws, from every start in some places, almost surely.

    Attributes
    ----------
    scene, unit : str
        Name of the scene, unit of lengths.
    scatter : Scattering
        The laws of what differs at every throw.
    starts : tuple of (int, float, float)
        Side, from x, to x: from these no throw leads out [length].
    numbers : dict of str to (float, float)
        Between which numbers they lie: "flips_per_throw", "share_of_side_0" and so on, "lyapunov" where the slopes of
        throws are proved not to be 0, "jogs_per_visit_of_side_0" and so on where flips are proved.
    chain : Chain
        The chain on its cells.
    averages : list of dict
        As a certificate has them: "of", "lower", "upper".
    functions : dict of str to ndarray
        The functions at the nodes that prove them.
    seconds : float
        Time it took.
    how : str
        "proved".
    """

    scene: str
    unit: str
    scatter: Scattering
    starts: tuple[Place, ...]
    numbers: dict[str, tuple[float, float]]
    chain: Chain
    averages: list[dict[str, Any]]
    functions: dict[str, Array]
    seconds: float
    how: str = "proved"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [(name.replace("_", " "), (lo, hi), hi - lo) for name, (lo, hi) in self.numbers.items()]
        heads = ("average", BETWEEN, Column("width", show=".2g"))
        said = f"{self.how}: from every start in these places, almost surely, as throws go on for ever"
        places = [(side, (lo, hi)) for side, lo, hi in self.starts]
        starts = Table(
            ("side", Column("x", self.unit, ".6f", ends=True)), places, "Starts", "no throw leads out"
        )
        return Table(heads, rows, f"{self.scene}: long-run averages", said), starts

    def to_json(self) -> dict[str, Any]:
        """Give the bounds as JSON takes them."""
        return as_table(
            **picked(self, "scene", "unit", "how", "starts", "seconds"),
            scatter=self.scatter.words(),
            cells=self.chain.nodes.place.size - self.chain.nodes.first.size + 1,
            averages={name: {"lo": lo, "hi": hi} for name, (lo, hi) in self.numbers.items()},
        )

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write the claim."""
        section = self.chain.section | {"averages": self.averages}
        claims = [{"claim": "long-run", "section": section}]
        pack(path, section["scene"]["model"], claims, self.functions | edges_of(self.chain.nodes), **how)


@shown_in_notebooks
@arguments_checked
def long_run_averages(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    starts: Sequence[Place] | None = None,
    cells: int = CELLS,
    progress: Progress | None = None,
) -> LongRunAverages:
    """Prove between which numbers averages over ever more throws lie, from every start, where throws scatter.

    Flips per throw, the share of throws from each side, jogs per visit of each side, and the Lyapunov exponent: the
    average of ln |dx'/dx|, by which two parts that are thrown alike drift apart per throw.

    Parameters
    ----------
    scene : Scene or str
        A scene in the minimal model, or the name of one.
    scatter : Scattering, optional
        Uniform deviations of speed and landing place, independent of each other and of other throws; by default that
        of the scene.  Without scatter of the landing bounds are wide, since it is what makes functions smooth.
    starts : sequence of (int, float, float), optional
        Side, from x, to x: places that no throw leaves; by default the attracting cells that `limitsets.certify` proves
        under this noise [length].
    cells : int
        Cells per side; the bounds narrow with their square.
    progress : callable, optional
        Told (stage, done, all).

    Raises
    ------
    AnswerError
        A law or an effect of which nothing is proved, no attracting cells, or starts that throws leave.

    Examples
    --------
    >>> from limitsets.robust import Scattering, Uniform, long_run_averages
    >>> noise = Scattering(speed=Uniform(0.003), landing=Uniform(0.02))
    >>> lo, hi = long_run_averages("paper-designed", noise, cells=500).numbers["flips_per_throw"]
    >>> lo < 0.3176 < hi < lo + 0.05
    True
    """
    begun, tell = time.perf_counter(), progress or silent
    guard()
    read = load(scene)
    noise = scattering_of(read) if scatter is None else scatter
    for name, law in (("the speed", noise.speed), ("the landing place", noise.landing)):
        if not isinstance(law, Uniform | None):
            raise AnswerError(
                f"the law of {name}", law, "Uniform", "a law without bound leads everywhere: bound it"
            )
    if "cavity" in read.text:
        remedy = "leave [cavity] out: parts that fall into it make no more throws"
        raise AnswerError("the scene", read.name, "one without a cavity", remedy)
    require_cells(cells, "average")
    begin = list(_around(read, noise) if starts is None else starts)
    require_places(read, "a start", begin)
    told = added_up("cells", len(read.sides) * cells, tell)
    chain = chain_of(read, noise, begin, {"elsewhere": _elsewhere(read, begin)}, cells, told)
    from limitsets.checker.balls import UnprovedError, prove
    from limitsets.checker.brackets import read_setting
    from limitsets.checker.long_run import check_starts_stay, kept_cells

    setting = read_setting(chain.section)
    kept = kept_cells(chain.steps, setting.noisy.landing)
    if starts is None:
        begin = _starts_in(read, chain.steps, kept)
        chain = replace(chain, section=chain.section | {"starts": in_words(begin, read.unit)})
    try:
        prove(bool(begin), "from every cell some throw may lead out")
        check_starts_stay(read_setting(chain.section).starts, chain.steps.mesh, kept)
    except UnprovedError as error:
        remedy = f"leave starts out, take more cells, or all of a place that no throw leaves: {error}"
        raise AnswerError(
            "the starts", begin or "none found", "places that no throw leaves", remedy
        ) from None
    averages, functions = _bounded(chain, setting.noisy, kept, len(read.sides), tell)
    numbers = {
        name: (float.fromhex(one["lower"]), float.fromhex(one["upper"])) for name, one in averages.items()
    }
    numbers |= {
        name: (max(lo, 0.0), min(hi, 1.0)) for name, (lo, hi) in numbers.items() if name != "lyapunov"
    }
    return LongRunAverages(
        read.name, read.unit, noise, tuple(begin), numbers | _jogs(numbers, len(read.sides)), chain=chain,
        averages=[*averages.values()], functions=functions, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _bounded(
    chain: Chain, noisy: Noisy, kept: Array, sides: int, tell: Progress
) -> tuple[dict[str, dict[str, Any]], dict[str, Array]]:
    """Bound all averages: by name as a certificate has them, and the functions."""
    from flint import ctx

    from limitsets.checker.balls import PRECISION
    from limitsets.checker.log_slopes import log_slopes
    from limitsets.checker.long_run import EXPONENT, FLIPS, SIDE, most_gain, nodes_of

    names: dict[str, str | int] = {"flips_per_throw": FLIPS} | {f"share_of_side_{k}": k for k in range(sides)}
    with ctx.workprec(PRECISION):
        logs = log_slopes(noisy, chain.steps.mesh, kept)
    if np.isfinite(np.array(logs)[:, nodes_of(kept)]).all():
        names["lyapunov"] = EXPONENT
    averages, functions = dict[str, dict[str, Any]](), dict[str, Array]()
    for number, (name, of) in enumerate(names.items()):
        averages[name] = {"of": {SIDE: of} if isinstance(of, int) else of}
        for k, (sign, word) in enumerate(((-1.0, "lower"), (1.0, "upper"))):
            tell(name, 2 * number + k, 2 * len(names))
            gain, mesh = most_gain(chain.steps, kept, of, sign, logs), chain.steps.mesh
            bound, functions[f"{number}.{word}"] = settled(gain, mesh.place, mesh.first)
            averages[name][word] = (sign * (bound + ALLOWANCE)).hex()
    return averages, functions


def _around(scene: Scene, noise: Scattering) -> list[Place]:
    """Find the attracting cells under noise, if possible with landings that scatter by more, so that there is room."""
    laws_of = ("speed", noise.speed), ("landing", noise.landing)
    own = _without_scatter(scene)
    bound = {name: law.bound for name, law in laws_of if isinstance(law, Uniform)}
    reason = ""
    for share in ROOM:
        more = bound.get("landing", 0.0) + share * scene.arm_length
        laws = {"landing.x": f"{more!r} {scene.unit}"} if more > 0.0 else {}
        if bound.get("speed", 0.0) > 0.0:
            laws["throw.speed"] = f"{100.0 * bound['speed']!r} %"
        proof = certify(own, ["invariant"], noise=laws or None)
        if proof.proved:
            return [(side, lo, hi) for side, bands in proof.outer_extents().items() for lo, hi in bands]
        reason = proof.claims[0].reason
    raise AnswerError("the noise", noise.words(), "such that some cells attract", f"lower it: {reason}")


def _without_scatter(scene: Scene) -> Scene:
    """Read a scene without the scatter that it has of its own."""
    text = {key: value for key, value in scene.as_dict().items() if key != "effects"}
    if "world" in text:
        text["world"] = {key: value for key, value in text["world"].items() if key != "scatter"}
    return load(text)


def _starts_in(scene: Scene, steps: Steps, kept: Mask) -> list[Place]:
    """List the places of cells, rounded inward; none where there are none."""
    digit = 10.0 ** (math.floor(math.log10(scene.arm_length)) - 7)
    inward = [
        (side, round(math.ceil(lo / digit) * digit, 12), round(math.floor(hi / digit) * digit, 12))
        for side, lo, hi in stretches(kept, steps.mesh.place, steps.mesh.first)
    ]
    return [place for place in inward if place[1] < place[2]]


def _elsewhere(scene: Scene, starts: Sequence[Place]) -> list[Place]:
    """List the places that are not near the starts."""
    gap, places = BESIDE * scene.arm_length, list[Place]()
    for side, a in enumerate(scene.sides.a.tolist()):
        begin = a + gap
        for _, lo, hi in sorted(place for place in starts if place[0] == side):
            if begin < lo - gap:
                places.append((side, begin, lo - gap))
            begin = max(begin, hi + gap)
        if begin < scene.arm_length:
            places.append((side, begin, math.inf))
    return places


def _jogs(numbers: Mapping[str, tuple[float, float]], sides: int) -> dict[str, tuple[float, float]]:
    """Bound the jogs of a visit: the throws from the side by the flips from there, which are as many on each side."""
    few, many = (flips / sides for flips in numbers["flips_per_throw"])
    if not few > 0.0:
        return {}
    shares = [numbers[f"share_of_side_{k}"] for k in range(sides)]
    return {
        f"jogs_per_visit_of_side_{k}": (
            max(lo / many * (1.0 - 1e-15) - 1.0, 0.0),
            hi / few * (1.0 + 1e-15) - 1.0,
        )
        for k, (lo, hi) in enumerate(shares)
    }
