"""Write the report's files, all of them or none."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from limitsets.errors import AnswerError, LimitsetsError
from limitsets.files import as_json, replaced
from limitsets.maps import FLIP
from limitsets.plot.basin import basins
from limitsets.plot.flights import flight
from limitsets.plot.limit_sets import limit_set
from limitsets.plot.maps import map as map_of_scene
from limitsets.plot.morse_graphs import morse
from limitsets.plot.parts import part
from limitsets.plot.style import stretch
from limitsets.report.html_pages import as_html, as_uri
from limitsets.report.pages import page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.analysis import Analysis

Progress = Callable[[str, int, int], None]

DPI = 150
FIGURES = ("part", "limit-set", "map", "basins", "morse", "flight")


def _typical_throw(analysis: Analysis) -> tuple[float, int]:
    """Choose a throw to draw: the first flip of an orbit on the limit set, or one from the middle of the arm."""
    scene = analysis.scene
    for extents in analysis.extents[:1]:
        path = stretch(scene, extents)
        if path is not None and path.code.size:
            k = int((path.code == FLIP).argmax())
            return float(path.x[k]), int(path.side[k])
    return 0.5 * (float(scene.sides.a[0]) + scene.arm_length), 0


def figure(analysis: Analysis, kind: str, throw: tuple[float, int] | None = None) -> Figure:
    """Draw one figure of an analysis.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.
    kind : str
        One of `FIGURES`.
    throw : (float, int), optional
        For "flight": x and side of the throw to draw; one is chosen otherwise.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    LimitsetsError
        For another kind.
    """
    scene, sets = analysis.scene, analysis.extents
    if kind == "part":
        return part(scene)
    if kind == "limit-set":
        return limit_set(scene, sets)
    if kind == "map":
        return map_of_scene(scene, sets)
    if kind == "basins":
        return basins(scene, analysis.basins, sets)
    if kind == "morse":
        return morse(analysis.morse, scene.name, scene.unit)
    if kind == "flight":
        return flight(scene, *(throw or _typical_throw(analysis)))
    raise LimitsetsError("the kind of figure", kind, ", ".join(FIGURES), "correct the word")


def require_place(folder: str | Path) -> None:
    """Refuse a folder that plainly cannot be written, before anything is computed for it.

    Raises
    ------
    LimitsetsError
        It, or the nearest of its parents that is there, is no folder or may not be written.
    """
    nearest = next(path for path in (Path(folder), *Path(folder).absolute().parents) if path.exists())
    if not nearest.is_dir():
        raise _refusal(folder, f"{nearest} is not a folder")
    if not os.access(nearest, os.W_OK):
        raise _refusal(folder, f"{nearest} may not be written")


def _refusal(folder: str | Path, reason: str) -> LimitsetsError:
    return LimitsetsError("the folder of the report", str(folder), "a folder that can be written", reason)


@contextmanager
def filled(folder: str | Path) -> Iterator[Path]:
    """Write files of a report as `limitsets.files.replaced` does: all of them or none.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    try:
        with replaced(folder) as draft:
            yield draft
    except OSError as error:
        raise _refusal(folder, f"it could not be: {error.strerror or error}") from None


def laid(
    folder: str | Path,
    drawn: Iterable[tuple[str, Figure]],
    texts: Callable[[dict[str, str]], dict[str, str]],
    form: str = "png",
    *,
    html: bool = False,
) -> list[Path]:
    """Write figures and texts into a folder, all of them or none.

    Parameters
    ----------
    folder : str or Path
        Where to; made if it is not there.
    drawn : iterable of (str, Figure)
        Figures by kind: KIND.png, or of the form asked for.
    texts : callable
        Takes the figures' files by kind, gives texts by file.
    form : str
        Of the figures: "png", "svg" or "pdf".
    html : bool
        Whether to write report.html too: report.md in one file that stands alone, figures inside.

    Returns
    -------
    list of Path
        The files, texts first.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    figures: dict[str, str] = {}
    inside: dict[str, str] = {}
    with filled(folder) as draft:
        for kind, figure in drawn:
            figures[kind] = f"{kind}.{form}"
            figure.savefig(draft / figures[kind], dpi=DPI)
            if html:
                inside[figures[kind]] = as_uri(figure)
        told = texts(figures)
        if html:
            told["report.html"] = as_html(told["report.md"], inside)
        for name, text in told.items():
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
    return [Path(folder) / name for name in (*told, *figures.values())]


def write(
    analysis: Analysis,
    folder: str | Path,
    *,
    form: str = "png",
    html: bool = False,
    progress: Progress | None = None,
) -> list[Path]:
    """Write report.md, analysis.json and the figures into a folder.

    Files that are there are replaced once all new ones are written, each in one step.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.
    folder : str or Path
        Where to; made if it is not there.
    form : str
        Of the figures: "png", "svg" or "pdf".
    html : bool
        Whether to write report.html too: one file that stands alone, figures inside.
    progress : callable, optional
        Called as ``progress(file, done, of)`` before each file.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.

    Examples
    --------
    >>> import tempfile, limitsets as ls
    >>> from limitsets.report.writing import write
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in write(ls.analyse("paper-designed"), folder)][:2]
    ['report.md', 'analysis.json']
    """
    tell = progress or (lambda file, done, of: None)
    count = len(FIGURES) + 2

    def drawn() -> Iterator[tuple[str, Figure]]:
        for number, kind in enumerate(FIGURES):
            tell(f"{kind}.{form}", number, count)
            try:
                shown = figure(analysis, kind)
            except AnswerError:
                if kind != "flight":
                    raise
                continue  # throws too hard for the model have no flight to draw
            yield kind, shown
        tell("report.md", len(FIGURES), count)

    def texts(figures: dict[str, str]) -> dict[str, str]:
        return {"report.md": page(analysis, figures), "analysis.json": as_json(analysis)}

    return laid(folder, drawn(), texts, form, html=html)
