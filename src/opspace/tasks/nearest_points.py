"""Where two bodies come nearest to each other, for those who want to see it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from opspace.law.convex import set_distance
from opspace.robots.protocol import Robot
from opspace.tasks.distance_layout import DistanceLayout
from opspace.tasks.obstacles import Placing


class Gap(NamedTuple):
    """The nearest points of a pair of bodies.

    Attributes:
        pair: Its name, "body/body".
        start: (3,) on the first body, the one whose balls are counted, m.
        end: (3,) on the other, m.
        distance: Between the shapes, below zero where they overlap, m.
    """

    pair: str
    start: np.ndarray
    end: np.ndarray
    distance: float


def nearest_points(
    layout: DistanceLayout, robot: Robot, placings: Sequence[Placing]
) -> tuple[Gap, ...]:
    """Find the nearest points of every pair at the robot's present state, the nearest pair first.

    Args:
        layout: Which bodies are kept apart.
        robot: The robot.
        placings: Where the obstacles are, in the order of the layout.
    """
    centre = _carried(robot, layout.ball_frame, layout.ball_centre)
    rotation, position = _sets(layout, robot, placings)
    balls, sets = layout.rows[:, 0], layout.rows[:, 1]
    R, way = rotation[sets], centre[balls] - position[sets]
    local = np.einsum("kji,kj->ki", R, way)
    meshes = layout.meshes_of(sets)
    rho, n = set_distance(local, layout.lower[sets], layout.upper[sets], meshes)
    n = np.einsum("kij,kj->ki", R, n)
    apart = rho - layout.ball_radius[balls] - layout.set_radius[sets]
    start = centre[balls] - layout.ball_radius[balls, None] * n
    found: dict[str, Gap] = {}
    for i in np.argsort(apart, kind="stable"):
        name = layout.pairs[layout.pair[i]]
        if name not in found:
            found[name] = Gap(name, start[i], start[i] - apart[i] * n[i], float(apart[i]))
    return tuple(found.values())


def _carried(robot: Robot, frames: np.ndarray, local: np.ndarray) -> np.ndarray:
    found = np.zeros(local.shape)
    for i, frame in enumerate(frames.tolist()):
        found[i] = robot.position(frame) + robot.rotation(frame) @ local[i]
    return found


def _sets(
    layout: DistanceLayout, robot: Robot, placings: Sequence[Placing]
) -> tuple[np.ndarray, np.ndarray]:
    """Axes (sets, 3, 3) and origins (sets, 3) of all sets in the world [m]."""
    rotation, position = layout.set_rotation.copy(), layout.set_position.copy()
    links = len(rotation) - len(placings)
    position[:links] = _carried(robot, layout.set_frame[:links], layout.set_position[:links])
    for i, frame in enumerate(layout.set_frame[:links].tolist()):
        rotation[i] = robot.rotation(frame) @ layout.set_rotation[i]
    for i, placing in enumerate(placings, links):
        rotation[i], position[i] = placing.rotation, placing.position
    return rotation, position
