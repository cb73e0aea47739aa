"""Files that are replaced whole: a crash or Ctrl-C leaves the old ones as they were.  And the one form of our JSON."""

from __future__ import annotations

import errno
import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

__all__ = ["as_json", "replaced"]


def as_json(record: Any) -> str:
    r"""Write an answer as JSON, as all of them are: indented, its numbers finite, with a line break at the end.

    Examples
    --------
    >>> as_json([])
    '[]\n'
    """
    return json.dumps(record, indent=2, allow_nan=False) + "\n"


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
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replaced(folder) as draft:
    ...         _ = (draft / "numbers.txt").write_text("1 2 3")
    ...     (Path(folder) / "numbers.txt").read_text()
    '1 2 3'
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=".draft-", dir=place))
    try:
        yield draft
        drafts = sorted(draft.iterdir())
        for file in drafts:
            target = place / file.name
            if (
                target.exists() and not target.is_file()
            ):  # a folder, a pipe, a device: not ours to rename over
                raise FileExistsError(errno.EEXIST, "not a regular file", str(target))
        for file in drafts:
            file.replace(place / file.name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
