"""Effects in proofs: the maps that can be enclosed, and the effects that count as noise.

Landing and roll make another map, which has an `image_box` of its own.  A bounded spread is noise: the minimal map, or
that with the other effects, thrown with anything in its bounds at every throw.
"""

from __future__ import annotations

from collections.abc import Mapping

from limitsets.errors import AnswerError
from limitsets.scene import Scene
from limitsets.thrower.effects import EFFECTS
from limitsets.thrower.effects.spread import Spread
from limitsets.thrower.motion import FullThrow, without

REMEDY = "leave the others out of [effects] for a proof; orbits and limit sets by samples have them"

# The scatter of the world and the noise of a proof, by their names.
NOISE = {"speed": "throw.speed", "landing": "landing.x"}


def simulated(scene: Scene) -> FullThrow | None:
    """Return the scene's map with the effects that are more than noise; None where there are none.

    Raises
    ------
    AnswerError
        An effect of which nothing can be proved.
    """
    for effect in scene.effects.on():
        if not EFFECTS[effect].enclosed:
            known = [name for name, each in EFFECTS.items() if each.enclosed and name != "spread"]
            allowed = f"{', '.join(known)} and bounded spread"
            raise AnswerError("the effects of a proof", effect, allowed, REMEDY)
    if scene.effects.spread not in (None, "bounded"):
        raise AnswerError(
            "the effect spread",
            scene.effects.spread,
            '"bounded": normal deviations have no bound, so that nothing holds for every sequence of throws',
            'write spread = "bounded", with bounds in [world] scatter',
        )
    found = without(scene.map, Spread)
    return found if isinstance(found, FullThrow) else None


def scattered(scene: Scene) -> dict[str, str]:
    """Return what the scene's bounded spread says, by quantity, as noise."""
    if scene.effects.spread != "bounded":
        return {}
    table = scene.text["world"]["scatter"]
    return {name: table[word] for word, name in NOISE.items() if word in table}


def joined(noise: Mapping[str, str], scatter: Mapping[str, str]) -> dict[str, str]:
    """Join the noise asked for with what the scene scatters.

    Raises
    ------
    AnswerError
        Both say something of one quantity, and not the same.
    """
    for name in noise.keys() & scatter.keys():
        if noise[name] != scatter[name]:
            allowed = f"{scatter[name]}, as the scene scatters it"
            raise AnswerError(f"the noise of {name}", noise[name], allowed, "leave one of them out")
    return {**scatter, **noise}
