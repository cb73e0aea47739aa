"""Write scenes: TOML text, and files that are replaced whole."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

from limitsets.arguments import arguments_checked
from limitsets.errors import SceneError
from limitsets.files import replaced
from limitsets.scene.scene import Scene

_WIDTH = 100
# tables with a heading of their own below the first level; all others are written in one line
_HEADED = {"part.mass"}


@arguments_checked
def dump(scene: Scene, path: str | Path | None = None) -> str:
    """Write a scene as TOML, every quantity in the words in which it was given.

    Parameters
    ----------
    scene : Scene
        What to write.
    path : str or Path, optional
        File to write the text to as well; one that exists is replaced whole, or not at all.

    Returns
    -------
    str
        The text, from which `limitsets.load` makes an equal scene.

    Raises
    ------
    SceneError
        The file cannot be written.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> dump(load("paper-designed")).splitlines()[0]
    'name = "paper-designed"'
    """
    from tomlkit import dumps

    text = dumps({key: _item(value, key) for key, value in scene.text.items()})
    if path is not None:
        replace_file(Path(path), text)
    return text


def _item(value: Any, path: str) -> Any:
    import tomlkit

    if isinstance(value, dict):
        table = tomlkit.table() if "." not in path or path in _HEADED else tomlkit.inline_table()
        for key, inner in value.items():
            table[key] = _item(inner, f"{path}.{key}")
        return table
    if isinstance(value, list):
        array = tomlkit.array()
        array.extend(_item(each, f"{path}.") for each in value)
        return array.multiline(len(array.as_string()) > _WIDTH)
    return value


def replace_file(path: Path, text: str) -> None:
    """Write the text of a scene to a file, whole or not at all."""
    try:
        if not path.parent.is_dir():  # rather a typing error than a wish
            raise FileNotFoundError(errno.ENOENT, "there is no such folder", str(path.parent))
        with replaced(path.parent) as draft:
            (draft / path.name).write_text(text, encoding="utf-8", newline="\n")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError(
            "the file",
            str(path),
            "a place that can be written",
            f"it could not be written: {reason}",
            file=str(path),
        ) from None
