"""What a controller derives from its robot, so that nothing needs tuning per robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from opspace.errors import ModelError
from opspace.robots.motor_range import motor_range
from opspace.robots.protocol import Robot
from opspace.robots.sampled_postures import sample_postures
from opspace.tasks import Task
from opspace.tasks.motion_task import MotionTask

UNKNOWN_BRAKE = 20.0
"""Braking acceleration where the torque limit is not known, rad/s²."""
BRAKE_RANGE = (2.0, 50.0)
"""Braking accelerations outside are not believed: the first is a joint that can hardly hold its own
weight in some posture, the second a wrist that other joints could not follow."""

STRUCTURAL = 1e-6
"""An eigenvalue below this fraction is zero in every posture: the arm has too few joints."""
MASSLESS = 1e-12
"""Part of the largest inertia in a joint below which another has none."""


@dataclass(frozen=True)
class Calibration:
    """Scales of a robot over its workspace.

    Attributes:
        brake: (n,) acceleration that half of the torque left by gravity gives each joint alone, the
            least over the workspace, rad/s².
        joint_sigma: Smallest eigenvalue of A⁻¹ over the workspace, 1/(kg·m²).
        references: Per name of a task that was in the stack at the start (m,): what is usual for the
            smallest eigenvalue of the task's J A⁻¹ Jᵀ, one value for its rows in m and one for those
            in rad, 1/kg and 1/(kg·m²), see `Workspace.reference`.
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
        joint_sigma, motors = np.inf, motor_range(robot)
        robot.update(robot.q_reference, np.zeros(robot.nv))
        _checked_inertia(robot)
        for q in sample_postures(robot):
            robot.update(q, np.zeros(robot.nv))
            inverse = np.linalg.inv(_checked_inertia(robot))
            joint_sigma = min(joint_sigma, float(np.linalg.eigvalsh(inverse)[0]))
            spare = np.maximum(motors.limit - np.abs(robot.bias - motors.middle), 0.0)  # at rest
            brake = np.minimum(brake, 0.5 * spare * np.diag(inverse))
            self._visited.append((q, inverse))
        self.brake = np.where(np.isfinite(brake), np.clip(brake, *BRAKE_RANGE), UNKNOWN_BRAKE)
        self.joint_sigma = joint_sigma

    def reference(self, task: Task) -> np.ndarray:
        """Take the scale of a task's rows: what is usual for their smallest eigenvalue σ.

        It is the median over the workspace of σ, for rows in m and for rows in rad. How well a frame
        turns depends on whether its origin is held meanwhile: on a long arm σ then is up to forty
        times smaller. Rows in rad take twice the median with the origin held where that is less, so
        that an orientation below a position is not taken for singular in ordinary postures. A task
        with both kinds of rows is scaled once more by the median σ of all of them together.

        Args:
            task: A task that no tick is using; it is left bound to a copy of the robot.

        Returns:
            (m,) references, 1/kg or 1/(kg·m²).
        """
        robot = self._robot
        task.bind(robot)
        alone: list[np.ndarray] = []
        held: list[float] = []
        everything: list[np.ndarray] = []
        angular = np.array(task.units) == "rad"
        for q, inverse in self._visited:
            robot.update(q, np.zeros(robot.nv))
            J = task.evaluate(robot, 0.0).J
            everything.append(J @ inverse @ J.T)
            alone.append(_smallest_per_unit(task, everything[-1]))
            if isinstance(task, MotionTask) and angular.any():
                origin = task.source.measure(robot).J[:3]
                held.append(_smallest_while_held(J[angular], origin, inverse))
        reference = np.median(alone, axis=0)
        if held and np.median(held) > STRUCTURAL * reference[angular][0]:
            reference[angular] = np.minimum(reference[angular], 2.0 * np.median(held))
        weight = np.sqrt(np.outer(reference, reference))
        # A frame that nothing moves has no scale.
        if angular.any() and not angular.all() and np.all(weight > 0.0):
            together = np.median([np.linalg.eigvalsh(S / weight)[0] for S in everything])
            if together > STRUCTURAL:
                reference = reference * together
        return reference


def _checked_inertia(robot: Robot) -> np.ndarray:
    """The inertia, which every joint must have some of that the ones before it do not move alike."""
    M = robot.M
    if not np.all(np.isfinite(M)):
        raise _no_inertia(robot, "check the masses")
    try:
        own = np.linalg.cholesky(M).diagonal() ** 2
    except np.linalg.LinAlgError:
        own = _own_inertia(M)
    still = own <= MASSLESS * max(float(M.diagonal().max()), 0.0)
    if np.any(still):
        names = [joint for joint, s in zip(robot.joint_names, still, strict=True) if s]
        raise _no_inertia(
            robot,
            f"joint {', '.join(map(repr, names))} moves no mass of its own: give the links a mass and "
            "an inertia (<inertial> in a URDF), or hold the joint (locked=)",
        )
    return M


def _own_inertia(M: np.ndarray) -> np.ndarray:
    """Return what inertia each joint has while those before it are free to give way, (n,)."""
    own = M.diagonal().copy()
    for i in range(1, len(M)):
        own[i] -= M[i, :i] @ np.linalg.lstsq(M[:i, :i], M[:i, i], rcond=MASSLESS)[0]
    return own


def _no_inertia(robot: Robot, why: str) -> ModelError:
    return ModelError(f"robot {robot.name!r}: its inertia is not positive definite; {why}")


def _smallest_per_unit(task: Task, inverse_inertia: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of the block of J A⁻¹ Jᵀ that each row shares a unit with, (m,).

    A direction that the arm does not have in any posture is nothing that it could lose.
    """
    units = np.array(task.units)
    result = np.zeros(task.rows)
    for unit in set(task.units):
        rows = units == unit
        sigma = np.linalg.eigvalsh(inverse_inertia[np.ix_(rows, rows)])
        there = sigma[sigma > STRUCTURAL * sigma[-1]]
        result[rows] = there[0] if there.size else np.finfo(float).tiny
    return result


def _smallest_while_held(J: np.ndarray, held: np.ndarray, inverse: np.ndarray) -> float:
    """Smallest eigenvalue of J A⁻¹ Nᵀ Jᵀ in the motions that leave the rows ``held`` alone."""
    basis = np.linalg.cholesky(inverse)
    _, s, Vt = np.linalg.svd(held @ basis)
    free = Vt[int(np.sum(s > 1e-9 * s[0])) :]
    projected = J @ basis @ free.T
    return float(np.linalg.eigvalsh(projected @ projected.T)[0])
