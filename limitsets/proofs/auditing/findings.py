"""The audit: every assumption of the minimal model on the limit set and the whole domain, and the effects called for.

An assumption is broken if its number is proved to be on the wrong side of its limit at a tested throw; it holds if the
number is proved to be on the right side on every cell.  Otherwise the answer is sampled.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import Column, LimitsetsError, Table, Tabled, arguments_checked, as_table, picked
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.scene import NOT_TIPPING, TIPPING, Model
from limitsets.proofs.auditing.assumptions import ASSUMPTIONS, Assumption
from limitsets.proofs.auditing.judging import Cells, Places, Row, Sample, all_hold, enclosed_at, places, where

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene
    from limitsets.proofs.prover.parameters import ParameterBox


Extents = dict[int, list[tuple[float, float]]]

# Throws that are evaluated where only a count is wanted: about a second.
MOST_THROWS = 200_000


@dataclass(frozen=True)
class Finding:
    """The verdict on one assumption in one place.

    Attributes
    ----------
    about : Assumption
        The assumption: its effect, words and dimension.
    place : str
        "limit-set" or "domain".
    called_for : bool or None
        Whether the effect is called for: the assumption is broken somewhere.  None: cannot tell.
    how : str
        "proved" or "sampled".
    side, x : int or None, float or None
        Start of the throw whose number is worst, or nearest to the limit [length].
    worst : float or None
        The number there; None where it has no bound, or no throw was evaluated.
    threshold : float or None
        Its limit on that side; where a fact is missing, the value of the fact at which it would begin to matter.
    missing : str
        The fact of the world that is missing, empty if none.
    ranges : dict of int to list of (lo, hi)
        Per side where on the domain the assumption is broken [length]; empty for the limit set.
    jogs, flips, others : (int, int)
        On the orbits: how many jogs, flips and rolls break the assumption, and how many of them there are.
    simulated : bool
        Whether the scene simulates the effect.
    """

    about: Assumption
    place: str
    called_for: bool | None
    how: str
    side: int | None = None
    x: float | None = None
    worst: float | None = None
    threshold: float | None = None
    missing: str = ""
    ranges: Extents = field(default_factory=dict)
    jogs: tuple[int, int] = (0, 0)
    flips: tuple[int, int] = (0, 0)
    others: tuple[int, int] = (0, 0)
    simulated: bool = False

    @property
    def effect(self) -> str:
        """Name of the effect that lifts the assumption."""
        return self.about.effect

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON."""
        return as_table(
            effect=self.effect,
            assumption=self.about.what,
            where=self.place,
            called_for="cannot tell" if self.called_for is None else self.called_for,
            **picked(self, "how", "side", "x", "worst", "threshold"),
            missing=self.missing or None,
            **picked(self, "ranges", "jogs", "flips", "others", "simulated"),
        )


@dataclass(frozen=True, eq=False)
class Audit(Tabled):
    """What a scene calls for.

    Attributes
    ----------
    scene : Scene
        The scene.
    findings : tuple of Finding
        Every assumption, first on the limit set, then on the domain.
    extents : dict of int to list of (lo, hi)
        Cells that hold the limit set [length].
    enclosed : bool
        Whether that is proved.
    """

    scene: Scene
    findings: tuple[Finding, ...]
    extents: Extents
    enclosed: bool

    def on(self, place: str) -> tuple[Finding, ...]:
        """Give the findings of one place: "limit-set" or "domain"."""
        return tuple(finding for finding in self.findings if finding.place == place)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        columns = (
            "effect",
            "assumed",
            "where",
            Column("called for", show=lambda value: "yes" if value else "no"),
            "how",
            "side",
            Column("x", self.scene.unit, ".4f"),
            Column("worst", show=".4g"),
            Column("threshold", show=".4g"),
            "unit",
            "missing",
        )
        units = {"length": self.scene.unit, "angle": "rad"}
        rows = [
            (
                each.effect,
                each.about.name,
                each.place,
                each.called_for,
                each.how,
                each.side,
                each.x,
                each.worst,
                each.threshold,
                units.get(each.about.dimension, ""),
                each.missing or None,
            )
            for each in self.findings
        ]
        return (Table(columns, rows, f"{self.scene.name}: what the model leaves out"),)

    def to_json(self) -> list[dict[str, Any]]:
        """Give it as plain tables for JSON, one per finding."""
        return [finding.to_json() for finding in self.findings]


