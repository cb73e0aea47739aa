"""A film as an animated GIF, by Pillow: one small palette for all frames, so that what stands still costs nothing."""

from __future__ import annotations

from pathlib import Path

from limitsets.animation.film import Film
from limitsets.animation.picture import Picture
from limitsets.animation.raster import Progress, frames

FPS = 20.0
"""Delays are whole hundredths of a second."""

ZOOM = 0.9
# Shades between a colour and white, for soft edges; and frames that are asked for their colours.
SHADES, ASKED = (0.0, 0.35, 0.7), 25


def write_gif(film: Film, file: Path, progress: Progress = None) -> None:
    """Write a film; it begins again when it is over."""
    from PIL import Image

    picture = Picture.of(film)
    palette = Image.new("P", (1, 1))
    palette.putpalette(_colours(picture))
    pictures = [
        Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE)
        for pixels in frames(picture, ZOOM, progress)
    ]
    delay = 10 * round(100.0 / film.fps)
    pictures[0].save(
        file,
        "GIF",
        save_all=True,
        append_images=pictures[1:],
        duration=delay,
        loop=0,
        optimize=False,
        disposal=1,
    )


def _colours(picture: Picture) -> bytes:
    """Give white, and all that is drawn with, in some shades: a palette chosen by areas loses small signs."""
    asked = range(0, picture.film.frames, max(1, picture.film.frames // ASKED))
    shapes = [*picture.still(), *(shape for k in asked for shape in picture.moving(k))]
    words = (shape.look.get(name) for shape in shapes for name in ("fill", "stroke"))
    drawn = dict.fromkeys(bytes.fromhex(word.removeprefix("#")) for word in words if word)
    shades = {
        bytes(round(each + (255 - each) * light) for each in colour) for light in SHADES for colour in drawn
    }
    return b"\xff\xff\xff" + b"".join(sorted(shades - {b"\xff\xff\xff"})[:255])
