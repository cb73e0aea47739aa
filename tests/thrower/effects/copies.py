"""Copies of the package with the effects and without them, for processes of their own."""

import os
import shutil
from pathlib import Path

import limitsets

PACKAGE = Path(limitsets.__file__).parent


def environment_of_copy(folder: Path, word: str) -> dict[str, str]:
    """Copy the package, "with" or "without" the effects; the environment of a process that imports and caches there."""
    copy = folder / word / "limitsets"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    if word == "without":
        shutil.rmtree(copy / "feeder" / "thrower" / "effects")
        (copy / "feeder" / "thrower" / "full.py").unlink()
    cache = folder / word / "cache"
    safe = {"PYTHONSAFEPATH": "1"}  # not the folder in which tests are run, which has the package itself
    return {**os.environ, **safe, "PYTHONPATH": str(copy.parent), "NUMBA_CACHE_DIR": str(cache)}
