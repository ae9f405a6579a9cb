"""The robot on the page, its targets, and the directions that it is about to lose."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import viser

from opspace.robots.protocol import Robot
from opspace.robots.visuals import visuals_of
from opspace.tasks.rotation import exp_rotation
from opspace.view.frame import Frame, LevelFrame, TaskFrame
from opspace.view.handle import DragHandle
from opspace.view.panels import blend_rgb

Dragged = Callable[[str, dict[str, tuple[float, ...]]], None]
"""Takes the name of a task and where its target was dragged to."""

_LENGTH = 0.16
_ARC = np.linspace(0.0, 1.5 * math.pi, 25)
_TRAIL_POINTS = 80
_TARGET_COLOR, _TRAIL_COLOR = (221, 46, 36), (0, 68, 136)


class RobotScene:
    """Everything in three dimensions.

    Args:
        server: The server of the page.
        robot: The robot, for its frames; its state is changed.
        tasks: What the recording says about the tasks.
        dragged: Told about targets that are dragged; None lets nothing be dragged.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        tasks: Mapping[str, Mapping[str, Any]],
        dragged: Dragged | None,
    ) -> None:
        self._server, self._robot = server, robot
        self._visuals = visuals_of(robot)
        server.scene.set_up_direction("+z")
        server.scene.add_grid("/floor", width=4.0, height=4.0, cell_size=0.2, section_size=1.0)
        self._shapes = [
            server.scene.add_mesh_simple(
                f"/robot/{i}",
                vertices=np.asarray(shape.vertices, dtype=np.float32),
                faces=np.asarray(shape.faces, dtype=np.uint32),
                color=shape.color,
                flat_shading=shape.flat,
            )
            for i, shape in enumerate(self._visuals.shapes)
        ]
        self._tool = robot.frame_id(robot.tool)
        # The page never draws lines that it has got without a single point.
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        self._trail = server.scene.add_line_segments(
            "/trail", nothing, _TRAIL_COLOR, thickness=2.0, thickness_units="screen"
        )
        self._directions = server.scene.add_line_segments(
            "/directions", nothing, np.zeros((1, 2, 3), np.uint8), thickness=0.006
        )
        self._targets = {
            name: _Target(server, name, about, dragged)
            for name, about in tasks.items()
            if about["led_by"]
        }
        self._looking = False

    def show(self, frame: Frame, trail: np.ndarray, live: bool) -> None:
        """Draw a tick.

        Args:
            frame: The tick.
            trail: (k, 3) where the tool was before [m].
            live: Whether targets may be dragged now.
        """
        robot = self._robot
        robot.update(frame.q, np.zeros(robot.nv))
        positions, quaternions = self._visuals.poses(frame.q)
        for handle, position, quaternion in zip(self._shapes, positions, quaternions, strict=True):
            handle.position, handle.wxyz = position, quaternion
        tool = robot.position(self._tool)
        way = np.vstack([trail[-_TRAIL_POINTS:], tool]).astype(np.float32)
        self._trail.points = np.stack([way[:-1], way[1:]], axis=1)
        self._show_directions(frame.levels, tool)
        for task in frame.tasks:
            if task.name in self._targets:
                self._targets[task.name].show(task, robot, live)
        if not self._looking:
            self._look(positions, tool)

    def _look(self, positions: np.ndarray, tool: np.ndarray) -> None:
        """Place the camera of every new page so that the robot is in view."""
        points = np.vstack([positions, tool])
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        reach = max(float(np.ptp(points, axis=0).max()), 0.5)
        camera = self._server.initial_camera
        camera.look_at = centre
        # From the side: arms reach forward.
        camera.position = centre + reach * np.array([0.9, -1.9, 0.8])
        self._looking = True

    def _show_directions(self, levels: Sequence[LevelFrame], tool: np.ndarray) -> None:
        lines, colors = [], []
        for level in levels:
            known = level.activation[~np.isnan(level.activation)]
            if np.isnan(level.weakest).any() or not known.size:
                continue
            drawn = _direction(level.weakest, tool)
            lines += drawn
            colors += [np.tile(_light(blend_rgb(float(known[-1]))), (2, 1))] * len(drawn)
        self._directions.visible = bool(lines)
        if not lines:
            return
        self._directions.points = np.array(lines, dtype=np.float32).reshape(-1, 2, 3)
        self._directions.colors = np.array(colors, dtype=np.uint8).reshape(-1, 2, 3)


class _Target:
    """Where a task is wanted, and the handle to drag it by."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        about: Mapping[str, Any],
        dragged: Dragged | None,
    ) -> None:
        self._about = about
        self._ball = server.scene.add_icosphere(
            f"/target/{name}", radius=0.014, color=_TARGET_COLOR, visible=False
        )
        self._handle: DragHandle | None = None
        if dragged is not None:
            led = partial(dragged, name)
            self._handle = DragHandle(server, f"/handle/{name}", about["led_by"], led)

    def show(self, task: TaskFrame, robot: Robot, live: bool) -> None:
        """Put ball and handle where the task is wanted."""
        position, rotation = self._wanted(task, robot)
        self._ball.visible = task.present and "position" in self._about["led_by"]
        self._ball.position = position
        if self._handle is not None:
            self._handle.show(task.present and live)
            self._handle.follow(position, rotation)

    def _wanted(self, task: TaskFrame, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
        """Return where the task is led, from where it is and how far it is off."""
        about, led_by = self._about, self._about["led_by"]
        if about["center_of_mass"]:
            position, rotation = robot.com_position(), np.eye(3)
        else:
            id_ = robot.frame_id(about["frame"] or robot.tool)
            position, rotation = robot.position(id_), robot.rotation(id_)
        if about["offset"] is not None:
            position = position + rotation @ np.array(about["offset"])
        error = np.array(about["selection"]).T @ np.nan_to_num(task.error)
        parts = error.reshape(-1, 3)
        if about["in_tool_axes"]:
            parts = parts @ rotation.T
        if "position" in led_by:
            position = position + parts[0]
        if "orientation" in led_by:
            rotation = exp_rotation(parts[-1]) @ rotation
        return position, rotation


def _light(color: tuple[int, int, int]) -> np.ndarray:
    """Return a colour as an amount of light, which is what the page takes for colours by point."""
    return 255.0 * (np.array(color) / 255.0) ** 2.2


def _direction(weakest: np.ndarray, tool: np.ndarray) -> list[np.ndarray]:
    """Return a line along the linear part of a direction and an arc about its angular part."""
    linear, angular = weakest[:3], weakest[3:]
    whole = math.sqrt(float(weakest @ weakest)) or 1.0
    lines = []
    along = float(np.linalg.norm(linear)) / whole
    if along > 0.1:
        reach = _LENGTH * linear / whole
        lines.append(np.array([tool - reach, tool + reach]))
    about = float(np.linalg.norm(angular)) / whole
    if about > 0.1:
        axis = angular / np.linalg.norm(angular)
        side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        side *= 0.6 * _LENGTH * about / np.linalg.norm(side)
        other = np.cross(axis, side)
        ring = tool + np.outer(np.cos(_ARC), side) + np.outer(np.sin(_ARC), other)
        lines += list(np.stack([ring[:-1], ring[1:]], axis=1))
    return lines
