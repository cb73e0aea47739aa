"""`limitsets.recheck`: the lone checker of `recheck.py`, called from Python.

The checker needs python-flint, which only it needs, so nothing else imports it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.proofs.recheck import Report

__all__ = ["recheck"]


def recheck(
    path: str | Path, *, workers: int | None = 1, progress: Callable[[int, int], None] | None = None
) -> Report:
    """Check a certificate anew, in other arithmetic and by other code than those that made it.

    Parameters
    ----------
    path : str or Path
        What `Proof.save` wrote, or what a stranger sent: it is data, nothing in it is run.
    workers : int, optional
        Processes to share the work among, None for all processors.  More than one starts the calling script anew in
        each of them, so it needs ``if __name__ == "__main__":``.
    progress : callable, optional
        Called now and then with the number of cells done and of all.

    Returns
    -------
    Report
        Its `verdict` is "proved", "failed" or "bad file"; `reason` says what fails first; `statement`, `parameters` and
        `relied_on` say what was claimed, of which scenes, and what that rests on.

    Raises
    ------
    AnswerError
        python-flint is not installed.

    Examples
    --------
    >>> import tempfile, limitsets as ls
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = ls.certify("paper-designed").save(Path(folder) / "designed.proof.zip")
    ...     ls.recheck(file).verdict
    'proved'
    """
    if find_spec("flint") is None:
        raise AnswerError(
            "the arithmetic of the recheck",
            "not installed",
            "python-flint",
            "pip install 'limitsets[proofs]', or pip install python-flint",
        )
    from limitsets.proofs.recheck import recheck as check

    return check(path, workers, progress)
