"""The parts of the assembly, with and without contact, and the noise of study 05."""

import limitsets as ls
from limitsets.feeder.scattering import Gaussian, Scattering

NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
NAMES = ("paper-triangle", "paper-quadrilateral")


def pair(*, contact=False, **tables):
    """Give both scenes, some tables of both changed."""
    found = []
    for name in NAMES:
        tree = ls.load(name).as_dict()
        tree["effects"] = {**tree.get("effects", {}), **({"contact": True} if contact else {})}
        found.append(ls.load({**tree, **tables}))
    return found


def both_own(*, contact):
    """Give both under a user's own names."""
    scenes = pair(contact=contact)
    return [
        ls.load({**scene.as_dict(), "name": name})
        for scene, name in zip(scenes, ("lower", "upper"), strict=True)
    ]
