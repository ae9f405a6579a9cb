"""Distances of one tick: the rows of a guard, and how fast each may shrink."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from opspace.law.convex import Bodies, DistanceRows, Points, distance_rows
from opspace.law.nearest import softness_of_rows
from opspace.law.scalars import asked_for, closing_command, last_closing_command
from opspace.robots.protocol import Robot
from opspace.tasks.collision_avoidance import CollisionAvoidance
from opspace.tasks.distance_layout import DistanceLayout
from opspace.tasks.obstacles import Placing


class DistanceTerms(NamedTuple):
    """The distances of one tick, and the bounds G q̈ ≤ most that keep them.

    Attributes:
        layout: Whose distances they are.
        placings: Where it found the obstacles.
        distance: (rows,) between the shapes, m.
        G: (rows, n) by how much joint accelerations let each shrink faster.
        most: (rows,) m/s².
        last: (rows,) m/s² before one will soon shrink faster than it may.
        asked: (rows,) what each counts as asking for, m/s²; see `opspace.law.scalars.asked_for`.
        motors: (n,) what the motors give, N·m; inf where nobody says.
    """

    layout: DistanceLayout
    placings: tuple[Placing, ...]
    distance: np.ndarray
    G: np.ndarray
    most: np.ndarray
    last: np.ndarray
    asked: np.ndarray
    motors: np.ndarray

    def softness(self, M: np.ndarray) -> np.ndarray:
        """Say how soft every bound is for the inertia M, (rows,); see `softness_of_rows`."""
        return softness_of_rows(self.G, self.most, M, self.motors, self.asked)

    @property
    def by_name(self) -> Mapping[str, Placing]:
        """Where the obstacles were found, by name."""
        return self.layout.by_name(self.placings)


def distance_terms(
    guard: CollisionAvoidance, robot: Robot, t: float, motors: np.ndarray
) -> DistanceTerms:
    """Evaluate all distances of a guard at the robot's present state.

    Args:
        guard: What is kept apart.
        robot: The robot.
        t: Time, s.
        motors: (n,) what the motors give, N·m; inf where nobody says.
    """
    layout = guard.layout()
    placings = layout.placings(t)
    rows = rows_of(layout, robot, placings)
    balls, sets = layout.rows[:, 0], layout.rows[:, 1]
    distance = rows.distance - layout.ball_radius[balls] - layout.set_radius[sets]
    most, last = _commands(guard, distance - guard.kept, rows, layout.share[sets])
    asked = np.array([asked_for(speed, guard.brake) for speed in rows.passing.tolist()])
    return DistanceTerms(layout, placings, distance, -rows.G, most, last, asked, motors)


def _commands(
    guard: CollisionAvoidance, D: np.ndarray, rows: DistanceRows, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Say how fast each distance may shrink faster, and before it is lost, (rows,) m/s²."""
    shared = share > 0.0
    own = np.where(shared, rows.own_rate, rows.rate)
    drift = np.where(shared, rows.own_drift, rows.drift)
    most, last = closing(guard, D, rows.rate, own, share)
    return most + drift, last + drift


def closing(
    guard: CollisionAvoidance, D: np.ndarray, rate: np.ndarray, own: np.ndarray, share: np.ndarray
) -> np.ndarray:
    """Evaluate both closing commands of `opspace.law.scalars` for every row, m/s²; share 0 is alone.

    Returns:
        (2, rows) `closing_command` and `last_closing_command`.
    """
    found = np.zeros((2, D.size))
    told = zip(D.tolist(), rate.tolist(), own.tolist(), share.tolist(), strict=True)
    for i, (d, speed, part, s) in enumerate(told):
        at = (d, -speed, -part, s or 1.0, guard.brake, guard.k1)
        found[0, i] = closing_command(*at, guard.k2)
        found[1, i] = last_closing_command(*at, found[0, i])
    return found


def rows_of(layout: DistanceLayout, robot: Robot, placings: Sequence[Placing]) -> DistanceRows:
    """Evaluate the distances of centres of balls to sets that are not grown by their radii."""
    points = _points(layout, robot)
    bodies = _bodies(layout, robot, placings)
    balls, sets = layout.rows[:, 0], layout.rows[:, 1]
    return distance_rows(
        Points._make(part[balls] for part in points),
        Bodies._make(part[sets] for part in bodies),
        layout.lower[sets],
        layout.upper[sets],
        layout.meshes_of(sets),
    )


def _points(layout: DistanceLayout, robot: Robot) -> Points:
    """Motion of the centres of all balls."""
    count = layout.ball_frame.size
    none = np.zeros((count, 3))
    found = Points(none.copy(), none.copy(), none.copy(), np.zeros((count, 3, robot.nv)))
    for i, (frame, centre) in enumerate(zip(layout.ball_frame, layout.ball_centre, strict=True)):
        position, V, A, J = _moved(robot, int(frame), robot.rotation(int(frame)) @ centre)
        found.position[i], found.velocity[i] = position, V[:3]
        found.acceleration[i], found.J[i] = A[:3], J[:3]
    return found


def _bodies(layout: DistanceLayout, robot: Robot, placings: Sequence[Placing]) -> Bodies:
    """Motion of all sets, those of links and those of obstacles."""
    count, n = layout.set_frame.size, robot.nv
    found = Bodies(
        np.zeros((count, 3, 3)),
        np.zeros((count, 3)),
        np.zeros((count, 6)),
        np.zeros((count, 6)),
        np.zeros((count, 6, n)),
    )
    links = count - len(layout.obstacles)
    for i in range(links):
        frame = int(layout.set_frame[i])
        R = robot.rotation(frame)
        arm = R @ layout.set_position[i]
        found.rotation[i] = R @ layout.set_rotation[i]
        found.position[i], found.velocity[i], found.acceleration[i], found.J[i] = _moved(
            robot, frame, arm
        )
    for i, placing in enumerate(placings, links):
        found.rotation[i], found.position[i], found.velocity[i] = placing
    return found


def _moved(
    robot: Robot, frame: int, arm: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity, drift and Jacobian of a point of a frame's body, ``arm`` from its origin."""
    J = robot.jacobian(frame).copy()
    V, A = robot.velocity(frame).copy(), robot.drift(frame).copy()
    spin = V[3:]
    J[:3] -= np.cross(arm, J[3:], axisb=0, axisc=0)
    A[:3] += np.cross(A[3:], arm) + np.cross(spin, np.cross(spin, arm))
    V[:3] += np.cross(spin, arm)
    return robot.position(frame) + arm, V, A, J
