"""`limitsets film`: throws of a filmed part, from the table that a tracker wrote."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import limitsets as ls
from limitsets.base import LimitsetsError, Table, proposed
from limitsets.face import report
from limitsets.face.cli.arguments import named, number
from limitsets.face.cli.commands import Answer, Run, Scene, Words, command
from limitsets.face.cli.output import saved


def _words(text: str, option: str, form: str) -> list[float | str]:
    """Split the text of an option at its commas; bare numbers are numbers."""
    words = [number(word) for word in text.split(",")]
    if len(words) != form.count(",") + 1 or "" in words:
        raise LimitsetsError("the value", text, form, "put commas between them", key=option)
    return words


def _pixel(text: str | None, option: str) -> tuple[float, float] | None:
    """Read two numbers of the table."""
    if text is None:
        return None
    x, y = _words(text, option, "X,Y")
    if isinstance(x, str) or isinstance(y, str):
        raise LimitsetsError(
            "the point", text, "X,Y, two numbers of the table", "leave units out", key=option
        )
    return x, y


@command()
def film(
    run: Run,
    scene: Scene,
    file: Path,
    *,
    origin: str | None = None,
    along: str | None = None,
    length: str | None = None,
    corner: Words = None,
    y_up: bool = False,
    mirrored: bool = False,
    marker: str | None = None,
    likelihood: float = 0.9,
    fps: float | None = None,
    period: float | None = None,
    centre: bool = False,
) -> Answer:
    """Find the throws of a filmed part in a tracker's table, for the fit.

    Parameters
    ----------
    file : TRACKS.csv
        What DeepLabCut writes, or a table with columns frame (or time [s]), id, x, y, and for a marker angle [deg].
        Points are P0, P1, ... (the part's vertices) and com (its centre of mass).
    origin : X,Y
        The joint, in the numbers of the table.
    along : X,Y
        A point of the arm's line, outward from the joint.
    length : LENGTH
        From origin to along, like '700 mm', where x and y are pixels.
    corner : PX,PY=X,Y
        A pixel and its place along the arm and above the joint, like 112,80='0 mm,250 mm'; four of them, instead of
        --length, where the camera looks at an angle.
    y_up
        y of the table points up, not down as in images.
    mirrored
        The arm goes to the left: the camera stands behind.
    marker : X,Y,ANGLE
        Where the marker is in the frame of the vertices, like '20 mm,10 mm,90 deg'; default: at the centre of
        mass, along side 0.
    likelihood : P
        Points below it count as not seen.
    fps : N
        Frames a second, for times in the answer.
    period : N
        Frames from one throw to the next, where the arm throws in a fixed time.
    centre
        Write places of the points com, not of left corners.
    out : FILE.csv
        Write the throws, as limitsets fit reads them, and a picture of the rests beside them, FILE.png.
    """
    from limitsets.parameters.fitting import throws_of_film

    pairs = named(corner, "--corner", "the corner", "PX,PY=X,Y", "like 112,80='0 mm,250 mm'")
    corners = [(_pixel(pixel, "--corner"), tuple(_words(at, "--corner", "X,Y"))) for pixel, at in pairs]
    answer = throws_of_film(
        scene,
        file,
        origin=_pixel(origin, "--origin"),
        along=_pixel(along, "--along"),
        length=None if length is None else number(length),
        corners=corners or None,  # type: ignore[arg-type]  # two words each, counted above
        y_up=y_up,
        mirrored=mirrored,
        marker=None if marker is None else tuple(_words(marker, "--marker", "X,Y,ANGLE")),  # type: ignore[arg-type]
        likelihood=likelihood,
        fps=fps,
        period=period,
        centre=centre,
    )
    picture = None if run.out is None else run.out.with_suffix(".png")
    if run.out is not None and picture is not None:
        with saved(run.out) as draft:
            answer.save(draft)
        with saved(picture) as draft:
            ls.plot.film_rests(answer).savefig(draft, dpi=report.writing.DPI)

    def words() -> Iterator[str | Table]:
        throws, about = answer.tables()
        yield throws
        yield about
        yield from answer.lines()
        if run.out is not None:
            yield f"throws: {run.out}"
            yield f"picture: {picture}"
        yield f"next: {'' if run.out else 'add -o throws.csv to this command, then '}" + proposed(
            "fit", scene, run.out or "throws.csv"
        )

    files = {"file_of_throws": run.out, "picture": picture}
    record = answer.to_json() | {word: None if file is None else str(file) for word, file in files.items()}
    return Answer(record, words, answer.table)
