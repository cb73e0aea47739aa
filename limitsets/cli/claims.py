"""One run for one folder: a second one that would write there at the same time is refused."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import TextIO

from limitsets.errors import LimitsetsError

__all__ = ["claim"]

# Locks of this process; they end with it, however it ends.
_HELD: dict[Path, TextIO] = {}


def claim(folder: Path) -> None:
    """Claim a folder for this process.

    Raises
    ------
    LimitsetsError
        Another process that still runs has claimed it.
    """
    try:
        import fcntl
    except ImportError:  # Windows: files that are open cannot be replaced there anyway
        return
    place = folder.resolve()
    if place in _HELD:
        return
    word = hashlib.sha256(str(place).encode()).hexdigest()[:20]
    path = Path(tempfile.gettempdir()) / f"limitsets-{os.getuid()}-{word}.lock"
    try:
        file = path.open("a")
    except OSError:  # no place for locks: nothing is kept from running
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        remedy = (
            "another run is writing there, and one of the two would be lost; name another folder with --out"
        )
        raise LimitsetsError("the folder of the report", str(folder), "a folder of one run", remedy) from None
    except OSError:  # a file system without locks
        file.close()
        return
    _HELD[place] = file
