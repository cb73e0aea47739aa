"""How many throws a policy makes in the mean, and how likely parts come, where deviations have known laws: proved.

State by state from the last ones, by the checker's own steps (`limitsets/checker/policy_chances.py`).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import (
    BETWEEN,
    AnswerError,
    Progress,
    Table,
    added_up,
    arguments_checked,
    as_table,
    picked,
    shown_in_notebooks,
)
from limitsets.base.arrays import Array, Arrays
from limitsets.feeder.scattering import Scattering, Uniform
from limitsets.feeder.scene import load
from limitsets.feeder.scene.quantities import deviation
from limitsets.proofs.chances.chain import in_words, setting_of
from limitsets.proofs.chances.nodes import CLOSE
from limitsets.proofs.policies.synthesis import Synthesis, game_section, require_minimal, table_arrays
from limitsets.proofs.prover.certificate import Saved, pack, require_checker
from limitsets.proofs.prover.certifying import require_cells

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene

# A certificate claims slightly wider bounds than the proof gives, as a share of them: sums of another machine.
ALLOWANCE = 1e-9
CELLS = 1000


@dataclass(frozen=True, eq=False)
class PolicyChances(Saved):
    """What a policy leads to where deviations have known laws, proved.

    Attributes
    ----------
    scene : str
        Name of the scene.
    scatter : Scattering
        The laws, independent of each other and at every throw.
    starts : tuple of (int, float, float)
        Side, from x, to x: starts are equally likely per length on all of these [length].
    mean : (float, float)
        Bounds of the mean number of throws until the policy ends, or the part has left the arm.
    come : (float, float)
        Bounds of the probability that the policy ends with the part where it is wanted.
    cells : int
        Cells of all sides.
    section : dict
        The claim `policy-chances` as a certificate has it.
    arrays : dict of str to ndarray
        Its arrays.
    seconds : float
        Time it took.
    how : str
        "proved".
    """

    scene: str
    scatter: Scattering
    starts: tuple[tuple[int, float, float], ...]
    mean: tuple[float, float]
    come: tuple[float, float]
    cells: int
    section: dict[str, Any]
    arrays: Arrays
    seconds: float
    how: str = "proved"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [("mean number of throws", self.mean), ("probability to come", self.come)]
        return (Table(("number", BETWEEN), rows, self.scene, self.how),)

    def to_json(self) -> dict[str, Any]:
        """Give the bounds as JSON takes them."""
        return as_table(
            **picked(self, "scene", "how", "starts", "cells", "seconds"),
            scatter=self.scatter.words(),
            mean=dict(zip(("lo", "hi"), self.mean, strict=True)),
            come=dict(zip(("lo", "hi"), self.come, strict=True)),
        )

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write the claim."""
        claims = [{"claim": "policy-chances", "section": self.section}]
        pack(path, self.section["scene"]["model"], claims, self.arrays, **how)


