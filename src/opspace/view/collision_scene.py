"""Shapes of links, obstacles, and what is nearest, on the page."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import trimesh
import viser

from opspace.record.obstacle_columns import recorded_obstacle, recorded_shapes
from opspace.robots.protocol import Robot
from opspace.tasks import CollisionAvoidance
from opspace.tasks.nearest_points import Gap, nearest_points
from opspace.tasks.obstacles import Obstacle, Placing
from opspace.tasks.rotation import quaternion_from_matrix
from opspace.view.distance_panel import spare
from opspace.view.frame import Frame
from opspace.view.handle import DragHandle
from opspace.view.panels import blend_rgb

Placed = Callable[[str, tuple[float, ...]], None]
"""Takes the name of an obstacle and where it was dragged to."""

SHOWN = 0.1
"""Pairs that are nearer than this get a line, m."""

LINES = 5
"""As many pairs get a line at most."""

PLANE = 3.0
"""Side of the piece of a half-space that is drawn, m."""

_THICK = 0.02
_SHAPE_COLOR, _OBSTACLE_COLOR = (0, 68, 136), (204, 133, 51)


class CollisionScene:
    """Everything about collisions in three dimensions.

    Args:
        server: The server of the page.
        robot: The robot, in the state that is shown when `show` is called.
        about: What the recording says about its guard.
        placed: Told about obstacles that are dragged; None lets nothing be dragged.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        about: Mapping[str, Any],
        placed: Placed | None,
    ) -> None:
        self._server, self._robot = server, robot
        obstacles = [recorded_obstacle(n, entry) for n, entry in about["obstacles"].items()]
        self._guard = CollisionAvoidance(
            *obstacles,
            margin=about["margin"],
            shapes=recorded_shapes(about),
            pairs=[tuple(pair) for pair in about["pairs"]],
        )
        self._guard.bind(robot)
        self._all = {obstacle.name: obstacle for obstacle in obstacles}
        self._bodies = {o.name: _Body(server, o, placed) for o in obstacles}
        self._links = [
            (robot.frame_id(s.frame), _capsule(server, f"/shapes/{i}", s.start, s.end, s.radius))
            for i, s in enumerate(self._guard.shapes)
        ]
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        self._lines = server.scene.add_line_segments(
            "/distances/lines", nothing, np.zeros((1, 2, 3), np.uint8), thickness=0.004
        )
        self._labels = [
            server.scene.add_label(f"/distances/{i}", "", visible=False) for i in range(LINES)
        ]
        self.shapes_shown = False

    @property
    def margin(self) -> float:
        """Distance that is kept, m."""
        return self._guard.margin

    def show(self, frame: Frame, live: bool) -> tuple[Gap, ...]:
        """Draw a tick.

        Args:
            frame: The tick.
            live: Whether obstacles may be dragged now.

        Returns:
            The nearest points of every pair, the nearest first.
        """
        present = [name for name in self._all if name in frame.obstacles]
        if present != [obstacle.name for obstacle in self._guard.obstacles]:
            self._guard.remove(*(o.name for o in self._guard.obstacles))
            self._guard.add(*(self._all[name] for name in present))
        for name, body in self._bodies.items():
            body.show(frame.obstacles.get(name), live)
        for id_, handle in self._links:
            handle.visible = self.shapes_shown
            if self.shapes_shown:
                handle.position = self._robot.position(id_)
                handle.wxyz = np.array(quaternion_from_matrix(self._robot.rotation(id_)))
        placings = [frame.obstacles[name] for name in present]
        gaps = nearest_points(self._guard.layout(), self._robot, placings)
        self._show_lines([gap for gap in gaps[:LINES] if gap.distance < SHOWN])
        return gaps

    def _show_lines(self, gaps: Sequence[Gap]) -> None:
        self._lines.visible = bool(gaps)
        for label, gap in zip(self._labels, gaps, strict=False):
            label.text = f"{1e3 * gap.distance:.0f} mm"
            label.position = 0.5 * (gap.start + gap.end)
        for i, label in enumerate(self._labels):
            label.visible = i < len(gaps)
        if gaps:
            colors = [blend_rgb(spare(gap.distance, self.margin)) for gap in gaps]
            self._lines.points = np.array([[g.start, g.end] for g in gaps], dtype=np.float32)
            self._lines.colors = np.repeat(np.array(colors, np.uint8)[:, None], 2, axis=1)


class _Body:
    """An obstacle, and the handle to drag it by."""

    def __init__(
        self, server: viser.ViserServer, obstacle: Obstacle, placed: Placed | None
    ) -> None:
        path = f"/obstacles/{obstacle.name}"
        self._mesh = _drawn(server, path, _mesh(obstacle), _OBSTACLE_COLOR, 0.55)
        self._handle: DragHandle | None = None
        if placed is not None:
            self._handle = DragHandle(
                server,
                f"/obstacle-handles/{obstacle.name}",
                ("position",),
                lambda place: placed(obstacle.name, place["position"]),
            )

    def show(self, placing: Placing | None, live: bool) -> None:
        """Put shape and handle where the obstacle is, or hide them where there is none."""
        self._mesh.visible = placing is not None
        if self._handle is not None:
            self._handle.show(live and placing is not None)
        if placing is None:
            return
        self._mesh.position = placing.position
        self._mesh.wxyz = np.array(quaternion_from_matrix(placing.rotation))
        if self._handle is not None:
            self._handle.follow(placing.position)


def _mesh(obstacle: Obstacle) -> trimesh.Trimesh:
    """Draw a set: a box grown by a radius; of one without end a piece is drawn.

    A mesh is drawn as it is before it is grown.
    """
    if obstacle.faces.size:
        corners = obstacle.faces[:, :3].reshape(-1, 3)
        return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3))
    lower = np.where(np.isfinite(obstacle.lower), obstacle.lower, -0.5 * PLANE)
    upper = np.where(np.isfinite(obstacle.upper), obstacle.upper, 0.5 * PLANE)
    if not math.isfinite(obstacle.lower[2]):
        lower[2] = upper[2] - _THICK
    size, middle = upper - lower, 0.5 * (lower + upper)
    if not np.any(size):
        mesh = trimesh.creation.icosphere(3, obstacle.radius)
    elif obstacle.radius > 0.0:
        mesh = trimesh.creation.capsule(height=float(size[2]), radius=obstacle.radius)
        # Versions of trimesh differ in where a capsule begins.
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    else:
        mesh = trimesh.creation.box(extents=size)
    mesh.apply_translation(middle)
    return mesh


def _capsule(
    server: viser.ViserServer,
    name: str,
    start: Sequence[float],
    end: Sequence[float],
    radius: float,
) -> viser.MeshHandle:
    """Draw a capsule of a link, in the axes of its frame."""
    first, last = np.array(start), np.array(end)
    length = float(np.linalg.norm(last - first))
    mesh = trimesh.creation.capsule(height=length, radius=radius)
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    if length > 0.0:
        turn = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], last - first)
        mesh.apply_transform(turn)
    mesh.apply_translation(0.5 * (first + last))
    return _drawn(server, name, mesh, _SHAPE_COLOR, 0.3)


def _drawn(
    server: viser.ViserServer,
    name: str,
    mesh: trimesh.Trimesh,
    color: tuple[int, int, int],
    opacity: float,
) -> viser.MeshHandle:
    return server.scene.add_mesh_simple(
        name,
        vertices=np.asarray(mesh.vertices, dtype=np.float32),
        faces=np.asarray(mesh.faces, dtype=np.uint32),
        color=color,
        opacity=opacity,
        flat_shading=False,
        visible=False,
    )
