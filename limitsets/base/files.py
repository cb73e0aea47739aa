"""Files that are replaced whole: a crash or Ctrl-C leaves the old ones as they were.  And the one form of our JSON.

Beside them: one process at a time for a place (`locked`), and the digest of the package's own code (`code_digest`).

Answers are written by this file alone, not by msgspec or cattrs: both leave nan as it is and know no numpy, so that the
same walk would follow theirs, and msgspec writes some floats differently from Python.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import platform
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

from limitsets.base.errors import LimitsetsError

# The wing that shows answers and makes none.
_FACE = "face"


def as_plain(answer: Any) -> Any:
    """Give an answer as JSON has it: tables with keys of text, lists, text, numbers that are finite; null for others.

    An object gives its own tables (`to_json`), or else all of its fields.

    Examples
    --------
    >>> import numpy as np
    >>> as_plain({0: (np.float64(1.5), np.array([2.0, np.nan]))})
    {'0': [1.5, [2.0, None]]}
    """
    if hasattr(answer, "to_json"):
        return answer.to_json()
    if isinstance(answer, Mapping):
        return {str(key): as_plain(value) for key, value in answer.items()}
    if hasattr(answer, "tolist"):  # of numpy, which the commands' help does without
        return as_plain(answer.tolist())
    if is_dataclass(answer):
        return as_plain(picked(answer, *(field.name for field in fields(answer))))
    if isinstance(answer, Iterable) and not isinstance(answer, str):
        return [as_plain(value) for value in answer]
    return None if isinstance(answer, float) and not math.isfinite(answer) else answer


def as_table(**values: Any) -> dict[str, Any]:
    """Give a plain table of an answer's values by name, in this order."""
    return {name: as_plain(value) for name, value in values.items()}


def picked(answer: Any, *names: str) -> dict[str, Any]:
    """Give some fields of an answer by their names."""
    return {name: getattr(answer, name) for name in names}


def as_json(answer: Any) -> str:
    r"""Write an answer as JSON, as all of them are: indented, its numbers finite, with a line break at the end.

    Examples
    --------
    >>> as_json([])
    '[]\n'
    """
    return json.dumps(as_plain(answer), indent=2, allow_nan=False) + "\n"


@contextmanager
def replaced(folder: str | Path) -> Iterator[Path]:
    """Write files into a draft folder first; they go into place, one rename each, once all of them are written.

    The draft lies inside `folder`, which is made if it is not there: a rename never crosses to another disk.

    Parameters
    ----------
    folder : str or Path
        Where the files belong.

    Yields
    ------
    Path
        The draft folder; whatever files stand in it at the end are moved.

    Raises
    ------
    OSError
        The folder cannot be made or written, or one of the names is taken by something that is not a regular file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replaced(folder) as draft:
    ...         _ = (draft / "numbers.txt").write_text("1 2 3")
    ...     (Path(folder) / "numbers.txt").read_text()
    '1 2 3'
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    draft = place / f".draft-{os.urandom(4).hex()}"
    try:
        draft.mkdir(mode=0o700)  # in here: Ctrl-C may come just after it was made
        yield draft
        drafts = sorted(draft.iterdir())
        for file in drafts:
            target = place / file.name
            # a folder, a pipe, a device: not ours to rename over
            if target.exists() and not target.is_file():
                raise FileExistsError(errno.EEXIST, "not a regular file", str(target))
        for file in drafts:
            file.replace(place / file.name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


@contextmanager
def locked(place: str | Path) -> Iterator[None]:
    """Keep a file or folder for this process: another one that would write there is refused.

    A file `.NAME.lock` beside it holds process and host.  The lock is the operating system's, so that it ends with the
    process, however that ends.  Where a file system has no locks, and on Windows, where files that are open cannot be
    replaced, nothing is kept from writing.

    Raises
    ------
    LimitsetsError
        Another process writes there.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, locked(Path(folder) / "s.zarr"):
    ...     [path.name for path in Path(folder).iterdir()]
    ['.s.zarr.lock']
    """
    path = Path(place).absolute()
    lock = path.with_name(f".{path.name}.lock")
    file = _kept_open(lock, path)
    try:
        yield
    finally:
        if file is not None:
            lock.unlink(missing_ok=True)  # before it is closed: whoever waits for it finds that it is gone
            os.close(file)


def _kept_open(lock: Path, place: Path) -> int | None:
    """Open the file of a lock and lock it; None where there are no locks."""
    try:
        import fcntl
    except ImportError:
        return None
    while True:
        try:
            lock.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError:  # whoever writes beside it says so
            return None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.read(file, 200).decode(errors="replace") or "another process"
            os.close(file)
            raise LimitsetsError(
                str(place), f"written by {holder}", "a place that one process writes",
                "wait until that process ends, or name another place",
            ) from None  # fmt: skip
        except OSError:
            os.close(file)
            return None
        if lock.exists() and os.path.samestat(os.fstat(file), lock.stat()):
            os.truncate(file, 0)
            os.write(file, f"process {os.getpid()} on {platform.node()}".encode())
            return file
        os.close(file)  # whoever had it deleted it meanwhile


@cache
def code_digest() -> str:
    """Return a digest of the package's own code, but for the wing that only shows answers.

    Answers that are kept carry it: those of other code, of the same version even, are not taken for one's own.
    """
    package, digest = Path(__file__).parents[1], hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        path = file.relative_to(package)
        if path.parts[0] != _FACE:
            digest.update(path.as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()
