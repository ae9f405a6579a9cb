"""What one task of a fleet is told and tells, robot by robot, as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.fleet.led_targets import TOLD_SIZE
from opspace.fleet.told_arrays import ToldArrays, write_rows
from opspace.fleet.warp_library import robots_of, warp
from opspace.kernels.columns import (
    GOAL_ACCELERATION,
    GOAL_POSITION,
    GOAL_ROTATION,
    GOAL_VELOCITY,
    JOINTS,
    KIND,
    ORIENTATION,
    POSE,
    QUANTITY,
    SPRING,
)
from opspace.law.way_columns import WAY_SIZE
from opspace.machine.field_table import Record
from opspace.tasks import ImpedanceTask, TrackingTask
from opspace.tasks.rotation import quaternion_from_matrix
from opspace.tasks.validation import numbers

START = {ORIENTATION: 3}
"""Where the target of a quantity begins among position and quaternion; others at the first."""


class TaskArrays(ToldArrays):
    """One task of every robot of a fleet.

    Every array is on the device of the fleet, has one row per robot and stays where it is, so that
    a view of it in another library shows the present, too. What a task is told may be written at any
    time between two steps: ``fleet["hand"].target.assign(goals)``.

    Attributes:
        name: Name of the task.
        task: The task that it was made from; its own attributes are not looked at again.
        target: Position (3,), quaternion wxyz (4,), both (7,), or joint positions (m,).
        velocity: Its rate, (3,) or (6,) with the linear part first, or (m,); m/s, rad/s.
        acceleration: The rate of that, m/s², rad/s².
        kp: (m,) stiffness of every row, 1/s²; of springs 0, and not looked at.
        kv: (m,) damping of every row, 1/s; the same.
        activation: A factor of the task's presence in the stack, 0 to 1.
        error: (m,) x_d − x at the last step, m, rad.
        presence: h at the last step, activation included.
        integrates: Whether it has the three that follow: a task with a ``ki``.
        ki: Integral gain, 1/s³; below kp kv, or it diverges.
        max_integral: Error whose pull, kp times it, the integral adds at most, m, rad.
        integral: What it adds to the acceleration, as ``acceleration`` has it.
        is_spring: Whether it has the three that follow: an `ImpedanceTask`.
        stiffness: (m,) K, N/m, N·m/rad.
        damping_ratio: ζ, 1 is critical.
        force: (m,) force on the environment beside the spring's, N, N·m.
        is_paced: Whether it goes to new targets on ways: a task with a ``max_acceleration``.
        begun: When the way of each robot began, s.
        told_motion: Whether it is told the three that follow: a task of motion in a fleet that is given
            the dynamics.
        pose: (7,) position and quaternion wxyz of what the task controls.
        jacobian: (6, n) of that, linear rows first.
        drift: (6,) J̇ q̇ of it.
    """

    def __init__(self, task: TrackingTask, count: int, dtype: Any, device: Any) -> None:
        super().__init__(task, count, dtype, device)
        self._size = 0
        self._joints = False
        self.is_spring = False
        self._start = 0
        self._wishes = np.full(count, task.target is None)

    def begin(self, tick: Record, i: int, rows: slice, *, given: bool) -> None:
        """Take what the task is told from the arrays of a plan in which it is the task ``i``.

        Args:
            tick: The arrays.
            i: Number of the task.
            rows: Its rows.
            given: Whether its motion is given.
        """
        if self._size:
            return
        super().begin(tick, i, rows, given=given and tick.kind[i, KIND] != JOINTS)
        kind, number = tick.kind[i], tick.numbers[i]
        m = rows.stop - rows.start
        if kind[KIND] == JOINTS:
            self._joints, self._size = True, m
            goals = tick.goal[rows]
            target, velocity, acceleration = goals[:, 0], goals[:, 1], goals[:, 2]
        else:
            place = number[GOAL_POSITION : GOAL_POSITION + 3]
            turn = number[GOAL_ROTATION : GOAL_ROTATION + 9].reshape(3, 3)
            quaternion = quaternion_from_matrix(turn if turn.any() else np.eye(3))
            whole = np.concatenate([place, quaternion])
            self._start = START.get(kind[QUANTITY], 0)
            end = 7 if kind[QUANTITY] in (ORIENTATION, POSE) else 3
            target, size = whole[self._start : end], 6 if kind[QUANTITY] == POSE else 3
            self._size = target.size
            velocity = number[GOAL_VELOCITY : GOAL_VELOCITY + size]
            acceleration = number[GOAL_ACCELERATION : GOAL_ACCELERATION + size]
            if kind[SPRING]:
                assert isinstance(self.task, ImpedanceTask)
                self.is_spring = True
                self.stiffness = self._filled(self.task.stiffness)
                self.damping_ratio = self._filled(np.array(self.task.damping_ratio))
                self.force = self._filled(self.task.force)
        if self.task.max_acceleration is not None and self.task.target is not None:
            # The plan has what the task follows, which is the beginning of a way.
            target = self._rows(cast("ArrayLike", self.task.target), 1)[0]
        self.target, self.velocity, self.acceleration = map(
            self._filled, (target, velocity, acceleration)
        )
        self.kp = self._filled(tick.kp[rows])
        if self.task.ki is not None:
            self.integrates = True
            self.ki = self._filled(np.array(self.task.ki))
            self.max_integral = self._filled(np.array(self.task._max_integral))
            self.integral = self._filled(np.zeros(self.acceleration.shape[1]))
        self._turn, self._before = self._filled(np.zeros(4)), self._filled(np.zeros(4))
        self._joint_before = self._filled(np.zeros(m))
        if self.task.max_acceleration is not None:
            self._begin_ways(m)
        self._remembers = self._filled(0)
        self._holds = self._filled(0)
        self._holds.assign(self._wishes.astype(np.int64))

    def _begin_ways(self, rows: int) -> None:
        """Make what a task that goes on ways remembers of them."""
        wp = warp()
        self.is_paced = True
        self._known, self._led = self._filled(0), self._filled(0)
        nothing = np.zeros((rows, 3)) if self._joints else np.eye(TOLD_SIZE)[3]  # a turn by nothing
        self._told = self._filled(nothing, wp.float64)
        self._way = self._filled(np.zeros((rows if self._joints else 6, WAY_SIZE)), wp.float64)
        self._turned = self._filled(np.eye(4)[0], wp.float64)
        self.begun = wp.zeros(self._count, dtype=wp.float64, device=self._device)

    def set_target(
        self,
        value: ArrayLike,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        robots: Any = None,
    ) -> None:
        """Set targets of some robots from Python; they hold nothing any more.

        Args:
            value: One target in the form that the task takes, or rows of ``target``.
            velocity: Desired velocity; None is zero.
            acceleration: Desired acceleration; None is zero.
            robots: None for all, a mask, or their numbers.

        Raises:
            InputError: A value of another shape, not finite or not a rotation.
        """
        mask = robots_of(robots, self._count)
        rows = self._rows(value, int(mask.sum()))
        told = [(self.target, rows)]
        for array, given in ((self.velocity, velocity), (self.acceleration, acceleration)):
            told.append((array, self._checked(0.0 if given is None else given, array, mask)))
        for array, row in told:
            write_rows(array, row, mask)
        self._wishes &= ~mask
        self._holds.assign(self._wishes.astype(np.int64))

    def set_gains(self, kp: ArrayLike, kv: ArrayLike | None = None, robots: Any = None) -> None:
        """Set gains of some robots from Python.

        Args:
            kp: Stiffness, for all rows or one each, 1/s².
            kv: Damping, 1/s; None is critical, 2 √kp.
            robots: None for all, a mask, or their numbers.

        Raises:
            InputError: A gain below 0, not finite or of another shape, or a task that is a spring.
        """
        if self.is_spring:
            raise InputError(
                f"task {self.name!r} is a spring and has no gains; write its stiffness and damping_ratio"
            )
        mask = robots_of(robots, self._count)
        stiffness = self._checked(kp, self.kp, mask)
        critical = 2.0 * np.sqrt(np.maximum(stiffness, 0.0))
        damping = critical if kv is None else self._checked(kv, self.kv, mask)
        if (stiffness < 0.0).any() or (damping < 0.0).any():
            raise InputError(f"task {self.name!r}: gains must be at least 0")
        write_rows(self.kp, stiffness, mask)
        write_rows(self.kv, damping, mask)

    def places(self, i: int, rows: slice) -> Iterator[tuple[str, Any, str, int]]:
        """List the arrays, which way each goes, and where it is: in which array of one robot's tick."""
        first = rows.start
        yield from super().places(i, rows)
        for name in ("target", "velocity", "acceleration"):
            width = 7 if name == "target" else 6
            start = self._start if name == "target" else 0
            way = "in, out where found" if name == "target" else "in"
            if self._joints:
                yield way, getattr(self, name), f"robot.joint_{name}_()", first
            else:
                yield way, getattr(self, name), f"robot.{name}_()", i * width + start
        if self.integrates:
            place = ("joint_integral", first) if self._joints else ("integral", 6 * i)
            yield "in", self.ki, "robot.ki_()", i
            yield "in", self.max_integral, "robot.max_integral_()", i
            yield "in, out", self.integral, f"robot.{place[0]}_()", place[1]
        if self.is_paced:
            yield from self._ways(i, first)
        if self.is_spring:
            yield "in", self.stiffness, "robot.stiffness_()", first
            yield "in", self.force, "robot.spring_force_()", first
            yield "in", self.damping_ratio, "robot.damping_ratio_()", i
        else:
            yield "in", self.kp, "work.kp_()", first
            yield "in", self.kv, "work.kv_()", first
        yield "in", self._holds, "robot.holds_()", i
        yield "in, out", self._remembers, "robot.remembers_()", i
        yield "in, out", self._turn, "robot.turn_()", 4 * i
        if self._joints:
            yield "in, out", self._joint_before, "robot.joint_before_()", first
        else:
            yield "in, out", self._before, "robot.before_()", 4 * i

    @property
    def paces(self) -> list[float]:
        """Speed and acceleration of the task's ways, those of a turn after those of a position; or 0."""
        task = self.task
        if not self.is_paced:
            return [0.0] * 4
        speeds, accelerations = np.atleast_1d(task.max_speed), np.atleast_1d(task.max_acceleration)
        return np.resize(np.stack((speeds, accelerations), axis=1), 4).tolist()

    def _ways(self, i: int, first: int) -> Iterator[tuple[str, Any, str, int]]:
        """List what a task with a ``max_acceleration`` remembers of its ways."""
        yield "in, out", self._known, "work.ways_().known_()", i
        yield "in, out", self._led, "work.ways_().led_()", i
        if self._joints:
            yield "in, out", self._told, "work.ways_().joint_told_()", 3 * first
            yield "in, out", self._way, "work.ways_().joint_parts_()", WAY_SIZE * first
        else:
            yield "in, out", self._told, "work.ways_().told_()", TOLD_SIZE * i
            yield "in, out", self._way, "work.ways_().parts_()", 6 * WAY_SIZE * i
            yield "in, out", self._turned, "work.ways_().turned_()", 4 * i

    def _rows(self, value: ArrayLike, count: int) -> np.ndarray:
        found = numbers(value, f"task {self.name!r}: target")
        if found.shape == (count, self._size):
            turn = found[:, 3 - self._start :] if self._size != 3 and not self._joints else None
            lengths = np.ones(1) if turn is None else np.linalg.norm(turn, axis=1)
            if not np.isfinite(found).all() or not (abs(lengths - 1.0) < 1e-3).all():
                raise InputError(
                    f"task {self.name!r}: targets must be finite, quaternions of length 1"
                )
            return found
        goal = self.task._check_value(value, f"task {self.name!r}: target")
        if self._joints or goal.ndim == 1:
            return np.broadcast_to(goal, (count, self._size))
        turn = np.array(quaternion_from_matrix(goal[:3, :3]))
        row = np.concatenate([goal[:3, 3], turn]) if self._size == 7 else turn
        return np.broadcast_to(row, (count, self._size))
