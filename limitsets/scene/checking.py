"""All that is wrong with a scene, at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from limitsets.errors import SceneError
from limitsets.scene.reading import structure_of
from limitsets.scene.scene import Scene
from limitsets.scene.validation import plain, refusals

__all__ = ["problems"]

# Without these there is no scene; all other tables can be left out to look at the rest.
NEEDED = ("name", "part", "arm", "throw")


def problems(source: str | Path | Mapping[str, Any]) -> tuple[SceneError, ...]:
    """Find all that is wrong with a scene.

    Words, values and units are looked at all together; contradictions between them table by table.

    Parameters
    ----------
    source : str, Path or mapping
        As for `limitsets.load`.

    Returns
    -------
    tuple of SceneError
        Empty for a scene that loads.

    Examples
    --------
    >>> wrong = {"part": {"sides": ["5 in"]}, "arm": {"length": 28}, "throw": {"kapa": "25 in"}}
    >>> [error.key for error in problems(wrong)][:4]
    ['throw.kapa', 'arm.length', 'part.mass', 'arm.surface_height']
    """
    try:
        structure, file = structure_of(source)
        tree = plain(structure, file)
    except SceneError as error:  # no file, no TOML: there is nothing more to look at
        return (error,)
    found = refusals(tree, file)[1]
    blamed = {_table_of(error) for error in found}
    while not blamed & {*NEEDED, ""}:
        try:
            Scene.of({key: value for key, value in tree.items() if key not in blamed}, file)
        except SceneError as error:
            if _table_of(error) in blamed:  # of what was left out, and so no news
                break
            found.append(error)
            blamed.add(_table_of(error))
        else:
            break
    return tuple(found)


def _table_of(error: SceneError) -> str:
    """Name the table of the first level that an error is about."""
    return (error.key or "").partition(".")[0].partition("[")[0]
