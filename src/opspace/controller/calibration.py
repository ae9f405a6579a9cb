"""What a controller derives from its robot, so that nothing needs tuning per robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from opspace.robots.protocol import Robot
from opspace.tasks import Task

SAMPLES = 200
UNKNOWN_BRAKE = 20.0
"""Braking acceleration where the torque limit is not known, rad/s²."""
BRAKE_RANGE = (2.0, 50.0)
"""Braking accelerations outside are not believed: the first is a joint that can hardly hold its own
weight in some posture, the second a wrist that other joints could not follow."""


@dataclass(frozen=True)
class Calibration:
    """Scales of a robot over its workspace.

    Attributes:
        brake: (n,) acceleration that half of the torque left by gravity gives each joint alone, the
            least over the workspace, rad/s².
        joint_sigma: Smallest eigenvalue of A⁻¹ over the workspace, 1/(kg·m²).
        references: Per name of a task that was in the stack at the start (m,): the median over the
            workspace of the smallest eigenvalue of the task's own J A⁻¹ Jᵀ, one value for its rows
            in m and one for those in rad, 1/kg and 1/(kg·m²).
    """

    brake: np.ndarray
    joint_sigma: float
    references: dict[str, np.ndarray]


class Workspace:
    """Postures within the joint limits, always the same ones, visited on a copy of the robot.

    A controller that runs is not disturbed, so tasks may be calibrated from another thread.

    Args:
        robot: The robot; it is left alone.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot = robot.fresh()
        self._visited: list[tuple[np.ndarray, np.ndarray]] = []
        brake = np.full(robot.nv, np.inf)
        joint_sigma = np.inf
        for q in sample_postures(robot):
            robot.update(q, np.zeros(robot.nv))
            inverse = np.linalg.inv(robot.M)
            joint_sigma = min(joint_sigma, float(np.linalg.eigvalsh(inverse)[0]))
            spare = np.maximum(robot.torque_limit - np.abs(robot.gravity), 0.0)
            brake = np.minimum(brake, 0.5 * spare * np.diag(inverse))
            self._visited.append((q, inverse))
        self.brake = np.where(np.isfinite(brake), np.clip(brake, *BRAKE_RANGE), UNKNOWN_BRAKE)
        self.joint_sigma = joint_sigma

    def reference(self, task: Task) -> np.ndarray:
        """Take the scale of a task's rows, see `Calibration`.

        Args:
            task: A task that no tick is using; it is left bound to a copy of the robot.

        Returns:
            (m,) medians of the smallest eigenvalue, 1/kg or 1/(kg·m²).
        """
        robot = self._robot
        task.bind(robot)
        smallest: list[np.ndarray] = []
        for q, inverse in self._visited:
            robot.update(q, np.zeros(robot.nv))
            J = task.evaluate(robot, 0.0).J
            smallest.append(_smallest_per_unit(task, J @ inverse @ J.T))
        return np.median(smallest, axis=0)


def sample_postures(robot: Robot) -> Iterator[np.ndarray]:
    """Visit postures uniformly distributed within the joint limits, one turn where there are none.

    Args:
        robot: A robot whose joints have one coordinate each.

    Yields:
        Configurations (nq,).
    """
    rng = np.random.default_rng(0)
    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)
    for _ in range(SAMPLES):
        yield rng.uniform(lower, upper)


def _smallest_per_unit(task: Task, inverse_inertia: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of the block of J A⁻¹ Jᵀ that each row shares a unit with, (m,)."""
    units = np.array(task.units)
    result = np.zeros(task.rows)
    for unit in set(task.units):
        rows = units == unit
        sigma = np.linalg.eigvalsh(inverse_inertia[np.ix_(rows, rows)])
        # A task of one's own may have rows that depend on each other in every posture.
        result[rows] = max(sigma[0], 1e-6 * sigma[-1], np.finfo(float).tiny)
    return result
