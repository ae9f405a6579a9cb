"""A recorded run as a moving picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from opspace.errors import InputError, missing_extra
from opspace.pictures.movie_file import write_gif, write_mp4
from opspace.pictures.snapshots import render
from opspace.record import Recording
from opspace.record.whole_file import whole_file
from opspace.robots.protocol import Robot

try:
    from PIL import Image, ImageDraw, ImageFont
except ImportError:
    raise missing_extra("pillow", "sim") from None

SIZES = {".gif": (360, 320), ".mp4": (720, 640)}
"""Size of the robot's picture by ending of the file: a GIF grows large."""
FPS = {".gif": 10.0, ".mp4": 30.0}
"""Pictures per second by ending of the file."""
NO_SHADOWS = 0
"""Size of the map of the shadows: without a graphics card they take more than half of the time."""
BAND = 130
"""Width of the band with the activations beside a picture of the height of a GIF's, pixels."""

_WRITERS = {".gif": write_gif, ".mp4": write_mp4}


def film(
    recording: Recording,
    robot: Robot,
    path: Path | str,
    *,
    fps: float | None = None,
    speed: float = 1.0,
    size: tuple[int, int] | None = None,
    task: str = "position",
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a run as a moving picture, with the time and the activations beside it.

    Args:
        recording: The run.
        robot: The robot of the run.
        path: File to write: an animated GIF (.gif), or H.264 that browsers play (.mp4).
        fps: Pictures per second of the film; None takes that of `FPS`.
        speed: Seconds of the run per second of the film.
        size: Width and height of the robot's picture in pixels; None takes that of `SIZES`.
        task: Task whose target is shown, see `opspace.pictures.snapshots.snapshots`.
        progress: Is told how many pictures are done, and of how many.

    Returns:
        The path.

    Raises:
        InputError: A number that cannot be used, another ending, or a file that cannot be written.
        MissingExtraError: A .mp4 is asked for and imageio-ffmpeg is not installed.
        SnapshotUnavailableError: There is no OpenGL to render with.
        ModelError: The robot was not read from a file.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in _WRITERS:
        raise InputError(f"a film ends in {' or '.join(_WRITERS)}, not {path.name!r}")
    fps, size = FPS[ending] if fps is None else fps, SIZES[ending] if size is None else size
    for name, value in (("fps", fps), ("speed", speed)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be finite and above 0, got {value}")
    if not len(recording):
        raise InputError("a film needs a recording with a tick")
    t = recording.t
    times = np.arange(t[0], t[-1], speed / fps).tolist() or [float(t[0])]

    def frames() -> Iterator[Image.Image]:
        images = render(recording, robot, times, size=size, task=task, shadow_map=NO_SHADOWS)
        for done, (image, time) in enumerate(zip(images, times, strict=True), 1):
            row = min(int(np.searchsorted(t, time)), len(t) - 1)
            yield _captioned(image, time, recording.row(row))
            if progress:
                progress(done, len(times))

    with whole_file(path, overwrite=True) as unfinished:
        _WRITERS[ending](frames(), unfinished, fps)
    return path


def _captioned(image: np.ndarray, time: float, found: Mapping[str, float]) -> Image.Image:
    """Put the time, and a bar for every activation, on a band beside the picture."""
    height, width = image.shape[:2]
    k = max(1.0, height / SIZES[".gif"][1])
    band = round(BAND * k)
    picture = Image.new("RGB", (band + width, height), "white")
    picture.paste(Image.fromarray(image), (band, 0))
    draw = ImageDraw.Draw(picture)
    font = ImageFont.load_default(size=12 * k)
    draw.text((8 * k, 6 * k), f"t = {time:.1f} s", fill="#303030", font=font)
    top = 26 * k
    for column, activation in found.items():
        parts = column.split("/")
        if parts[0] not in ("tasks", "contacts") or parts[-1] != "activation":
            continue
        h = 0.0 if math.isnan(activation) else activation
        bar = (8 * k, top + 2 * k, 48 * k, top + 10 * k)
        draw.rectangle(bar, outline="#8c8c8c", fill="#ffffff")
        if h > 0.0:
            draw.rectangle((*bar[:2], 8 * k + round(40 * k * h), bar[3]), fill="#004488")
        color = "#303030" if h > 0.0 else "#8c8c8c"
        draw.text((54 * k, top - k), "/".join(parts[1:-1]), fill=color, font=font)
        top += 15 * k
    return picture
