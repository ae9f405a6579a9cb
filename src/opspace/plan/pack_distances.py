"""Balls, convex sets and rows of a guard, as a tick reads them."""

from __future__ import annotations

import numpy as np

from opspace.machine.field_table import Record
from opspace.robots.motion_axes import FramePlace, MotionAxes
from opspace.tasks.collision_avoidance import CollisionAvoidance
from opspace.tasks.distance_layout import DistanceLayout
from opspace.tasks.obstacles import Placing


class PackedDistances:
    """The distances of one plan.

    Args:
        guard: What is kept apart.
        layout: Its balls, sets and rows.
        axes: The robot's arrays.
        tick: The arrays of the tick, made for this layout.

    Attributes:
        layout: The layout.
        placings: Where the last tick found the obstacles.
    """

    def __init__(
        self, guard: CollisionAvoidance, layout: DistanceLayout, axes: MotionAxes, tick: Record
    ) -> None:
        self.layout = layout
        self.placings: tuple[Placing, ...] = ()
        self._distances = d = tick.distances
        d.limits[:] = guard.kept, guard.k1, guard.k2, guard.brake
        d.row[:] = layout.rows
        for i, frame in enumerate(layout.ball_frame.tolist()):
            place = axes.frames[frame]
            d.ball_place[i] = place.body, place.joint
            _, d.ball[i, :3] = _on_body(place, np.eye(3), layout.ball_centre[i])
        d.ball[:, 3] = layout.ball_radius
        d.set_place[:] = -1
        for i, frame in enumerate(layout.set_frame.tolist()):
            if frame >= 0:
                place = axes.frames[frame]
                d.set_place[i] = place.body, place.joint
                R, p = _on_body(place, layout.set_rotation[i], layout.set_position[i])
                d.set_local[i, :9], d.set_local[i, 9:] = R.T.reshape(9), p
        d.extent[:, :3], d.extent[:, 3:6] = layout.lower, layout.upper
        d.extent[:, 6] = layout.set_radius
        d.mesh[:], d.face[:] = layout.mesh, layout.face.reshape(-1, 12)
        d.share[:] = layout.share
        d.motors[:] = tick.torque_limit

    @property
    def moving(self) -> bool:
        """Whether an obstacle follows a reference in time."""
        return any(obstacle.moving for obstacle in self.layout.obstacles)

    def refresh(self, t: float) -> None:
        """Bring the obstacles up to date at a time, s."""
        d, placings = self._distances, self.layout.placings(t)
        for i, (R, p, velocity) in enumerate(placings, d.set_local.shape[0] - len(placings)):
            d.set_local[i, :9], d.set_local[i, 9:], d.twist[i] = R.T.reshape(9), p, velocity
        self.placings = placings


def _on_body(
    place: FramePlace, rotation: np.ndarray, position: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Carry axes and a point from a frame to the body that it is fixed to."""
    R, p = place.local[:9].reshape(3, 3).T, place.local[9:]
    return R @ rotation, p + R @ position