def _worst(row: Row, enclosures: Mapping[int, Array], samples: Mapping[int, Sample]) -> dict[str, Any]:
    """Find the throw whose number is farthest beyond its limit, or nearest to it."""
    best: tuple[float, dict[str, Any]] = (-math.inf, {})
    for side, seen in enclosures.items():
        reached = row.reached(seen)
        known = ~np.isnan(reached) & ~(np.isneginf(reached) if row.about.below else np.isposinf(reached))
        if not known.any():
            continue
        limit = 0.0 if row.terms.limit is None else row.limit(side)
        excess = np.where(known, reached - limit if row.about.below else limit - reached, -np.inf)
        k = int(excess.argmax())
        if not best[1] or excess[k] > best[0]:
            value: float | None = _finite(float(reached[k]))
            threshold: float | None = row.limit(side)
            if row.terms.limit is None and value is not None:
                threshold = row.terms.matters(value)
            x = float(samples[side].x[k])
            best = excess[k], {"side": side, "x": x, "worst": value, "threshold": _finite(threshold)}
    return best[1]


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else value


def _shares(broken: Mapping[int, Mask], samples: Mapping[int, Sample]) -> dict[str, Any]:
    from limitsets.systems.maps import codes

    def count(wanted: int) -> tuple[int, int]:
        which = {side: sample.code == wanted for side, sample in samples.items()}
        hit = sum(int((broken[side] & mask).sum()) for side, mask in which.items())
        return hit, sum(int(mask.sum()) for mask in which.values())

    return {"jogs": count(codes.JOG), "flips": count(codes.FLIP), "others": count(codes.ROLL)}


def _ranges(
    box: ParameterBox, row: Row, enclosures: Mapping[int, Array], domain: Mapping[int, Sample]
) -> Extents:
    ranges = {}
    for side, sample in domain.items():

        def broken(x: Array, side: int = side) -> Mask:
            return row.broken(enclosed_at(box, side, x), side)

        ranges[side] = where(broken, sample.x, row.broken(enclosures[side], side))
    return {side: parts for side, parts in ranges.items() if parts}


def _proved(box: ParameterBox, cells: Cells, rows: list[Row], hit: Sequence[bool]) -> dict[int, bool]:
    """For each assumption that no sampled throw breaks, whether it is proved to hold on all cells."""
    unbroken = [k for k, row in enumerate(rows) if not hit[k] and row.terms.limit is not None and bool(cells)]
    return dict(zip(unbroken, all_hold(box, cells, [rows[k] for k in unbroken]), strict=True))


def _findings(
    place: str, scene: Scene, box: ParameterBox, rows: list[Row], sites: Places
) -> tuple[Finding, ...]:
    """Judge every assumption in one place."""
    limit = place == "limit-set"
    samples, cells = (sites.orbits, sites.limit_cells) if limit else (sites.domain, sites.domain_cells)
    sound = sites.enclosed or not limit
    enclosures = {side: enclosed_at(box, side, sample.x) for side, sample in samples.items()}
    broken = [{side: row.broken(seen, side) for side, seen in enclosures.items()} for row in rows]
    hit = [any(flags.any() for flags in each.values()) for each in broken]
    proved = _proved(box, cells, rows, hit)
    findings = []
    for k, row in enumerate(rows):
        called = True if hit[k] else (None if row.terms.limit is None or not samples else False)
        sure = (hit[k] and not limit) or (sound and proved.get(k, False))
        findings.append(
            Finding(
                row.about,
                place,
                called,
                "proved" if sure else "sampled",
                **_worst(row, enclosures, samples),
                missing=row.terms.missing,
                ranges={} if limit or not hit[k] else _ranges(box, row, enclosures, samples),
                **_shares(broken[k], samples),
                simulated=row.about.effect in scene.effects.on(),
            )
        )
    return tuple(findings)


