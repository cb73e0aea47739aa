"""Write scenes: TOML text, and files that are replaced whole."""

from __future__ import annotations

import errno
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from limitsets.errors import SceneError
from limitsets.files import replaced
from limitsets.scene.scene import Scene

__all__ = ["dump"]

_WIDTH = 100
# tables with a heading of their own below the first level; all others are written in one line
_HEADED = {"part.mass"}


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
    text = "\n".join(_table(scene.text, "")).strip("\n") + "\n"
    if path is not None:
        _replace(Path(path), text)
    return text


def _table(table: Mapping[str, Any], heading: str) -> list[str]:
    def headed(key: str, value: object) -> bool:
        return isinstance(value, dict) and (not heading or f"{heading}.{key}" in _HEADED)

    plain = {key: value for key, value in table.items() if not headed(key, value)}
    lines = ["", f"[{heading}]"] if heading and (plain or not table) else []
    lines += [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in table.items():
        if headed(key, value):
            lines += _table(value, f"{heading}.{_key(key)}" if heading else _key(key))
    return lines


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, str):
        # a JSON string is a basic string of TOML, but for the one sign that JSON leaves bare
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        inner = ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list):
        items = [_value(item) for item in value]
        line = f"[{', '.join(items)}]"
        return line if len(line) <= _WIDTH else "[\n" + "".join(f"    {item},\n" for item in items) + "]"
    return repr(value)


def _replace(path: Path, text: str) -> None:
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
