"""Throws of a filmed part, from the table of a tracker to the file that `limitsets.fit` takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import Column, DataError, Table, Tabled, arguments_checked, as_table, facts, picked
from limitsets.base.arrays import Ints
from limitsets.feeder.scene import Scene, load
from limitsets.feeder.scene.units import convert, parse
from limitsets.parameters.fitting.poses import Poses, poses_of
from limitsets.parameters.fitting.rests import JUMP, Rest, Rests, rests_of
from limitsets.parameters.fitting.throws import CORNERS, LEAST_ROWS, PLACES, SIDES
from limitsets.parameters.fitting.tracks import CENTRE, Pair, Place, Tracks, pair_of, read_tracks, view_of

# A scale this near to the scene's moves no place by more than a good reading's error.
_SCALE_FITS = 0.002


@dataclass(frozen=True, eq=False)
class FilmedThrows(Tabled):
    """Throws of a film.

    Attributes
    ----------
    scene : Scene
        The part that was filmed.
    tracks : Tracks
        The table, as it was read.
    poses : Poses
        Where the part is in each frame; with `scale`, its size in the film over that in the scene.
    seen : Rests
        All rests, in order of time; those with a reason in `wrong` are in no throw.
    throws : tuple of (Rest, Rest, str)
        Before, after, and the run: throws of one run that follow each other are consecutive.
    centre : bool
        Whether places are those of the mark at the centre of mass, not of left corners.
    left_out : dict of str to tuple of (int, int)
        First and last frames of what is not used, by the reason.
    fps : float or None
        Frames a second.
    """

    scene: Scene
    tracks: Tracks
    poses: Poses
    seen: Rests
    throws: tuple[tuple[Rest, Rest, str], ...]
    centre: bool
    left_out: dict[str, tuple[tuple[int, int], ...]]
    fps: float | None

    @property
    def frames(self) -> int:
        """Number of frames, from the first to the last."""
        return int(self.tracks.frames[-1] - self.tracks.frames[0]) + 1

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it: the throws, as `limitsets.fit` reads them, and what is known of the film."""
        unit, (before, after) = self.scene.unit, PLACES if self.centre else CORNERS
        lengths = {head: Column(head, unit, ".5g") for head in (before, after)}
        heads = (lengths[before], SIDES[0], lengths[after], SIDES[1], Column("error", unit, ".2g"), "run")
        rows = [
            # a row has one error: the root mean square of both
            (one.x, one.side, two.x, two.side, math.hypot(one.error, two.error) / math.sqrt(2.0), run)
            for one, two, run in self.throws
        ]
        values: dict[str, Any] = {
            "frames": self.frames,
            "rests": len(self.seen.rests),
            "throws": len(self.throws),
            "runs": len({run for *_, run in self.throws}),
            f"noise of a point from frame to frame [{unit}]": self.seen.noise,
            "size of the part in the film, in the scene 1": self.poses.scale,
            f"a throw takes [{'s' if self.fps else 'frames'}]": self.seen.flight / (self.fps or 1.0),
        }
        name = f"{self.scene.name}: throws of {self.tracks.file}"
        return Table(heads, rows, name, "measured"), facts("The film", values)

    def save(self, file: str | Path) -> Path:
        """Write the throws as the CSV file that `limitsets.fit` reads."""
        return self.to_csv(file)

    def lines(self) -> list[str]:
        """Say what was left out, and what to look at."""
        said = [f"left out, {reason}: frames {_ranges(spans)}" for reason, spans in self.left_out.items()]
        if abs(self.poses.scale - 1.0) > max(_SCALE_FITS, 3.0 * self.poses.scale_error):
            said.append(
                f"careful: the part is {self.poses.scale:.4f} times as large in the film as in the scene; if its sides"
                " are right, places are off by as much: correct the length"
            )
        if self.tracks.unread:
            said.append(f"not read: {', '.join(self.tracks.unread)}")
        if len(self.throws) < LEAST_ROWS:
            said.append(
                f"a fit takes {LEAST_ROWS} throws or more: film on, or put the rows of several films into one file"
            )
        return said

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON; every number is finite or null."""
        places = {id(each): k for k, each in enumerate(self.seen.rests)}
        return as_table(
            scene=self.scene.as_dict(),
            unit=self.scene.unit,
            file=self.tracks.file,
            frames=self.frames,
            corner=not self.centre,
            rests=[
                picked(each, "side", "x", "error", "tilt", "above")
                | {"frames": each.frames[[0, -1]], "count": len(each.frames), "wrong": each.wrong or None}
                for each in self.seen.rests
            ],
            throws=[
                {"before": places[id(one)], "after": places[id(two)], "run": run}
                for one, two, run in self.throws
            ],
            left_out=self.left_out,
            **picked(self.seen, "noise", "flight"),
            **picked(self.poses, "scale", "scale_error"),
            fps=self.fps,
            unread=self.tracks.unread,
        )


@arguments_checked
def throws_of_film(
    scene: Scene | str | Path,
    file: str | Path,
    *,
    origin: Pair | None = None,
    along: Pair | None = None,
    length: float | str | None = None,
    corners: Sequence[tuple[Pair, Place]] | None = None,
    y_up: bool = False,
    mirrored: bool = False,
    marker: tuple[float | str, float | str, float | str] | None = None,
    likelihood: float = 0.9,
    fps: float | None = None,
    period: float | None = None,
    centre: bool = False,
) -> FilmedThrows:
    r"""Find the throws of a filmed part in the table that a tracker wrote.

    Parameters
    ----------
    scene : Scene, str or Path
        The machine as far as it is known: the part's sides, the height of the arm's surface.
    file : str or Path
        What DeepLabCut writes, or a table with columns frame, id, x, y, and for a marker angle.  Points are the
        vertices of the part, P0, P1, ..., and com, a mark at its centre of mass.
    origin, along : (float, float), optional
        The joint, and a point of the arm's line outward from it, in the numbers of the table.  In a table with a unit
        of length they are (0, 0) and a point in the direction of x by default.
    length : str or float, optional
        From `origin` to `along`, "700 mm" or in the scene's unit, where x and y are pixels.
    corners : sequence of ((float, float), (str or float, str or float)), optional
        Four pixels and their places in the plane of the motion, x along the arm from the joint and y up, for a camera
        that looks at an angle; instead of `length`.
    y_up : bool
        Whether y of the table points up, not down as in images.
    mirrored : bool
        Whether the arm goes to the left: the camera stands behind the plane that the scene describes.
    marker : (length, length, angle), optional
        Where the marker is in the frame of the part's vertices, and how its axis is turned there ("90 deg", or rad);
        by default at the scene's centre of mass, along side 0.
    likelihood : float
        Points below it count as not seen.
    fps : float, optional
        Frames a second, for times in the answer alone.
    period : float, optional
        Frames from one throw to the next, where the arm throws in a fixed time: it says which rests follow each other
        by one throw.
    centre : bool
        Whether places are those of the points com; by default they are left corners, and the fit finds the centre of
        mass.

    Returns
    -------
    FilmedThrows

    Raises
    ------
    DataError
        A table that cannot be read, a scale that is missing or wrong, another part, fewer than two rests.

    Examples
    --------
    >>> import tempfile
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> text = "frame,id,x [in],y [in]\n"
    >>> for frame in range(40):  # on side 0, from 8 in to 9 in
    ...     x = 8.0 if frame < 20 else 9.0
    ...     text += f"{frame},P0,{x},-0.2\n{frame},P1,{x + 5.75},-0.2\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "tracks.csv"
    ...     _ = path.write_text(text)
    ...     film = throws_of_film(scene, path, y_up=True)
    >>> [(one.side, one.x, two.x) for one, two, _ in film.throws]
    [(0, 8.0, 9.0)]
    """
    chosen, tracks = load(scene), read_tracks(file, likelihood=likelihood)
    name = tracks.file
    refused = (
        ("fps", fps, fps is None or 0.0 < fps < math.inf, "a number above 0"),
        ("period", period, period is None or 0.0 < period < math.inf, "a number above 0"),
        ("the likelihood", likelihood, 0.0 <= likelihood <= 1.0, "from 0 to 1"),
        ("marker", "given", marker is None or tracks.angle is not None, "beside a table with angles"),
        ("centre", "asked for", not centre or CENTRE in tracks.names, f"beside a table with points {CENTRE}"),
    )
    for thing, value, fine, allowed in refused:
        if not fine:
            raise DataError(thing, value, allowed, "correct it, or leave it out", file=name)
    view = view_of(
        tracks,
        chosen,
        origin=origin,
        along=along,
        length=length,
        corners=corners,
        y_up=y_up,
        mirrored=mirrored,
    )
    side = complex(*(chosen.vertices[1] - chosen.vertices[0]))
    spot, turned = complex(*chosen.centre), math.atan2(side.imag, side.real)
    if marker is not None:
        x, y, angle = marker
        spot = pair_of((x, y), chosen)
        turned = convert(parse(angle, "angle"), "rad") if isinstance(angle, str) else float(angle)
    poses = poses_of(tracks, chosen, view, (spot, turned))
    seen = rests_of(poses, chosen, period=period, centre=centre, file=name)
    throws, run = [], 1
    for (one, two), thrown in zip(pairwise(seen.rests), seen.thrown, strict=True):
        if thrown and not one.wrong and not two.wrong:
            throws.append((one, two, f"{Path(name).stem} {run}"))
        else:
            run += 1
    wrong = [each for each in seen.rests if each.wrong]
    if not throws:
        others = f" (others: {', '.join(sorted({each.wrong for each in wrong}))})" if wrong else ""
        given = f"{len(seen.rests) - len(wrong)} of use{others}"
        raise DataError("the rests of the film", given, "two, one throw apart", "film a throw", file=name)
    spans = {reason: _spans(frames) for reason, frames in {**poses.left_out, JUMP: seen.jumps}.items()}
    for each in wrong:
        spans[each.wrong] = (*spans.get(each.wrong, ()), (int(each.frames[0]), int(each.frames[-1])))
    left_out = {reason: ranges for reason, ranges in spans.items() if ranges}
    return FilmedThrows(chosen, tracks, poses, seen, tuple(throws), centre=centre, left_out=left_out, fps=fps)


def _spans(frames: Ints) -> tuple[tuple[int, int], ...]:
    """Put successive frames together: first and last."""
    parts = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return tuple((int(part[0]), int(part[-1])) for part in parts if len(part))


def _ranges(spans: Sequence[tuple[int, int]]) -> str:
    """Write ranges of frames; of many the first ones."""
    words = [str(one) if one == last else f"{one} to {last}" for one, last in spans[:_SHOWN]]
    count = sum(last - one + 1 for one, last in spans)
    more = f" and {len(spans) - _SHOWN} ranges more" if len(spans) > _SHOWN else ""
    return f"{', '.join(words)}{more}, {count} in all"


# Ranges of frames that a line names.
_SHOWN = 6
