"""What a recorded tool presses, and how hard, as shapes that MuJoCo draws."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from opspace.errors import missing_extra
from opspace.pictures.offscreen import Canvas
from opspace.record import Recording
from opspace.record.wrench_columns import GROUP, latest, touched

try:
    import mujoco
except ImportError:
    raise missing_extra("mujoco", "sim") from None

SURFACE_COLOR = (0.59, 0.65, 0.69, 0.35)
FORCE_COLOR = (1.0, 0.65, 0.0, 1.0)
PIECE = 0.25
"""Radius of the piece that is drawn of what has no end, and of a plate with a hole, m."""
THICK = 0.008
WANTED_LENGTH, MOST_LENGTH = 0.2, 0.6
"""Length of an arrow of the largest force that is wanted, and of the longest, m."""
SHORTEST = 0.01
"""What is shorter is no arrow, m."""


class TouchedDrawn:
    """The surfaces of a recording's scenario, and the force on them that its tool measured.

    Args:
        recording: The recording, with or without them.
    """

    def __init__(self, recording: Recording) -> None:
        header = recording.header
        self._pieces = touched(header)
        tasks: Mapping[str, Mapping[str, Any]] = header.get("tasks", {})
        sizes = [np.linalg.norm(one["press"]["force"]) for one in tasks.values() if "press" in one]
        sensor = f"{GROUP}/{header.get('robot', {}).get('tool')}"
        self._forces = recording.group(sensor)[:, :3] if f"{sensor}/x" in recording else None
        self._scale = WANTED_LENGTH / float(max(sizes, default=1.0))

    def draw(self, drawing: Canvas, row: int, tool: np.ndarray) -> None:
        """Put surfaces and force of a tick into a picture whose tool is here, (3,) m."""
        for piece in self._pieces:
            normal = np.array(piece["normal"], dtype=float)
            normal /= np.linalg.norm(normal)
            shape, radius = mujoco.mjtGeom.mjGEOM_CYLINDER, piece.get("size") or PIECE
            point = np.array(piece["point"], dtype=float)
            geom = drawing.add(shape, point, radius, SURFACE_COLOR)
            mujoco.mjv_connector(geom, shape, radius, point - THICK * normal, point)
        arrow = self.arrow(row)
        if arrow is not None:
            shape, width = mujoco.mjtGeom.mjGEOM_ARROW, 0.006
            geom = drawing.add(shape, tool, width, FORCE_COLOR)
            mujoco.mjv_connector(geom, shape, width, tool, tool + arrow)

    def arrow(self, row: int) -> np.ndarray | None:
        """Give the arrow of the force that was measured last, (3,) m; None where there is none."""
        if self._forces is None:
            return None
        force = latest(self._forces, row)
        length = self._scale * float(np.linalg.norm(force))
        # Not where it is NaN, either.
        if not length > SHORTEST:
            return None
        return force * self._scale * min(1.0, MOST_LENGTH / length)
