"""Which facts of `[world]` the model of an answer has, and which it leaves out; the sentence that says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from limitsets.base import as_table, picked, proposed
from limitsets.feeder.scene.facts import SCATTERED

if TYPE_CHECKING:
    from limitsets.feeder.scene.scene import Scene


WITHOUT_SCATTER = "of the scene without its scatter"
"""Said of what holds where all throws are alike, in a scene that scatters its throws."""


@dataclass(frozen=True)
class Model:
    """Of which model an answer speaks.

    Attributes
    ----------
    simulated : tuple of str
        Effects beyond the minimal model that the answer has.
    left_out : tuple of str
        Facts of ``[world]`` that the scene states and the answer does not have: "friction", "scatter", ...
    broken : tuple of str or None
        The effect that would lift it, for each assumption of the model that is broken on the limit set; None where
        nobody has looked.
    """

    simulated: tuple[str, ...]
    left_out: tuple[str, ...]
    broken: tuple[str, ...] | None = None

    @classmethod
    def of(cls, scene: Scene, noise: Mapping[str, str] | None = None) -> Model:
        """Give the model of a scene, with the effects that its table ``[effects]`` switches on.

        Parameters
        ----------
        scene : Scene
            The scene as the answer has it.
        noise : mapping of str to str, optional
            What differs at every throw in the answer, ``{"throw.speed": "0.5 %"}``.

        Examples
        --------
        >>> import limitsets as ls
        >>> text = ls.load("paper-designed").as_dict() | {"world": {"friction": 0.3, "restitution": 0.2}}
        >>> Model.of(ls.load(text)).sentence
        'of the minimal model: friction and restitution of [world] are not in it'
        """
        on, world = scene.effects.on(), scene.world
        has = {"throw_rate"}  # it turns numbers of throws into times, and no throw depends on it
        if on:
            from limitsets.feeder.thrower.effects import (
                EFFECTS,  # lazily: a scene without effects loads no kernel
            )

            has |= {fact for effect in on for fact in (*EFFECTS[effect].needs, *EFFECTS[effect].reads)}
        if world.restitution == 0.0:  # the minimal model's own landing
            has |= {"restitution", "bounce_threshold"}
        if _allows_for_scatter(scene, noise or {}):
            has.add("scatter")
        stated = (*world.numbers, *(() if world.scatter is None else ("scatter",)))
        return cls(on, tuple(name for name in stated if name not in has))

    @property
    def assumptions_broken(self) -> int | None:
        """How many assumptions of the model are broken on the limit set; None where nobody has looked."""
        return None if self.broken is None else len(self.broken)

    @property
    def sentence(self) -> str:
        """The model in words: its effects, and the facts left out."""
        kind = f"model with {_listed(self.simulated)}" if self.simulated else "minimal model"
        if not self.left_out:
            return f"of the {kind}: no fact of [world] is left out"
        also = f", {WITHOUT_SCATTER}" if "scatter" in self.left_out else ""
        verb = "is" if len(self.left_out) == 1 else "are"
        return f"of the {kind}{also}: {_listed(self.left_out)} of [world] {verb} not in it"

    def line(self, file: str = "") -> str:
        """Say the sentence, and what an audit found on the limit set; `file` names the scene for another audit."""
        more = f" ({proposed('audit', file)})" if file else ""
        if self.broken is None:
            return f"{self.sentence}; not audited{more}"
        if not self.broken:
            return f"{self.sentence}; no assumption is seen to break on the limit set{more}"
        count = "1 assumption breaks" if len(self.broken) == 1 else f"{len(self.broken)} assumptions break"
        effects = ", ".join(dict.fromkeys(self.broken))
        return f"{self.sentence}; {count} on the limit set: {effects}{more}"

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        return as_table(**picked(self, "simulated", "left_out", "assumptions_broken"))


def _listed(words: tuple[str, ...]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def _allows_for_scatter(scene: Scene, noise: Mapping[str, str]) -> bool:
    """Whether noise is at least what the scene scatters, of each quantity."""
    from limitsets.feeder.scene.quantities import deviation

    for word, name in SCATTERED.items():
        own = getattr(scene.world.scatter, word, None)
        if own is not None and own.value > 0.0:
            if name not in noise:
                return False
            given = deviation(noise[name], name, scene.unit, zero=True, key=name)
            if given.relative != own.relative or given.value < own.value:
                return False
    return True
