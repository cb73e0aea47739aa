"""All answers about feeding a scene: `limitsets.feed`."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    arguments_checked,
    as_table,
    picked,
    shown_in_notebooks,
)
from limitsets.cell.feeding.crowd import BATCHES, CrowdTrials, after_next_throw, run_crowd
from limitsets.cell.feeding.drawn import Drawn, drawn_trials
from limitsets.cell.feeding.falling import ArmEnd, arm_end_of, clear_beyond, tipping_times
from limitsets.cell.feeding.paths import Fed, Safe, without_scatter
from limitsets.cell.feeding.proving import FeedingProof, fate_brackets, holds, proved_feeding, write_proof
from limitsets.cell.feeding.trials import (
    ENDED,
    Curve,
    FedShares,
    Trials,
    run_trials,
    success_curve,
    trials_within,
)
from limitsets.feeder.goals import by_side
from limitsets.feeder.scattering import Scattering, scattering_of
from limitsets.feeder.scene import LaidLike, Model, Scene, load
from limitsets.parameters.margins.machines import Machines
from limitsets.parameters.noise.sampling import require_seed
from limitsets.parameters.sheet.summary import still
from limitsets.proofs.chances.absorption import AbsorptionBrackets
from limitsets.proofs.prover.certificate import Saved

Verdict = TypeVar("Verdict", Safe, Fed)

# Parts thrown unless it is said how many: fewer where that takes more throws than these.
TRIALS, THROWS = 100_000, 5e7
# In which finer cells are tried for the proofs.
SECONDS = 60.0

# Fates for people.
FED = {
    "right": "on the wanted side, clear of the wall",
    "wrong": "on another side",
    "wall": "on the wanted side, but meets the wall",
    "edge": "assumed not: the throw acts beyond the end",
    "left": "not: it leaves the arm otherwise",
    "never": "not: it stays on the arm",
}


@dataclass(frozen=True, eq=False)
class Feeding(Saved):
    """What becomes of parts at the end of the arm.

    Attributes
    ----------
    end : ArmEnd
        Where the arm ends, the side wanted, and how far beyond the end a part on it clears the wall.
    clear : dict of int to tuple of (float, float)
        The same of every side: intervals of the distance beyond the end [length].
    proof : FeedingProof or None
        Which sides can be fed from which starts, whether every start is fed and after how many throws, and the cells;
        None where it was not asked for.
    noise : dict of str to str
        What differs at every throw in these proofs, and by how much.
    scatter : Scattering
        The noise of the probabilities and of the trials; none in a scene without it.
    curve : Curve or None
        The share of right feeds against the level of the noise; None without noise.
    trials : Trials
        Parts thrown.
    brackets : AbsorptionBrackets or None
        Proved brackets of right, wrong, wall and exits within n throws; None where they were not asked for.
    crowds : tuple of CrowdTrials
        Many parts at once in the engine: that push each other, and that pass through each other, from the same seeds;
        empty where they were not asked for.
    drawn : Drawn or None
        What each machine drawn from a fit feeds; the trials are of all of them.  None without a fit.
    """

    end: ArmEnd
    clear: dict[int, tuple[tuple[float, float], ...]]
    proof: FeedingProof | None
    noise: dict[str, str]
    scatter: Scattering
    curve: Curve | None
    trials: Trials
    brackets: AbsorptionBrackets | None = None
    crowds: tuple[CrowdTrials, ...] = ()
    drawn: Drawn | None = None

    @cached_property
    def shares(self) -> FedShares:
        """Shares of all fates among the trials, throw by throw: estimates of their probabilities; sampled."""
        return FedShares(self.trials)

    @property
    def errors(self) -> dict[str, float]:
        """By fate how far its probability may be from the share, 95 %."""
        return self.shares.errors

    @property
    def safe(self) -> Safe | None:
        """Which sides can be fed from which starts, proved; None where it was not asked for."""
        return None if self.proof is None else self._said(self.proof.safe)

    @property
    def fed(self) -> Fed | None:
        """Whether every start is fed, and after how many throws, proved; None where it was not asked for."""
        return None if self.proof is None else self._said(self.proof.fed)

    def _said(self, claim: Verdict) -> Verdict:
        """Give a verdict as what it is about: normal deviations have no bound, and no proof holds with them."""
        return without_scatter(claim) if self.end.scene.effects.spread == "gaussian" else claim

    @property
    def model(self) -> Model:
        """Of which model safety and progress are, and which facts of the scene that leaves out."""
        if self.proof is None:
            return Model.of(self.end.scene)
        return Model.of(_proved_of(self.end).scene, self.proof.attraction.cover.box.noise)

    @property
    def vacuous(self) -> bool:
        """Whether no part that was thrown is fed, on any side: safety is about no part then."""
        return not any(self.trials.counts[name] for name in ("right", "wrong", "wall"))

    @property
    def tipping(self) -> dict[int, float] | None:
        """Seconds in which a part 1 % of its a beyond the end tips onto the ramp, by side; None without gravity."""
        scene = self.end.scene
        if scene.gravity is None or scene.cavity is None:
            return None
        near = enumerate(0.01 * scene.sides.a)
        return {side: float(tipping_times(scene, side)(np.array([e]))[0]) for side, e in near}

    @cached_property
    def next_throw(self) -> str | None:
        """Where a part that is seated rightly is after the next throw: "seated", "moved" or "left"; sampled."""
        return after_next_throw(self.end)

    @property
    def proved(self) -> bool:
        """Whether it is proved that only the wanted side is fed, and that every or almost every start is."""
        if self.safe is None or self.fed is None:
            return False
        return self.safe.verdict == "proved" and "proved" in (self.fed.verdict, self.fed.almost_every)

    @property
    def written(self) -> bool:
        """Whether a certificate can hold something of the proof: not of a map with effects, that nothing rechecks."""
        return self.proof is not None and holds(self.proof, self.end)

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write what is proved."""
        if self.proof is None:
            raise AnswerError(
                "the certificate", "without a proof", "safety or progress", "ask for the proof: prove=True"
            )
        write_proof(path, self.proof, self.end, **how)

    def denied(self, reason: str) -> Feeding:
        """Return what is left of it where the checker denies the certificate: safety and progress are undecided."""
        if self.proof is None:
            return self
        safe = Safe("undecided", {}, {}, 0.0, self.proof.safe.leaving)
        fed = Fed("undecided", None, {}, 0.0, reason=f"the checker denies it: {reason}")
        return replace(self, proof=self.proof._replace(safe=safe, fed=fed))

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        count, errors, counts = self.trials.fate.size, self.errors, self.trials.counts
        rows = [
            (FED[name], name, share, errors[name], counts[name], count, self.trials.intervals[name])
            for name, share in self.shares.shares.items()
        ]
        columns = (
            "a part is fed",
            "fate",
            Column("probability", show=".6f"),
            Column("its error", show=".1e"),
            "met",
            "trials",
            Column("95 % interval", show=".4f", ends=True),
        )
        name = self.end.scene.name
        answer = [Table(columns, rows, f"{name}: what is fed", "sampled, not proved")]
        if self.safe is not None and self.fed is not None:
            lines = [
                ("only the wanted side is fed", self.safe.verdict),
                ("every start is fed", self.fed.verdict),
            ]
            lines += [("almost every start is fed", self.fed.almost_every)] if self.fed.almost_every else []
            left_out = ", ".join(self.model.left_out) or None
            heads, of = ("claim", "verdict", "not simulated"), self.model.sentence
            answer.append(Table(heads, [(*line, left_out) for line in lines], "Proofs", of))
        if self.brackets is not None:
            answer += self.brackets.tables()
        return tuple(answer)

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it: docs/json.md."""
        scene, shares, errors = self.end.scene, self.shares, self.errors
        rate = scene.world.throw_rate
        return as_table(
            scene=scene.name,
            unit=scene.unit,
            position=self.end.x,
            side=self.end.side,
            starts_from=None if self.end.laid else self.end.starts,
            laid=by_side(self.end.laid) or None,
            throw_rate=rate,
            clear=self.clear,
            tipping=self.tipping,
            next_throw=self.next_throw,
            vacuous=self.vacuous,
            model=self.model,
            safety=self.safe,
            progress=self.fed,
            noise=self.noise or None,
            scatter=self.scatter.words() or None,
            probabilities={
                name: {"value": share, "error": errors[name]} for name, share in shares.shares.items()
            },
            throws={
                "mean": shares.mean_throws,
                "quantile_95": shares.quantile(0.95),
                "ended": {"share": ENDED, "throws": [shares.quantile(share) for share in ENDED]},
            },
            right_per_minute=shares.per_minute(rate),
            success=None
            if self.curve is None
            else as_table(**picked(self.curve, *(each.name for each in fields(Curve)))),
            trials=self.trials,
            brackets=self.brackets,
            machines=self.drawn,
            crowds=[crowd.to_json() | {"right_per_minute": crowd.per_minute(rate)} for crowd in self.crowds],
        )


def _proved_of(end: ArmEnd) -> ArmEnd:
    """Give what can be proved of: normal deviations have no bound, so that nothing holds for every sequence of them."""
    return end if end.scene.effects.spread != "gaussian" else replace(end, scene=still(end.scene))


@shown_in_notebooks
@arguments_checked
def feed(
    scene: Scene | str | Path | Mapping[str, Any],
    scatter: Scattering | None = None,
    *,
    fitted: Machines | None = None,
    side: int | None = None,
    laid: LaidLike | None = None,
    noise: Mapping[str, str] | None = None,
    prove: bool = True,
    seconds: float = SECONDS,
    level: bool = True,
    trials: int | None = None,
    seed: int = 0,
    brackets: int | None = None,
    parts: int | None = None,
    batches: int = BATCHES,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Feeding:
    """Say what becomes of parts that are thrown along an arm with a cavity at its end.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        A scene with [cavity], or what `limitsets.load` takes.
    scatter : Scattering, optional
        Random noise of every throw, for probabilities and trials; default that of the scene, `[world] scatter` with
        `[effects] spread`, or none.
    fitted : Machines, optional
        Of a fit (`limitsets.fitting.Fit.machines`): the scene becomes its most likely machine, the trials are of
        machines drawn from it with its scatter, and three standard deviations of it are the noise of the proofs.
    side : int, optional
        The side wanted; default the goal's.
    laid : mapping of int to sequence of (float, float), optional
        By side the ranges of x where parts are laid down, as for `limitsets.certify`: the proofs are of these starts,
        and random starts lie there, equally likely per length.  Default: the proofs are of the whole arm, and random
        starts lie from a twentieth of the arm beyond a on.
    noise : mapping of str to str, optional
        ``{"throw.speed": "0.3 %"}``: what may differ at every throw in the proofs, whatever the sequence.
    prove : bool
        Whether to prove safety and progress.
    seconds : float
        Finer cells than the first are tried in these proofs only if they are likely to be done in so many seconds; the
        first cut the noise into fewer pieces than 256 where it would take longer than this, and than 10 s.
    level : bool
        Whether to look for the level of the noise at which 95 % are fed rightly.
    trials : int, optional
        Parts thrown from random starts; by default 100 000, or fewer where that takes more than 5e7 throws.
    seed : int
        Of the trials.
    brackets : int, optional
        Cells per side for proved brackets of the fates, of noise with uniform or normal laws: seconds to minutes.
    parts : int, optional
        Throw so many parts at once, in the engine: for a scene with ``effects.contact = true`` and `world.friction`.
    batches : int
        How often that is tried.
    executor : concurrent.futures.Executor, optional
        Where these batches are thrown; default here. The numbers are the same.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    Feeding

    Raises
    ------
    AnswerError
        For a scene without a cavity or a wanted side, no trials, or noise of which nothing can be proved; parts at once
        in a scene without contact, or without pymunk.

    Examples
    --------
    >>> import limitsets as ls
    >>> cavity = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), "cavity": cavity})
    >>> found = ls.feed(scene, trials=1000)
    >>> found.safe.verdict, found.fed.throws
    ('proved', 786)
    >>> found.trials.counts["right"] + found.trials.counts["edge"]
    1000
    """
    read = load(scene)
    if fitted is not None:
        read = fitted.on(read)
        scatter, noise = scatter or fitted.scattering, fitted.noise if noise is None else noise
    end = arm_end_of(read, side, laid)
    if trials is not None and trials < 1:
        raise AnswerError("the trials", trials, "1 or more", "throw some parts")
    require_seed(seed)
    if scatter is None:
        scatter = Scattering() if read.effects.spread is None else scattering_of(read)
    # first, as they may be refused: with contact between the parts and without
    how: dict[str, Any] = {"batches": batches, "seed": seed, "executor": executor, "progress": progress}
    both = () if parts is None else (True, False)
    crowds = tuple(run_crowd(end, scatter, parts or 0, between=between, **how) for between in both)
    proof = proved_feeding(_proved_of(end), noise, seconds=seconds, progress=progress) if prove else None
    count = trials_within(end, scatter, TRIALS, THROWS, seed=seed) if trials is None else trials
    curve = None
    if level and scatter.given():
        curve = success_curve(end, scatter, parts=min(count, TRIALS), seed=seed, progress=progress)
    if fitted is None:
        thrown, drawn = run_trials(end, scatter, count, seed=seed, progress=progress), None
    else:
        thrown, drawn = drawn_trials(fitted, end, scatter, count, laid=laid, seed=seed, progress=progress)
    return Feeding(
        end,
        {number: clear_beyond(read, number) for number in range(len(read.sides))},
        proof,
        noise=dict(noise or {}),
        scatter=scatter,
        curve=curve,
        trials=thrown,
        brackets=None if brackets is None else fate_brackets(end, scatter, brackets, progress=progress),
        crowds=crowds,
        drawn=drawn,
    )
