"""Scenes with the cavity of studies/sizes.toml."""

import tomllib
from pathlib import Path

import limitsets as ls

CAVITY = tomllib.loads((Path(__file__).parents[2] / "studies" / "sizes.toml").read_text())["cavity"]


def with_cavity(name="paper-designed", *, rate=None, tables=None, **changes):
    """Give a built-in scene with that cavity, some of it changed."""
    world = {} if rate is None else {"world": {"throw_rate": rate}}
    return ls.load({**ls.load(name).as_dict(), "cavity": {**CAVITY, **changes}, **world, **(tables or {})})