def _prepared(scene: Scene) -> tuple[ParameterBox, list[Row], Places]:
    """Collect the parameters, the assumptions with the scene's facts, and the throws at which they are evaluated."""
    from limitsets.feeder.scene import load
    from limitsets.proofs.prover.parameters import parameter_box

    # the assumptions are those of the minimal model, so its throws are evaluated, whichever effects are on
    without = {} if scene.sides.rests.all() else dict.fromkeys(TIPPING, True)
    box = parameter_box(load({**scene.as_dict(), "effects": without}))
    return box, [Row(about, about.terms(scene, box)) for about in ASSUMPTIONS], places(scene, box)


def audited(model: Model, scene: Scene) -> Model:
    """Add to a model which of its assumptions break on the limit set.

    The count is that of `audit`, without the domain and without the proofs that the other assumptions hold.

    Parameters
    ----------
    model : Model
        Of which model an answer is (`limitsets.feeder.scene.left_out`).
    scene : Scene
        The scene.

    Returns
    -------
    Model
        Unchanged where there is no limit set.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.feeder.scene.left_out import Model
    >>> scene = ls.load("paper-initial")
    >>> audited(Model.of(scene), scene).broken
    ('pivot', 'pivot', 'roll')
    """
    try:
        box, rows, sites = _prepared(scene)
    except LimitsetsError:  # no throw of this scene can be enclosed
        return model
    step = -(-sum(sample.x.size for sample in sites.orbits.values()) // MOST_THROWS)
    seen = {side: enclosed_at(box, side, sample.x[::step]) for side, sample in sites.orbits.items()}
    broken = [
        row.about.effect
        for row in rows
        if row.about.effect not in model.simulated
        and (row.about.effect != "spread" or "scatter" in model.left_out)  # else noise covers the scatter
        and any(row.broken(enclosed, side).any() for side, enclosed in seen.items())
    ]
    return replace(model, broken=tuple(broken)) if seen else model


@arguments_checked
def audit(scene: str | Path | Mapping[str, Any] | Scene) -> Audit:
    """Find out which of the effects that the minimal model leaves out a scene calls for.

    Facts in ``[world]`` are used whether or not an effect is simulated.  The formulas are those of the minimal model;
    where a scene simulates effects, they are asked of the places to which its map leads.

    Parameters
    ----------
    scene : str, Path, mapping or Scene
        A scene, or what `limitsets.load` reads.

    Returns
    -------
    Audit
        Per assumption: broken or not on the limit set and on the domain, where worst, how often, and how that is known.

    Raises
    ------
    SceneError
        For a scene that cannot be read.

    Examples
    --------
    >>> import limitsets as ls
    >>> audited = ls.audit("paper-initial")
    >>> [(each.effect, each.how) for each in audited.on("limit-set") if each.called_for]
    [('pivot', 'sampled'), ('pivot', 'sampled'), ('roll', 'sampled')]
    >>> [(each.effect, each.how) for each in audited.on("limit-set") if each.called_for is False]
    [('release', 'proved'), ('landing', 'proved'), ('slip', 'proved'), ('arm', 'proved')]
    """
    from limitsets.feeder.scene import load

    chosen = load(scene)
    box, rows, sites = _prepared(chosen)
    two = (_findings(place, chosen, box, rows, sites) for place in ("limit-set", "domain"))
    return Audit(chosen, sum(two, ()), sites.extents, sites.enclosed)


# ----------------------------------------------------------------
# `[effects] auto = true`: switch on the effects that the limit set calls for, and name those that cannot be.


# Assumptions that no effect lifts: a scene that breaks one has to be changed.
NO_EFFECT = ("release", "arm")


@dataclass(frozen=True, eq=False)
class EffectChoice:
    """The scene that is analysed, and how it came to its effects.

    Attributes
    ----------
    scene : Scene
        With the chosen effects switched on by name, and without `auto`.
    switched_on : tuple of str
        The effects that the audit switched on.
    left_out : dict of str to str
        Effects, or assumptions without one, that are called for or cannot be told, and why they are not simulated.
    tipping : tuple of str
        The effects that were switched on because the part cannot rest on one of its sides.
    """

    scene: Scene
    switched_on: tuple[str, ...]
    left_out: dict[str, str]
    tipping: tuple[str, ...] = ()

    @property
    def notice(self) -> str:
        """What was switched on because of a side on which the part cannot rest, a clause; empty for nothing."""
        if not self.tipping:
            return ""
        sides = " and ".join(str(side) for side in np.flatnonzero(~self.scene.sides.rests))
        lines = " and ".join(f"{effect} = true" for effect in self.tipping)
        return (
            f"switched on {' and '.join(self.tipping)}: the part cannot rest on side {sides}, and tips on from there; "
            f"other commands ask for {lines} in [effects]"
        )

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON."""
        return as_table(
            simulated=self.scene.effects.on(), **picked(self, "switched_on", "left_out", "tipping")
        )


def hindrance(scene: Scene, finding: Finding, others: tuple[str, ...]) -> str:
    """Why an effect that is called for, or may be, cannot be switched on beside others; empty if it can."""
    from limitsets.feeder.thrower.effects import EFFECTS

    effect = finding.effect
    if finding.called_for is None:
        return f"{f'world.{finding.missing} is missing' if finding.missing else 'no limit set'}: cannot tell"
    if effect in NO_EFFECT:
        return "broken, and no effect simulates that: change the scene"
    if effect not in EFFECTS:
        return "called for, but this version cannot simulate it"
    if scene.flight != "exact":
        return 'called for, but it needs flight = "exact"'
    missing = [fact for fact in EFFECTS[effect].needs if getattr(scene.world, fact) is None]
    if missing:
        return f"called for, but {' and '.join(f'world.{fact}' for fact in missing)} missing"
    if effect in NOT_TIPPING and not scene.sides.rests.all():
        return "called for, but it does not know a side on which the part cannot rest"
    barred = [each for each in others if each in EFFECTS[effect].excludes or effect in EFFECTS[each].excludes]
    return f"called for, but it cannot be simulated together with {' and '.join(barred)}" if barred else ""


def with_effects(scene: Scene, effects: tuple[str, ...]) -> Scene:
    """Switch effects on, and `auto` off."""
    from limitsets.feeder.thrower.effects import EFFECTS

    tree = copy.deepcopy(dict(scene.text))
    table = {key: value for key, value in tree.get("effects", {}).items() if key != "auto"}
    table.update({effect: next(iter(EFFECTS[effect].words), True) for effect in effects})
    tree["effects"] = table
    return scene.of(tree, scene.file)


def choose_effects(scene: Scene) -> EffectChoice:
    """Resolve `auto`.

    An effect is switched on where the audit finds it called for on the limit set and its facts are given; of two that
    exclude each other, the one that is on already, or stands first in the audit.  With it the limit set is another,
    which may call for more: the audit is repeated until it asks for nothing new.

    Parameters
    ----------
    scene : Scene
        Any scene; without `auto` it stays as it is.

    Returns
    -------
    EffectChoice

    Examples
    --------
    >>> import limitsets as ls
    >>> text = ls.load("paper-initial").as_dict() | {"effects": {"auto": True}}
    >>> choose_effects(ls.load(text)).switched_on
    ('roll',)
    """
    if not scene.effects.auto:
        return EffectChoice(scene, (), {})
    chosen: list[str] = []
    now = with_effects(scene, ())
    while True:
        wanted: list[str] = []
        left: dict[str, str] = {}
        for finding in audit(now).on("limit-set"):
            if finding.called_for is False or finding.simulated or finding.effect in wanted:
                continue
            reason = hindrance(now, finding, (*now.effects.on(), *wanted))
            if reason:
                left[finding.effect] = left.get(finding.effect) or reason
            else:
                wanted.append(finding.effect)
        if not wanted:
            return EffectChoice(now, tuple(chosen), left)
        chosen += wanted
        now = with_effects(scene, tuple(chosen))
