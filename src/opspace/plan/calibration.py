"""What a controller derives from its robot, so that nothing needs tuning per robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import islice

import numpy as np

from opspace.errors import ModelError
from opspace.robots.motor_range import motor_range
from opspace.robots.protocol import Robot
from opspace.robots.sampled_postures import sample_postures
from opspace.tasks import PostureTask, Task
from opspace.tasks.motion_task import MotionTask

UNKNOWN_BRAKE = 20.0
"""Braking acceleration where the torque limit is not known, rad/s²."""
BRAKE_RANGE = (2.0, 50.0)
"""Braking accelerations outside are not believed: the first is a joint that can hardly hold its own
weight in some posture, the second a wrist that other joints could not follow."""

STRUCTURAL = 1e-6
"""An eigenvalue below this fraction is zero in every posture: the arm has too few joints."""
PROBES = 3
"""Where rows are the same to the last bit in so many postures of one robot, they are the same rows."""
KNOWN: dict[bytes, np.ndarray] = {}
"""References that have been found in this process, by all that they follow from."""
MOST_KNOWN = 1024

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
        self._still = np.zeros(robot.nv)
        motors = motor_range(robot)
        robot.update(robot.q_reference, self._still)
        _check_inertias(robot, robot.M[np.newaxis])
        self._postures = list(sample_postures(robot))
        visited = [(robot.M.copy(), robot.bias.copy()) for _ in self._visit()]
        inertias, at_rest = (np.array(part) for part in zip(*visited, strict=True))
        _check_inertias(robot, inertias)
        self._inverses = np.linalg.inv(inertias)
        self._stamp = sha256(inertias.tobytes()).digest()
        self.joint_sigma = float(np.linalg.eigvalsh(self._inverses)[:, 0].min())
        spare = np.maximum(motors.limit - np.abs(at_rest - motors.middle), 0.0)
        brake = np.min(0.5 * spare * np.diagonal(self._inverses, axis1=1, axis2=2), axis=0)
        self.brake = np.where(np.isfinite(brake), np.clip(brake, *BRAKE_RANGE), UNKNOWN_BRAKE)

    def _visit(self) -> Iterator[Robot]:
        """Take the copy of the robot through all postures, at rest."""
        for q in self._postures:
            self._robot.update(q, self._still)
            yield self._robot

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
        task.bind(self._robot)
        key = self._key(task)
        known = None if key is None else KNOWN.get(key)
        if known is not None:
            return known.copy()
        found = self._found(task)
        if key is not None:
            if len(KNOWN) >= MOST_KNOWN:
                KNOWN.clear()
            KNOWN[key] = found.copy()
        return found

    def _key(self, task: Task) -> bytes | None:
        """Write down what the reference of a task follows from; None for rows that others define."""
        if not isinstance(task, MotionTask) or type(task).evaluate is not MotionTask.evaluate:
            return None
        parts = [self._stamp, type(task.source).__name__.encode(), repr(task.units).encode()]
        for robot in islice(self._visit(), PROBES):
            parts += [task.evaluate(robot, 0.0).J.tobytes(), task.source.measure(robot).J.tobytes()]
        return sha256(b"|".join(parts)).digest()

    def _found(self, task: Task) -> np.ndarray:
        """Visit all postures for the reference of a task."""
        angular = np.array(task.units) == "rad"
        below_origin = isinstance(task, MotionTask) and angular.any()
        jacobians: list[np.ndarray] = []
        origins: list[np.ndarray] = []
        # Joints are the same rows in every posture.
        for robot in islice(self._visit(), 1 if isinstance(task, PostureTask) else None):
            jacobians.append(task.evaluate(robot, 0.0).J)
            if isinstance(task, MotionTask) and below_origin:
                origins.append(task.source.measure(robot).J[:3])
        J = np.array(jacobians)
        everything = J @ self._inverses @ J.mT
        reference = np.median(_smallest_per_unit(task, everything), axis=0)
        if below_origin:
            held = np.median(_smallest_while_held(J[:, angular], np.array(origins), self._inverses))
            if held > STRUCTURAL * reference[angular][0]:
                reference[angular] = np.minimum(reference[angular], 2.0 * held)
        weight = np.sqrt(np.outer(reference, reference))
        # A frame that nothing moves has no scale.
        if angular.any() and not angular.all() and np.all(weight > 0.0):
            together = np.median(np.linalg.eigvalsh(everything / weight)[:, 0])
            if together > STRUCTURAL:
                reference = reference * together
        return reference


def _check_inertias(robot: Robot, inertias: np.ndarray) -> None:
    """Refuse a joint that has no inertia but what the ones before it move alike, in any posture."""
    if not np.all(np.isfinite(inertias)):
        raise _no_inertia(robot, "check the masses")
    diagonals = np.diagonal(inertias, axis1=1, axis2=2)
    try:
        own = np.diagonal(np.linalg.cholesky(inertias), axis1=1, axis2=2) ** 2
    except np.linalg.LinAlgError:
        own = np.array([_own_inertia(M) for M in inertias])
    still = np.any(own <= MASSLESS * np.maximum(diagonals.max(axis=1), 0.0)[:, np.newaxis], axis=0)
    if np.any(still):
        names = [joint for joint, s in zip(robot.joint_names, still, strict=True) if s]
        raise _no_inertia(
            robot,
            f"joint {', '.join(map(repr, names))} moves no mass of its own: give the links a mass and "
            "an inertia (<inertial> in a URDF), or hold the joint (locked=)",
        )


def _own_inertia(M: np.ndarray) -> np.ndarray:
    """Return what inertia each joint has while those before it are free to give way, (n,)."""
    own = M.diagonal().copy()
    for i in range(1, len(M)):
        own[i] -= M[i, :i] @ np.linalg.lstsq(M[:i, :i], M[:i, i], rcond=MASSLESS)[0]
    return own


def _no_inertia(robot: Robot, why: str) -> ModelError:
    return ModelError(f"robot {robot.name!r}: its inertia is not positive definite; {why}")


def _smallest_per_unit(task: Task, inverse_inertias: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of the block of J A⁻¹ Jᵀ that each row shares a unit with, (postures, m).

    A direction that the arm does not have in any posture is nothing that it could lose.
    """
    units = np.array(task.units)
    result = np.zeros((len(inverse_inertias), task.rows))
    for unit in set(task.units):
        rows = np.flatnonzero(units == unit)
        sigma = np.linalg.eigvalsh(inverse_inertias[:, rows[:, np.newaxis], rows])
        there = np.where(sigma > STRUCTURAL * sigma[:, -1:], sigma, np.inf).min(axis=1)
        result[:, rows] = np.where(np.isfinite(there), there, np.finfo(float).tiny)[:, np.newaxis]
    return result


def _smallest_while_held(J: np.ndarray, held: np.ndarray, inverses: np.ndarray) -> np.ndarray:
    """Smallest eigenvalues of J A⁻¹ Nᵀ Jᵀ in the motions that leave the rows ``held`` alone."""
    basis = np.linalg.cholesky(inverses)
    _, s, Vt = np.linalg.svd(held @ basis)
    beyond = (
        np.arange(Vt.shape[-1])[np.newaxis] >= np.sum(s > 1e-9 * s[:, :1], axis=1)[:, np.newaxis]
    )
    projected = J @ basis @ (Vt * beyond[:, :, np.newaxis]).mT
    return np.linalg.eigvalsh(projected @ projected.mT)[:, 0]
