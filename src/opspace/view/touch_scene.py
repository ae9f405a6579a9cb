"""What a tool presses on the page: surfaces and holes, forces as arrows, and how sure a touch is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import viser

from opspace.robots.protocol import Robot
from opspace.view import contact_shapes as shapes
from opspace.view.contact_scene import MEASURED
from opspace.view.frame import Frame, TouchFrame
from opspace.view.panels import blend_rgb
from opspace.view.touched_shapes import touched_mesh

WANTED_LENGTH = 0.2
"""Length of an arrow of the largest force that is wanted at the start, m."""
MOST_LENGTH = 0.6
"""No arrow is longer, m: the first peak of a touch is many times what is wanted."""
COMMANDED = (170, 51, 119)
"""Unlike the weakest direction, which often lies along the force."""
_BALL = 0.012
_SURFACE_COLOR = (150, 165, 175)


class TouchScene:
    """Everything about force tasks in three dimensions.

    Args:
        server: The server of the page.
        robot: The robot, in the state that is shown when `show` is called.
        presses: What the recording says about force tasks, by name: where and with what they press.
        touched: Surfaces and holes that the run has, as its scenario says.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        presses: Mapping[str, Mapping[str, Any]],
        touched: Sequence[Mapping[str, Any]],
    ) -> None:
        self._robot, self._presses = robot, presses
        largest = max(float(np.linalg.norm(one["force"])) for one in presses.values())
        self._scale = WANTED_LENGTH / largest
        nothing = np.zeros((1, 2, 3), np.float32)
        # A wide one around a narrow one: where they agree both are seen.
        self._measured, self._commanded = (
            server.scene.add_line_segments(f"/touch/{name}", nothing, color, thickness=width)
            for name, color, width in (
                ("measured", MEASURED, 0.012),
                ("commanded", COMMANDED, 0.005),
            )
        )
        self._balls = {
            name: server.scene.add_icosphere(f"/touch/{name}", radius=_BALL, visible=False)
            for name in presses
        }
        for i, about in enumerate(touched):
            mesh = touched_mesh(about)
            server.scene.add_mesh_simple(
                f"/touched/{i}",
                vertices=np.asarray(mesh.vertices, dtype=np.float32),
                faces=np.asarray(mesh.faces, dtype=np.uint32),
                color=_SURFACE_COLOR,
                opacity=0.5,
                flat_shading=True,
                side="double",
            )

    def show(self, frame: Frame) -> None:
        """Draw a tick; the robot is where the frame has it."""
        measured, commanded = [], []
        for touch in frame.touches:
            point, axes = self._place(self._presses[touch.name])
            measured.append(self._arrow(point, touch.wrench))
            commanded.append(self._arrow(point, pushed(touch, axes)))
            ball = self._balls[touch.name]
            ball.visible, ball.position = np.isfinite(touch.confidence), point
            ball.color = blend_rgb(touch.confidence)
        for handle, lines in ((self._measured, measured), (self._commanded, commanded)):
            points = np.concatenate(lines).astype(np.float32)
            # The page never draws lines that it has got without a point.
            handle.visible = bool(len(points))
            if len(points):
                handle.points = points

    def _place(self, about: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Find the point that presses, (3,), and the axes of its forces, (k, 3), in the world."""
        id_ = self._robot.frame_id(about["sensor"])
        point, rotation = self._robot.position(id_), self._robot.rotation(id_)
        if about["offset"] is not None:
            point = point + rotation @ np.array(about["offset"])
        axes = np.array(about["selection"])[: len(about["force"]), :3]
        return point, axes @ rotation.T if about["in_tool_axes"] else axes

    def _arrow(self, point: np.ndarray, force: np.ndarray) -> np.ndarray:
        size = float(np.linalg.norm(force))
        if size * self._scale > MOST_LENGTH:
            force = force * (MOST_LENGTH / (size * self._scale))
        return shapes.arrow(point, force, shapes.LONGEST / self._scale)


def pushed(touch: TouchFrame, axes: np.ndarray) -> np.ndarray:
    """Give the force that a task pushes with, (3,) in the world: as far as it is there and touches.

    Args:
        touch: The task.
        axes: (k, 3) axes of its forces in the world.
    """
    part = touch.activation * touch.confidence
    return part * (axes.T @ touch.commanded[: len(axes)])
