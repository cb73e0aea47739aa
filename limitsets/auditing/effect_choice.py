"""`[effects] auto = true`: switch on the effects that the limit set calls for, and name those that cannot be."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.auditing.findings import Finding, audit
from limitsets.files import as_table, picked
from limitsets.scene.facts import NOT_TIPPING

if TYPE_CHECKING:
    from limitsets.scene import Scene

# What no effect lifts: a scene that breaks it has to be changed.
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


def _hindrance(scene: Scene, finding: Finding, others: tuple[str, ...]) -> str:
    """Why an effect that is called for, or may be, cannot be switched on beside others; empty if it can."""
    from limitsets.thrower.effects import EFFECTS

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


def _with(scene: Scene, effects: tuple[str, ...]) -> Scene:
    """Switch effects on, and `auto` off."""
    from limitsets.thrower.effects import EFFECTS

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
    now = _with(scene, ())
    while True:
        wanted: list[str] = []
        left: dict[str, str] = {}
        for finding in audit(now).on("limit-set"):
            if finding.called_for is False or finding.simulated or finding.effect in wanted:
                continue
            reason = _hindrance(now, finding, (*now.effects.on(), *wanted))
            if reason:
                left[finding.effect] = left.get(finding.effect) or reason
            else:
                wanted.append(finding.effect)
        if not wanted:
            return EffectChoice(now, tuple(chosen), left)
        chosen += wanted
        now = _with(scene, tuple(chosen))
