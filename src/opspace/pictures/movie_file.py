"""Pictures as a file that moves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from itertools import chain
from pathlib import Path

import numpy as np

from opspace.errors import missing_extra

try:
    from PIL import Image
except ImportError:
    raise missing_extra("pillow", "sim") from None

COLORS = 96
"""Colours of the palette of a GIF; more make a larger file and no better picture."""

_QUALITY = "20"
"""H.264's constant rate factor, where 18 cannot be told from the original and 23 is usual."""


def write_gif(frames: Iterator[Image.Image], path: Path, fps: float) -> None:
    """Write an animated GIF that starts again at its end.

    Args:
        frames: The pictures, all of one size; at least one.
        path: File to write.
        fps: Pictures per second.
    """
    pictures = list(frames)
    # One palette for all pictures, or colours flicker; from several, or some are missing.
    chosen = pictures[:: max(1, len(pictures) // 8)]
    together = Image.fromarray(np.concatenate([np.asarray(picture) for picture in chosen]))
    palette = together.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE)
    drawn = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    drawn[0].save(
        path, save_all=True, append_images=drawn[1:], duration=round(1000.0 / fps), loop=0
    )


def write_mp4(frames: Iterator[Image.Image], path: Path, fps: float) -> None:
    """Write H.264 in the form that browsers play; odd sides get a row or column of white.

    Args:
        frames: The pictures, all of one size; at least one.
        path: File to write.
        fps: Pictures per second.

    Raises:
        MissingExtraError: imageio-ffmpeg is not installed.
        OSError: The file cannot be written.
    """
    try:
        import imageio_ffmpeg  # noqa: PLC0415 - optional
    except ImportError:
        raise missing_extra("imageio-ffmpeg", "export") from None
    first = next(frames)
    # Colour has half the resolution, and so half of an odd side is no size.
    size = (first.width + first.width % 2, first.height + first.height % 2)
    try:
        film = imageio_ffmpeg.write_frames(
            str(path),
            size,
            fps=fps,  # pyright: ignore[reportArgumentType] - it takes any number
            codec="libx264",
            quality=None,  # pyright: ignore[reportArgumentType] - as its own comments say
            macro_block_size=2,
            ffmpeg_log_level="error",
            output_params=["-crf", _QUALITY, "-movflags", "+faststart"],
        )
        count = 0
        with closing(film):
            film.send(None)
            for frame in chain([first], frames):
                film.send(_padded(frame, size).tobytes())
                count += 1
        written, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
    except RuntimeError as error:
        raise OSError(f"ffmpeg says: {error}") from error
    if written != count:
        raise OSError(f"ffmpeg wrote {written} of {count} pictures")


def _padded(picture: Image.Image, size: tuple[int, int]) -> Image.Image:
    padded = Image.new("RGB", size, "white")
    padded.paste(picture, (0, 0))
    return padded
