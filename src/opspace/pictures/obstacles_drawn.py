"""The obstacles of a recording, as shapes that MuJoCo draws."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from opspace.errors import missing_extra
from opspace.pictures.offscreen import Canvas
from opspace.record import Recording
from opspace.record.obstacle_columns import (
    HEADER_KEY,
    placing_of,
    recorded_obstacle,
    row_columns,
)
from opspace.tasks.obstacles import Obstacle, Placing

try:
    import mujoco
except ImportError:
    raise missing_extra("mujoco", "sim") from None

COLOR = (0.80, 0.52, 0.20, 0.55)
PLANE = 0.9
"""Half the side of the piece of a half-space that is drawn, m."""

_THIN, _EDGE = 0.005, 0.004


class Drawn:
    """The obstacles of a recording.

    Args:
        recording: The recording, with or without obstacles.
    """

    def __init__(self, recording: Recording) -> None:
        about = recording.header.get(HEADER_KEY, {}).get("obstacles", {})
        self._known = {
            name: (recorded_obstacle(name, entry), row_columns(recording, name))
            for name, entry in about.items()
        }

    def at(self, row: int) -> list[tuple[Obstacle, Placing]]:
        """List the obstacles of a tick, and where they are."""
        found: list[tuple[Obstacle, Placing]] = []
        for obstacle, columns in self._known.values():
            if columns is not None and not math.isnan(columns[row, 0]):
                found.append((obstacle, placing_of(columns[row])))
        return found


def draw_obstacles(drawing: Canvas, there: Sequence[tuple[Obstacle, Placing]]) -> None:
    """Put obstacles into a picture."""
    for obstacle, placing in there:
        if obstacle.faces.size:
            _draw_edges(drawing, obstacle.faces, placing)
            continue
        lower = np.where(np.isfinite(obstacle.lower), obstacle.lower, -PLANE)
        upper = np.where(np.isfinite(obstacle.upper), obstacle.upper, PLANE)
        if not math.isfinite(obstacle.lower[2]):
            lower[2] = upper[2] - 2.0 * _THIN
        half, middle = 0.5 * (upper - lower), placing.rotation @ (0.5 * (lower + upper))
        kinds, radius = mujoco.mjtGeom, obstacle.radius
        if not np.any(half):
            shape, size = kinds.mjGEOM_SPHERE, np.full(3, radius)
        elif radius > 0.0:
            shape, size = kinds.mjGEOM_CAPSULE, np.array([radius, half[2], half[2]])
        else:
            shape, size = kinds.mjGEOM_BOX, half
        geom = drawing.scene.geoms[drawing.scene.ngeom]
        color = np.array(COLOR, dtype=np.float32)
        at = placing.position + middle
        mujoco.mjv_initGeom(geom, shape, size, at, placing.rotation.flatten(), color)
        drawing.scene.ngeom += 1


def _draw_edges(drawing: Canvas, faces: np.ndarray, placing: Placing) -> None:
    """Put the edges of a mesh into a picture."""
    shape = mujoco.mjtGeom.mjGEOM_CAPSULE
    corners = placing.position + faces[:, :3] @ placing.rotation.T
    for start, end in zip(
        corners.reshape(-1, 3), np.roll(corners, -1, 1).reshape(-1, 3), strict=True
    ):
        if tuple(start) < tuple(end):  # every edge belongs to two faces
            geom = drawing.add(shape, start, _EDGE, COLOR)
            mujoco.mjv_connector(geom, shape, _EDGE, start, end)
