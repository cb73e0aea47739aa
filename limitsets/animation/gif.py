"""A film as an animated GIF, by Pillow: one small palette for all frames, so that what stands still costs nothing."""

from __future__ import annotations

from pathlib import Path

from limitsets.animation.film import Film
from limitsets.animation.picture import Picture
from limitsets.animation.raster import Progress, frames

__all__ = ["FPS", "write_gif"]

FPS = 20.0
"""Delays are whole hundredths of a second."""

ZOOM, COLOURS = 0.9, 48


def write_gif(film: Film, file: Path, progress: Progress = None) -> None:
    """Write a film; it begins again when it is over."""
    from PIL import Image

    pictures, palette = [], None
    for pixels in frames(Picture.of(film), ZOOM, progress):
        image = Image.fromarray(pixels)
        if palette is None:
            palette = image.quantize(COLOURS, dither=Image.Dither.NONE)
        pictures.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
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
