"""Compare two records of answers: which answer differs, and where in it."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def keep(folder: Path, number: int, name: str, answer: Any) -> None:
    """Write one answer, with its name, to a file of its own."""
    text = json.dumps({"name": name, "answer": answer}, indent=0, sort_keys=True, default=str)
    (folder / f"{number:04d}.json").write_text(text, encoding="utf-8")


def kept(folder: Path) -> dict[str, Any]:
    """Read what was kept, by name."""
    read = (json.loads(file.read_text(encoding="utf-8")) for file in sorted(folder.glob("*.json")))
    return {each["name"]: each["answer"] for each in read}


def differences(one: Any, other: Any, place: str = "") -> Iterator[str]:
    """Name the places in which two answers differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted(one.keys() | other.keys()):
            if key not in one or key not in other:
                yield f"{place}.{key}: only {'after' if key in other else 'before'}"
            else:
                yield from differences(one[key], other[key], f"{place}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for k, (first, second) in enumerate(zip(one, other, strict=True)):
            yield from differences(first, second, f"{place}[{k}]")
    elif one != other:
        yield f"{place}: {_short(one)} before, {_short(other)} after"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 100 else f"{text[:97]}..."
