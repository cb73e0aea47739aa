"""Scenes with the tray of studies/sizes.toml."""

import tomllib
from pathlib import Path

import limitsets as ls

SIZES = tomllib.loads((Path(__file__).parents[2] / "studies" / "sizes.toml").read_text())["tray"]


def with_tray(name="paper-designed", world=None, contact=True, **changes):
    """A scene over that tray; agitation and wash are assumed."""
    tree = ls.load(name).as_dict()
    tree["tray"] = {**SIZES, "agitation": "0.5 in", "wash": "1 in", **changes}
    tree["world"] = {"friction": 0.3, "restitution": 0.3} if world is None else world
    return ls.load({**tree, "effects": {"contact": contact}})
