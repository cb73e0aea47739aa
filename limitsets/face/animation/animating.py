"""`limitsets.animate`: from a scene or an answer to a film, and to a file."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from limitsets.base import AnswerError, Progress, arguments_checked, replaced, shown_in_notebooks
from limitsets.face.animation.film import Asked, Film
from limitsets.feeder.scene import load

KINDS = {
    "Scene": "thrown_scenes:film_of_scene",
    "Analysis": "thrown_scenes:film_of_analysis",
    "ArmEnd": "fed:film_of_end",
    "Feeding": "fed:film_of_feeding",
    "Synthesis": "thrown_scenes:film_of_policy",
    "Margin": "thrown_scenes:film_of_margin",
    "Recording": "fed:film_of_recording",
    "Assembly": "fed:film_of_assembly",
    "TrayFill": "fed:film_of_tray",
}
"""The function that makes a film of an object, by the name of the object's class."""

SUFFIXES = {".gif": "writers:write_gif", ".html": "writers:write_page"}
"""The function that writes a film, by the ending of the file's name."""


def _found(where: str) -> Any:
    file, name = where.split(":")
    return getattr(import_module(f"limitsets.face.animation.{file}"), name)


def require_file(path: Path) -> Any:
    """Return the function that writes a file with this ending.

    Raises
    ------
    AnswerError
        No film has a name like this.
    """
    writer = SUFFIXES.get(path.suffix.lower())
    if writer is None:
        allowed = f"a name that ends in {', '.join(SUFFIXES)}"
        remedy = "rename it, or convert a GIF: ffmpeg -i film.gif -pix_fmt yuv420p film.mp4"
        raise AnswerError("the film's file", str(path), allowed, remedy)
    return _found(writer)


def film_of(
    shown: Any,
    *,
    start: tuple[float, int] | None = None,
    throws: int | None = None,
    fps: float = 20.0,
    slow: float = 3.0,
    progress: Progress | None = None,
) -> Film:
    """Make a film as data; arguments as in `animate`.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.animation import film_of
    >>> film_of(ls.load("paper-designed"), start=(21.0, 2), throws=1).rests[0].sentence
    'Throw 1 of 1: flip from 21.00 in, side 2, to 16.55, side 0'
    """
    if isinstance(shown, str | Path):
        shown = load(shown)
    if throws is not None and not (isinstance(throws, int) and throws >= 1):
        raise AnswerError("the throws", throws, "a whole number from 1", "show one at least")
    where = next((KINDS[each.__name__] for each in type(shown).__mro__ if each.__name__ in KINDS), None)
    if where is None:
        allowed = "a scene, or what analyse, feed, feedback, margin, assemble, tray or a recording gives"
        raise AnswerError("what to animate", type(shown).__name__, allowed, "pass one of these")
    made: Film = _found(where)(shown, Asked(start, throws, fps, slow, progress))
    return made


@shown_in_notebooks
@arguments_checked
def animate(
    scene: Any,
    file: str | Path,
    *,
    start: tuple[float, int] | None = None,
    throws: int | None = None,
    fps: float = 20.0,
    slow: float = 3.0,
    progress: Progress | None = None,
) -> Path:
    """Write a film: the arm that swings up and stops, the part in flight and landing, and its place on the limit set.

    Parameters
    ----------
    scene : Scene, str, Path, Analysis, ArmEnd, Feeding, Synthesis, Margin, Assembly, TrayFill or Recording
        What to show: throws of a scene, or of an analysis of it; a part that is fed, from `limitsets.feed` or of
        `limitsets.feeding.arm_end_of`; what a policy of `limitsets.feedback` does; the orbit that refutes a goal, from
        `limitsets.margin`; a pair of `limitsets.assemble` in contact; a depression of `limitsets.tray`; a recording of
        the rigid-body engine.
    file : str or Path
        Where to: .html (a page that stands alone) or .gif.
    start : (float, int), optional
        x [length] and side of the start; default a good one, on the limit set.
    throws : int, optional
        Number of throws at most; default 8, for feeding, feedback and recordings all of them.
    fps : float
        Frames per second.
    slow : float
        How many times slower than the machine.  Where the scene gives no gravity 1/w counts as 0.4 s.
    progress : callable, optional
        Called with (stage, done, all).

    Returns
    -------
    Path
        The file.

    Raises
    ------
    AnswerError
        Another kind of file or answer, a start from which no throw lands, or too many frames.

    Examples
    --------
    >>> import tempfile
    >>> import limitsets as ls
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = ls.animate("paper-designed", folder + "/run.html", start=(15.0, 2), throws=2)
    ...     written.stat().st_size < 200_000
    True
    """
    path = Path(file)
    write = require_file(path)  # before anything is computed
    made = film_of(scene, start=start, throws=throws, fps=fps, slow=slow, progress=progress)
    try:
        with replaced(path.parent) as draft:
            write(made, draft / path.name, progress)
    except OSError as error:
        remedy = f"it could not be: {error.strerror or error}"
        raise AnswerError("the film's file", str(file), "a place that can be written", remedy) from None
    return path