@shown_in_notebooks
@arguments_checked
def policy_chances(
    synthesis: Synthesis,
    scatter: Scattering | None = None,
    *,
    cells: int = CELLS,
    progress: Progress | None = None,
) -> PolicyChances:
    """Prove how many throws a policy makes in the mean, and how likely parts come, where deviations have known laws.

    Starts are equally likely per length on the cells of the policy's starts.  Near the place of the sensor, where it
    may err, the bounds hold whatever it answers, as long as it does not know the deviations of throws to come.

    Parameters
    ----------
    synthesis : Synthesis
        A policy that was found.
    scatter : Scattering, optional
        Uniform or Gaussian deviations of speed and landing place, independent of each other and of other throws; they
        may be larger than the noise for which the policy was found.  By default uniform within that noise.
    cells : int
        Cells per side; the bounds narrow with their square.
    progress : callable, optional
        Told (stage, done, all).

    Raises
    ------
    AnswerError
        Where there is no policy; a law or an effect of which nothing is proved, or so small a kappa that the impact
        may not be unique.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.proofs.policies import policy_chances
    >>> scene = ls.load("paper-designed").as_dict()
    >>> scene["feedback"] = {
    ...     "sensor": {"beyond": "20 in"},
    ...     "throws": [{"name": "own", "kappa": "25.3778518 in"}],
    ... }
    >>> noise = {"landing.x": "0.05 in"}
    >>> answer = ls.feedback(ls.load(scene), starts={2: (16.0, 16.5)}, cells=256, noise=noise)
    >>> chances = policy_chances(answer, cells=300)
    >>> 1.9 < chances.mean[0] < chances.mean[1] < 2.1
    True
    """
    begun = time.perf_counter()
    policy = synthesis.require_policy()
    require_cells(cells, "expectation")
    require_minimal(synthesis)
    require_checker()
    import flint

    from limitsets.checker.balls import PRECISION, UnprovedError
    from limitsets.checker.brackets import require_edges
    from limitsets.checker.file import BadFileError
    from limitsets.checker.policy_chances import PolicyChances as Claimed, bounds_of_policy, read_settings

    scatter = _within(synthesis) if scatter is None else scatter
    scene, places = synthesis.scene, synthesis.starts.extents()
    starts = [(side, float(lo), float(hi)) for side, pairs in places.items() for lo, hi in pairs]
    assert scene.feedback is not None
    throws = [_bare(scene.with_values({each.quantity: each.text})) for each in scene.feedback.throws]
    told = added_up("throws", len(throws) * len(scene.sides) * cells, progress)

    with flint.ctx.workprec(PRECISION):
        chains = [setting_of(each, scatter, starts, {}, cells) for each in throws]
        section = game_section(synthesis, synthesis.sensor, policy) | {
            **{word: chains[0][0][word] for word in ("laws", "strata", "absorbing")},
            "starts": in_words(starts, scene.unit),
        }
        section["scene"].pop("effects", None)
        game, settings = read_settings(section)
        edges = [
            np.unique(np.concatenate([_cuts(synthesis), *(n.place[n.of_side(side)] for _, _, n in chains)]))
            for side in range(len(scene.sides))
        ]
        table = policy.throw, policy.left, policy.after
        try:
            require_edges(edges, settings[0])
            bounds = bounds_of_policy(Claimed(game, settings, edges, *table, {}), told)
        except (BadFileError, UnprovedError) as error:
            raise AnswerError("the chances", "none proved", "what the checker takes", str(error)) from None
    section |= {
        word: [(lo * (1.0 - ALLOWANCE)).hex(), (hi * (1.0 + ALLOWANCE)).hex()]
        for word, (lo, hi) in bounds.items()
    }
    arrays = table_arrays(policy) | {f"edges.{side}": each for side, each in enumerate(edges)}
    count = sum(each.size - 1 for each in edges)
    return PolicyChances(
        scene.name, scatter, tuple(starts), bounds["mean"], bounds["come"], cells=count,
        section=section, arrays=arrays, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _within(synthesis: Synthesis) -> Scattering:
    """Return deviations that are equally likely within the noise of a policy."""
    laws = {}
    for name, text in synthesis.noise.items():
        read = deviation(text, name, synthesis.scene.unit, zero=True)
        if (name, read.relative) not in (("throw.speed", True), ("landing.x", False)):
            remedy = "pass scatter=Scattering(speed=..., landing=...)"
            raise AnswerError(f"the noise of {name}", text, "throw.speed in percent, and landing.x", remedy)
        laws[name.split(".")[1]] = Uniform(read.value)
    return Scattering(speed=laws.get("speed"), landing=laws.get("x"))


def _bare(scene: Scene) -> Scene:
    """Read a scene without what the chain of its throws leaves to the policy, or to laws."""
    return load(
        {key: value for key, value in scene.as_dict().items() if key not in ("effects", "cavity", "goal")}
    )


def _cuts(synthesis: Synthesis) -> Array:
    """Give nodes close together where the sensor's answers, or what becomes of the part, may change."""
    close = CLOSE * synthesis.scene.arm_length
    sensor = synthesis.sensor
    places = [synthesis.goal[0], *getattr(sensor, "cuts", ())]
    arm = synthesis.scene.arm_length
    return np.array([x + k * close for x in places if abs(x) < arm for k in (-2, -1, 0, 1, 2)])
