"""Input of the noise of a tolerance sheet: from the scene's world, or from texts; and the scene without noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from limitsets.errors import AnswerError
from limitsets.robust.noise.scattering import LAWS, Scattering, scattering_of
from limitsets.scene import Scene, load
from limitsets.scene.quantities import deviation, find

FIELDS = {"throw.speed": "speed", "gravity.tilt": "tilt", "landing.x": "landing"}


def still(scene: Scene) -> Scene:
    """Return a scene without its scatter: in a margin, what is not asked about does not deviate."""
    if scene.effects.spread is None:
        return scene
    tree = scene.as_dict()
    tree["effects"].pop("spread")
    return replace(load(tree), file=scene.file)


def noise_of(scene: Scene, given: Scattering | None) -> tuple[Scattering | None, str]:
    """Choose the noise: what is given, else the scatter of the scene's world; and say where it is from."""
    if given is not None:
        return (given, "as it was asked for") if given.given() else (None, "")
    if scene.world.scatter is None:
        return None, ""
    if scene.effects.spread is not None:
        return scattering_of(scene), "the scene's, [world] scatter with [effects] spread"
    normal = replace(scene, effects=scene.effects.also(spread="gaussian"))
    words = "the scene's, [world] scatter, taken as standard deviations of normal laws; "
    return scattering_of(normal), words + 'spread = "bounded" in [effects] would make them bounds'


def scattering_from(scene: Scene, texts: Mapping[str, str], law: str = "gaussian") -> Scattering:
    """Read noise from texts.

    Parameters
    ----------
    scene : Scene
        The scene.
    texts : mapping of str to str
        By quantity, ``{"throw.speed": "0.5 %", "landing.x": "0.02 in"}``.
    law : str
        Of `limitsets.robust.noise.scattering.LAWS`.

    Raises
    ------
    AnswerError
        Noise of another quantity than throw.speed, gravity.tilt and landing.x, or another law.

    Examples
    --------
    >>> import limitsets as ls
    >>> scattering_from(ls.load("paper-designed"), {"throw.speed": "0.5 %"}).words()
    {'speed': 'Gaussian(sigma=0.005)'}
    """
    if law not in LAWS:
        raise AnswerError("the law of the noise", law, " or ".join(LAWS), "correct the word")
    found: dict[str, Any] = {}
    for name, text in texts.items():
        find(name)
        if name not in FIELDS:
            remedy = "what is fixed but unknown is a tolerance: it has a margin"
            raise AnswerError("the noise", name, f"noise of {', '.join(FIELDS)}", remedy)
        given = deviation(text, name, scene.unit, key=name)
        size = given.value
        if name == "throw.speed" and not given.relative:
            size /= scene.value(name)
        if name == "gravity.tilt" and given.relative:
            size *= scene.value(name)
        found[FIELDS[name]] = LAWS[law](size)
    return Scattering(**found)
