"""A recorded run as a moving picture for a document."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from opspace.errors import InputError, missing_extra
from opspace.record import Recording
from opspace.robots.protocol import Robot
from opspace.sim.snapshots import snapshots

try:
    from PIL import Image, ImageDraw, ImageFont
except ImportError:
    raise missing_extra("pillow", "sim") from None

SIZE = (360, 320)
BAND = 130
"""Width of the band with the activations, pixels."""
COLORS = 96
"""Colours of the palette; more make a larger file and no better picture."""


def film(
    recording: Recording,
    robot: Robot,
    path: Path | str,
    *,
    fps: float = 10.0,
    speed: float = 1.0,
    size: tuple[int, int] = SIZE,
    task: str = "position",
) -> Path:
    """Write a run as an animated GIF, with the time and the tasks' activations beside it.

    Args:
        recording: The run.
        robot: The robot of the run.
        path: GIF file to write.
        fps: Pictures per second of the film.
        speed: Seconds of the run per second of the film.
        size: Width and height of the robot's picture in pixels.
        task: Task whose target is shown, see `opspace.sim.snapshots.snapshots`.

    Returns:
        The path.

    Raises:
        InputError: A number that cannot be used, or another ending than .gif.
        SnapshotUnavailableError: There is no OpenGL to render with.
        ModelError: The robot was not read from a file.
    """
    path = Path(path)
    if path.suffix.lower() != ".gif":
        raise InputError(f"a film ends in .gif, not {path.name!r}")
    for name, value in (("fps", fps), ("speed", speed)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be finite and above 0, got {value}")
    if not len(recording):
        raise InputError("a film needs a recording with a tick")
    times = np.arange(recording.t[0], recording.t[-1], speed / fps).tolist()
    images = snapshots(recording, robot, times or [float(recording.t[0])], size=size, task=task)
    frames = [
        _captioned(image, recording, time) for image, time in zip(images, times, strict=False)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    # One palette for all pictures, or colours flicker; from several, or some are missing.
    chosen = frames[:: max(1, len(frames) // 8)]
    together = Image.fromarray(np.concatenate([np.asarray(frame) for frame in chosen]))
    palette = together.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE)
    drawn = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    drawn[0].save(
        path, save_all=True, append_images=drawn[1:], duration=round(1000.0 / fps), loop=0
    )
    return path


def _captioned(image: np.ndarray, recording: Recording, time: float) -> Image.Image:
    """Put the time, and a bar for the activation of every task, on a band beside the picture."""
    height, width = image.shape[:2]
    picture = Image.new("RGB", (BAND + width, height), "white")
    picture.paste(Image.fromarray(image), (BAND, 0))
    draw = ImageDraw.Draw(picture)
    font = ImageFont.load_default(size=12)
    draw.text((8, 6), f"t = {time:.1f} s", fill="#303030", font=font)
    row = min(int(np.searchsorted(recording.t, time)), len(recording) - 1)
    top = 26
    for column in recording.names:
        parts = column.split("/")
        if parts[0] != "tasks" or parts[-1] != "activation":
            continue
        h = recording[column][row]
        h = 0.0 if np.isnan(h) else float(h)
        draw.rectangle((8, top + 2, 48, top + 10), outline="#8c8c8c", fill="#ffffff")
        if h > 0.0:
            draw.rectangle((8, top + 2, 8 + round(40 * h), top + 10), fill="#004488")
        color = "#303030" if h > 0.0 else "#8c8c8c"
        draw.text((54, top - 1), "/".join(parts[1:-1]), fill=color, font=font)
        top += 15
    return picture
