"""`limitsets.recheck`: the checker, called from Python; every writer of certificates calls it too.

The checker alone needs python-flint, so it is imported where it is called.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.progress import bar, in_notebook

if TYPE_CHECKING:
    from limitsets.checker import Report


class DeniedError(AnswerError):
    """The checker does not confirm a certificate that was just written.

    Attributes
    ----------
    file : str
        Where it is kept, NAME.denied.zip.
    claims : dict of str to str
        The claims that are not confirmed, and why.
    """

    claims: dict[str, str]

    @classmethod
    def of(cls, file: Path, claims: dict[str, str]) -> DeniedError:
        """Name the first claim that is not confirmed."""
        name, why = next(iter(claims.items()))
        remedy = "report it; the claim is undecided"
        error = cls(
            f"the certificate's claim {name}",
            f"denied: {why}",
            "what the checker confirms",
            remedy,
            file=str(file),
        )
        error.claims = claims
        return error


def require_confirmed(file: Path, kept: Path, verdicts: Mapping[str, str], workers: int | None = 1) -> float:
    """Recheck a certificate before it gets its name; the seconds that it took.

    Parameters
    ----------
    file : Path
        The draft.
    kept : Path
        Where its writer keeps it if it is denied.
    verdicts : mapping of str to str
        What has to become of each claim: "proved", "proved-on-cells" or "refuted".
    workers : int, optional
        As in `recheck`.

    Raises
    ------
    DeniedError
        The checker comes to another verdict.
    """
    report = recheck(file, workers=workers)
    states = {claim: (state, why) for claim, state, why in report.claims}
    denied = {
        claim: why or f"it is {state}, not {verdicts[claim]}"
        for claim, (state, why) in states.items()
        if state != verdicts[claim]
    }
    if report.verdict == "bad file":
        denied = dict.fromkeys(verdicts, report.reason)
    if denied:
        raise DeniedError.of(kept, denied)
    return report.seconds


@arguments_checked
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
        Its `verdict` is "proved", "proved-on-cells" (a goal, of the starts in some cells only), "refuted" (an orbit
        that violates the goal is confirmed), "failed" or "bad file"; `reason` says what fails first; `statement`,
        `parameters` and `relied_on` say what was claimed, of which scenes, and what that rests on; `starts` and
        `share`, for which starts the goal is proved and what share of the arm they are.

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
            "pip install python-flint",
        )
    from limitsets.checker import recheck as check

    if progress is None and in_notebook():
        with bar() as tell:
            return check(path, workers, lambda done, of: tell("cells checked", done - 1, of))
    return check(path, workers, progress)
