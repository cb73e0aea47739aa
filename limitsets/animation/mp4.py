"""A film as MP4 (H.264), by imageio-ffmpeg, an optional dependency that brings its own ffmpeg."""

from __future__ import annotations

from pathlib import Path

from limitsets.animation.film import Film
from limitsets.animation.picture import Picture
from limitsets.animation.raster import Progress, frames
from limitsets.errors import AnswerError

try:
    import imageio_ffmpeg
except ImportError as error:
    remedy = "pip install 'limitsets[animate]', or write .html or .gif"
    raise AnswerError("the writer of .mp4", "not installed", "imageio-ffmpeg", remedy) from error

ZOOM = 1.5


def write_mp4(film: Film, file: Path, progress: Progress = None) -> None:
    """Write a film."""
    stream = None
    try:
        for pixels in frames(Picture.of(film), ZOOM, progress):
            if stream is None:
                tall, wide = pixels.shape[:2]
                stream = imageio_ffmpeg.write_frames(
                    str(file),
                    (wide, tall),
                    fps=film.fps,
                    codec="libx264",
                    macro_block_size=2,
                    output_params=["-crf", "20", "-preset", "medium", "-movflags", "+faststart"],
                )
                stream.send(None)
            stream.send(pixels.tobytes())
    finally:
        if stream is not None:
            stream.close()
