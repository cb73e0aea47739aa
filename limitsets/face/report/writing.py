"""Write a report's files, all of them or none; an audit in words and its files."""

from __future__ import annotations

import base64
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from matplotlib.figure import Figure

from limitsets.base import AnswerError, LimitsetsError, Progress, as_json, replaced
from limitsets.face import plot
from limitsets.face.plot.style import stretch
from limitsets.face.report.pages import as_html, page, percent, words
from limitsets.parameters.analysis import Analysis, proved_averages
from limitsets.proofs.auditing import Audit, Finding
from limitsets.systems.maps import FLIP

DPI = 150

# Kinds of pictures that stand within report.html, by form; to others it links.
WITHIN = {"png": "image/png", "svg": "image/svg+xml"}

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
        For "flight": x and side of the throw to draw; chosen if left out.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    LimitsetsError
        For another kind.
    """
    scene, sets = analysis.scene, analysis.extents
    drawings: dict[str, Callable[[], Figure]] = {
        "part": lambda: plot.part(scene),
        "limit-set": lambda: plot.limit_set(scene, sets),
        "map": lambda: plot.map(scene, sets),
        "basins": lambda: plot.basins(scene, analysis.basins, sets),
        "morse": lambda: plot.morse(analysis.morse, scene.name, scene.unit),
        "flight": lambda: plot.flight(scene, *(throw or _typical_throw(analysis))),
    }
    if kind not in drawings:
        raise LimitsetsError("the kind of figure", kind, ", ".join(drawings), "correct the word")
    return drawings[kind]()


def require_place(folder: str | Path) -> None:
    """Refuse a folder that clearly cannot be written, before the computation begins.

    Raises
    ------
    LimitsetsError
        The folder, or its nearest existing parent, is no folder or is not writable.
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
        From the figures' files by kind to texts by file.
    form : str
        Of the figures: "png", "svg" or "pdf".
    html : bool
        Whether to write report.html too: report.md in one file that stands alone, the figures' files inside.

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
    inside: dict[str, str] = {}  # the files once more: drawn anew as SVG they took half a second
    with filled(folder) as draft:
        for kind, figure in drawn:
            figures[kind] = f"{kind}.{form}"
            figure.savefig(draft / figures[kind], dpi=DPI)
            if html and form in WITHIN:
                image = base64.b64encode((draft / figures[kind]).read_bytes()).decode("ascii")
                inside[figures[kind]] = f"data:{WITHIN[form]};base64,{image}"
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
    html: bool = True,
    progress: Progress | None = None,
) -> list[Path]:
    """Write report.md, report.html, analysis.json and the figures into a folder.

    Existing files are replaced after all new ones are written, each in one step.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.
    folder : str or Path
        Where to; made if it is not there.
    form : str
        Of the figures: "png", "svg" or "pdf".
    html : bool
        Whether to write report.html: one file that stands alone, figures inside (PDF: links to them).
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
    >>> from limitsets.face.report.writing import write
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

    def texts(figures: dict[str, str]) -> dict[str, str]:
        tell("report.md", len(FIGURES), count)
        averages = proved_averages(analysis.scene, analysis.extents)
        return {"report.md": page(analysis, figures, averages), "analysis.json": as_json(analysis)}

    return laid(folder, drawn(), texts, form, html=html)


# ----------------------------------------------------------------
# An audit as text: the lines of its table, its page, and its files.


HEADS = ("effect", "assumed", "on the limit set", "worst there", "on the whole arm")


def _measured(finding: Finding, value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    if finding.about.dimension == "angle":
        return f"{math.degrees(value):.1f} deg"
    return f"{value:.3g} {unit}" if finding.about.dimension == "length" else f"{value:.3g}"


def _share(finding: Finding) -> str:
    """Say which of the throws on the limit set are concerned."""
    kinds = (("jog", *finding.jogs), ("flip", *finding.flips), ("roll", *finding.others))
    return " and ".join(
        f"every {name}" if hit == of else f"{percent(hit / of)} of {name}s" for name, hit, of in kinds if hit
    )


def _verdict(finding: Finding) -> str:
    if finding.called_for is None:
        return f"cannot tell: {finding.missing}?" if finding.missing else "cannot tell: no throw known"
    if not finding.called_for:
        return f"holds ({finding.how})"
    if finding.place == "limit-set":
        return f"BREAKS: {_share(finding)}"
    return f"breaks on side {', '.join(map(str, finding.ranges))}"


def _worst(finding: Finding, unit: str) -> str:
    """Give the worst measured value; if a fact is missing, the value of the fact from which it would matter."""
    if finding.x is None:
        return "-"
    place = f"side {finding.side}, x = {finding.x:.2f}"
    if finding.worst is None:
        return f"no friction is enough ({place})"
    if finding.missing:
        return f"{_needed(finding, unit)} ({place})"
    value = _measured(finding, finding.worst, unit)
    if finding.threshold is None:
        return f"{value} ({place})"
    sign = "at most" if finding.about.below else "at least"
    return f"{value}, {sign} {_measured(finding, finding.threshold, unit)} ({place})"


def _needed(finding: Finding, unit: str) -> str:
    at = finding.threshold
    if finding.missing == "friction":
        return f"needs {finding.worst:.3g}"
    if at is None:
        fall = finding.missing == "restitution"
        return f"falls from {_measured(finding, finding.worst, unit)}" if fall else "never matters"
    sizes = {"stroke": f"{math.degrees(at):.2g} deg", "scatter": f"{100 * at:.2g} % of the speed"}
    way = "below" if finding.missing == "bounce_threshold" else "from"
    return f"matters {way} {sizes.get(finding.missing, f'{at:.2g}')}"


def lines_of(audit: Audit) -> list[list[str]]:
    """Give the table, one line per assumption; columns as in `HEADS`."""
    unit = audit.scene.unit
    return [
        [
            f"{here.effect} (on)" if here.simulated else here.effect,
            here.about.name,
            _verdict(here),
            _worst(here, unit),
            _verdict(everywhere),
        ]
        for here, everywhere in zip(audit.on("limit-set"), audit.on("domain"), strict=True)
    ]


def summary(audit: Audit) -> list[str]:
    """Say in a few sentences which effects the scene calls for."""
    return words("audit_summary", audit=audit).split("\n\n")


def audit_page(audit: Audit, figures: Mapping[str, str] | None = None) -> str:
    """Write the page.

    Parameters
    ----------
    audit : Audit
        From `limitsets.audit`.
    figures : mapping of str to str, optional
        File names of the pictures by kind: "part", "audit".

    Returns
    -------
    str
        Markdown.

    Examples
    --------
    >>> import limitsets as ls
    >>> audit_page(ls.audit("paper-designed")).splitlines()[0]
    '# paper-designed: what the model leaves out'
    """
    rows = lines_of(audit)
    return words("audit", figures, audit=audit, summary=summary(audit), heads=HEADS, rows=rows) + "\n"


def write_audit(audit: Audit, folder: str | Path, form: str = "png") -> list[Path]:
    """Write audit.md, audit.json and the figures into a folder, all of them or none.

    Raises
    ------
    LimitsetsError
        The folder cannot be written.
    """
    return laid(
        folder,
        [("part", plot.part(audit.scene)), ("audit", plot.audit(audit))],
        lambda figures: {"audit.md": audit_page(audit, figures), "audit.json": as_json(audit)},
        form,
    )
