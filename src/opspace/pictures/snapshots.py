"""Pictures of a recorded run, rendered off screen by MuJoCo (after Fig. 2 and 6 of the paper)."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from opspace.errors import InputError, ModelError, missing_extra
from opspace.pictures.obstacles_drawn import Drawn, draw_obstacles
from opspace.pictures.offscreen import (
    Canvas,
    SnapshotUnavailableError,
    View,
    camera_axes,
    canvas,
    fit_view,
)
from opspace.pictures.touched_drawn import TouchedDrawn
from opspace.record import Recording
from opspace.robots.adapter import spread_of
from opspace.robots.protocol import Robot
from opspace.tasks.obstacles import Obstacle, Placing

try:
    import mujoco
    from PIL import Image, ImageDraw, ImageFont
except ImportError as error:
    raise missing_extra("pillow" if error.name == "PIL" else "mujoco", "sim") from None

from opspace.robots.mujoco_model import model_of
from opspace.robots.mujoco_names import joint_names
from opspace.robots.mujoco_scene import draw_what_is_unseen

__all__ = ["SnapshotUnavailableError", "render", "snapshot_strip", "snapshots"]

SIZE = (480, 420)
FINE_SHADOWS = 8192
TARGET_COLOR = (0.87, 0.18, 0.14, 0.75)
TRAIL_COLOR = (0.0, 0.27, 0.53, 1.0)

# From the front and a little from above, where the light comes from; then all around.
_DIRECTIONS = [
    (float(a), e) for e in (-20.0, -40.0) for a in (120, 60, 105, 75, 90, *range(0, 360, 15))
]
_SEEN_WELL = 0.7
_BEHIND = 0.3
_TRAIL_POINTS = 60


class _Tick(NamedTuple):
    row: int
    qpos: np.ndarray
    target: np.ndarray | None
    trail: np.ndarray
    obstacles: list[tuple[Obstacle, Placing]]


def snapshots(
    recording: Recording,
    robot: Robot,
    times: Sequence[float],
    *,
    size: tuple[int, int] = SIZE,
    task: str = "position",
    direction: tuple[float, float] | None = None,
) -> list[np.ndarray]:
    """Render the robot at several times of a run, all from the same place.

    The desired position is a sphere, the way of the tool so far a line; obstacles are where they were,
    what the tool presses is a disc and the force on it that was measured an arrow.

    Args:
        recording: The run, with columns ``q/<joint>`` and ``tool/x`` to ``tool/z``.
        robot: The robot of the run.
        times: Times to show [s]; the recorded tick next to each is taken.
        size: Width and height in pixels.
        task: Task whose first three rows are the error of the tool's position; without such a task
            no sphere is drawn.
        direction: Azimuth and elevation of the camera [degrees]; None finds the side from which
            most of the motion can be seen.

    Returns:
        (height, width, 3) uint8 image for each time.

    Raises:
        SnapshotUnavailableError: There is no OpenGL to render with.
        InputError: There is no time or no tick, or the size cannot be used.
        ModelError: The robot was not read from a file.
        UnknownNameError: The recording has no position of one of the robot's joints.
    """
    return list(render(recording, robot, times, size=size, task=task, direction=direction))


def render(
    recording: Recording,
    robot: Robot,
    times: Sequence[float],
    *,
    size: tuple[int, int] = SIZE,
    task: str = "position",
    direction: tuple[float, float] | None = None,
    shadow_map: int = FINE_SHADOWS,
) -> Iterator[np.ndarray]:
    """Render like `snapshots`, one picture after the other, for more than memory would hold.

    Args:
        recording: See `snapshots`.
        robot: See `snapshots`.
        times: See `snapshots`.
        size: See `snapshots`.
        task: See `snapshots`.
        direction: See `snapshots`.
        shadow_map: Side of the map that shadows are read from, pixels; 0 is no shadows. Without a
            graphics card they take most of the time.

    Yields:
        (height, width, 3) uint8 image for each time.

    Raises:
        SnapshotUnavailableError: See `snapshots`.
        InputError: See `snapshots`.
        ModelError: See `snapshots`.
        UnknownNameError: See `snapshots`.
    """
    if robot.source is None:
        raise ModelError(f"robot {robot.name!r} was not read from a file that MuJoCo could render")
    if not times or not len(recording):
        raise InputError("a snapshot needs a time and a recording with a tick")
    model = model_of(robot, draw_what_is_unseen)
    # The shadow map must reach beyond what is in view, or its edge speckles the floor.
    model.vis.map.shadowclip, model.vis.quality.shadowsize = 4.0, shadow_map
    data = mujoco.MjData(model)
    ticks = _ticks(model, robot, recording, times, task)
    view, touched = _choose_view(model, data, ticks, size, direction), TouchedDrawn(recording)
    with canvas(model, size) as drawing:
        for tick in ticks:
            data.qpos[:] = tick.qpos
            mujoco.mj_forward(model, data)
            _draw(drawing, data, tick, view)
            touched.draw(drawing, tick.row, tick.trail[-1])
            yield drawing.pixels()


def snapshot_strip(
    recording: Recording,
    robot: Robot,
    times: Sequence[float],
    path: Path | str,
    *,
    size: tuple[int, int] = SIZE,
    task: str = "position",
    direction: tuple[float, float] | None = None,
) -> Path:
    """Write snapshots side by side with the captions (a), (b), (c) and their times.

    Args:
        recording: See `snapshots`.
        robot: See `snapshots`.
        times: See `snapshots`.
        path: PNG file to write.
        size: Width and height of each picture in pixels.
        task: See `snapshots`.
        direction: See `snapshots`.

    Returns:
        The path.

    Raises:
        SnapshotUnavailableError: There is no OpenGL to render with.
        InputError: See `snapshots`.
        ModelError: See `snapshots`.
        UnknownNameError: See `snapshots`.
    """
    images = snapshots(recording, robot, times, size=size, task=task, direction=direction)
    width, height = size
    gap, font = max(width // 40, 1), ImageFont.load_default(size=max(width // 22, 8))
    below = 2 * max(width // 22, 8)
    strip = Image.new("RGB", (len(images) * (width + gap) - gap, height + below), "white")
    draw, t = ImageDraw.Draw(strip), recording.t
    for i, (image, time) in enumerate(zip(images, times, strict=True)):
        left, shown = i * (width + gap), t[_nearest(t, time)]
        strip.paste(Image.fromarray(image), (left, 0))
        caption = f"({chr(ord('a') + i)})  t = {shown:.2f} s"
        middle = left + width / 2, height + below / 2
        draw.text(middle, caption, fill="#303030", font=font, anchor="mm")
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    strip.save(path)
    return path


def _nearest(t: np.ndarray, time: float) -> int:
    return int(np.abs(t - time).argmin())


def _ticks(
    model: mujoco.MjModel, robot: Robot, recording: Recording, times: Sequence[float], task: str
) -> list[_Tick]:
    """Read what is to be seen at each time; whole columns are read once."""
    spread = spread_of(robot)
    coordinates = [
        (start, stop, _columns(recording, name, stop - start))
        for start, stop, name in (_coordinates(model) if spread is None else ())
    ]
    error = [f"tasks/{task}/error/{i}" for i in range(3)]
    aimed = all(name in recording for name in error)
    t, tool = recording.t, np.column_stack([recording[f"tool/{axis}"] for axis in "xyz"])
    ticks, drawn = [], Drawn(recording)
    for row in (_nearest(t, time) for time in times):
        found, qpos = recording.row(row), np.array(model.qpos0)
        for start, stop, names in coordinates:
            qpos[start:stop] = [found[name] for name in names]
        if spread is not None:
            qpos = spread.positions(np.array([found[f"q/{name}"] for name in robot.joint_names]))
        target = tool[row] + [found[name] for name in error] if aimed else None
        shown = np.linspace(0, row, min(row + 1, _TRAIL_POINTS)).astype(int)
        ticks.append(_Tick(row, qpos, target, tool[shown], drawn.at(row)))
    return ticks


def _columns(recording: Recording, name: str, width: int) -> tuple[str, ...]:
    if width > 1:
        return recording.members(name)
    if name not in recording:
        raise recording.no_column(name)
    return (name,)


def _coordinates(model: mujoco.MjModel) -> list[tuple[int, int, str]]:
    """Return where each joint lies in qpos and the name of its column or columns."""
    edges = [*model.jnt_qposadr.tolist(), model.nq]
    ranges = zip(joint_names(model), pairwise(edges), strict=True)
    return [(a, b, f"q/{name}") for name, (a, b) in ranges]


def _choose_view(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    ticks: Sequence[_Tick],
    size: tuple[int, int],
    direction: tuple[float, float] | None,
) -> View:
    targets = [tick.target for tick in ticks if tick.target is not None]
    motion = np.vstack([*(tick.trail for tick in ticks), *targets])
    body = np.vstack([_corners(model, data, tick.qpos) for tick in ticks])
    if direction is None:
        direction = _best_direction(motion, body)
    return fit_view(np.vstack([motion, body]), size, direction, model.vis.global_.fovy)


def _best_direction(motion: np.ndarray, body: np.ndarray) -> tuple[float, float]:
    """Return the first direction from which the motion is wide and in front of the robot."""
    axes = np.array([camera_axes(*direction) for direction in _DIRECTIONS])
    seen = np.var(np.einsum("dij,kj->dki", axes[:, :2], motion), axis=1).sum(axis=1)
    in_front = axes[:, 2] @ (body.mean(axis=0) - motion.mean(axis=0)) > 0.0
    scores = np.where(in_front, 1.0, _BEHIND) * seen
    return _DIRECTIONS[int(np.argmax(scores >= _SEEN_WELL * scores.max()))]


def _corners(model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray) -> np.ndarray:
    """Return the corners of the boxes around all shapes but the floor, (k, 3)."""
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = [np.empty((0, 3))]
    for i in np.flatnonzero(model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE):
        box = model.geom_aabb[i]
        corners.append(
            data.geom_xpos[i] + (box[:3] + signs * box[3:]) @ data.geom_xmat[i].reshape(3, 3).T
        )
    return np.vstack(corners)


def _draw(drawing: Canvas, data: mujoco.MjData, tick: _Tick, view: View) -> None:
    drawing.show(data, view)
    draw_obstacles(drawing, tick.obstacles)
    for start, end in pairwise(tick.trail):
        radius, shape = 0.003 * view.distance, mujoco.mjtGeom.mjGEOM_CAPSULE
        geom = drawing.add(shape, start, radius, TRAIL_COLOR)
        mujoco.mjv_connector(geom, shape, radius, start, end)
    if tick.target is not None:
        shape = mujoco.mjtGeom.mjGEOM_SPHERE
        drawing.add(shape, tick.target, 0.012 * view.distance, TARGET_COLOR)
