"""Posture: the robot's joints themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.joint_layout import Layout, joint_layout
from opspace.tasks.references.sample import Reference, Sample
from opspace.tasks.task import TaskTerms
from opspace.tasks.tracking import Target, TrackingTask
from opspace.tasks.validation import Array, finite_array
from opspace.tasks.way_round import JointTurns
from opspace.tasks.ways import VectorWay, Way

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


class PostureTask(TrackingTask):
    """Moves joints to a posture: f* = a_d + kv (v_d − v) + kp (q_d ⊖ q) on the selected rows.

    J is the selected rows of the identity, so the drift is zero. q_d ⊖ q is the robot's
    ``difference``; of a joint that turns without end (a hinge without limits) whole turns are left
    out of it, so that an encoder may wrap and a target may be beyond π. A floating base is left alone
    unless its coordinates are named. Once bound, ``target`` reads back as the entries of q that belong
    to the selected joints.

    Args:
        target: Whole configuration (nq,), or one value for each selected joint (m,), in rad (m
            for prismatic joints); a reference that gives one of these with v and a (m,); or None
            to hold the posture found first.
        kp: Stiffness, a number or one per selected joint, 1/s².
        kv: Damping, a number or one per selected joint, 1/s; None is critical, 2 sqrt(kp).
        joints: Names of the joints to control; None is every actuated joint.
        max_speed: Norm of the joint speed that the error may ask for, rad/s.
        max_acceleration: Acceleration of the way to a new target, rad/s²; see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        name: Name of the task.

    Attributes:
        layout: The joints in the robot's coordinates; None before the task is bound.
        turn: Which way round joints that turn without end went.

    Raises:
        InputError: A gain, target or list of joints that cannot be used.
    """

    def __init__(
        self,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        joints: Sequence[str] | None = None,
        max_speed: float | None = None,
        max_acceleration: float | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str = "posture",
    ) -> None:
        if isinstance(joints, str) or (joints is not None and len(joints) == 0):
            raise InputError(f"task {name!r}: joints must be a list of names, not {joints!r}")
        super().__init__(
            name,
            rows=0,
            units=(),
            motion_size=None,
            kp=kp,
            kv=kv,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
        )
        self._joints = None if joints is None else tuple(joints)
        self.layout: Layout | None = None
        self.turn = JointTurns()
        self.target = target

    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state."""
        desired = self.asked(robot, t)
        layout = self.layout
        assert layout is not None  # bound
        q = robot.q
        q_desired = q.copy()
        q_desired[layout.entries] = desired.x
        error = robot.difference(q, q_desired)[layout.coordinates]
        if layout.endless.any():
            self.turn.follow(q_desired[layout.entries])
            error = self.turn(error, layout.endless)
        velocity_error = desired.v - robot.v[layout.coordinates]
        return TaskTerms(
            J=layout.J,
            drift=layout.drift,
            acceleration=self._gains.acceleration(error, velocity_error, desired.a),
            error=error,
        )

    def reset(self) -> None:
        """Forget the held start value and which way round joints that turn without end went."""
        super().reset()
        self.turn.reset()

    def _current(self, robot: Robot) -> Array:
        layout = self.layout
        assert layout is not None  # bound
        return robot.q[layout.entries]

    def _resolve(self, robot: Robot) -> None:
        layout = joint_layout(robot, self._joints)
        self.layout = layout
        self.rows = self._motion_size = len(layout.coordinates)
        self.units = layout.units
        self._recheck()

    def _way(self, now: Sample, goal: Array, t: float) -> Way:
        layout = self.layout
        assert layout is not None  # bound
        if layout.quaternions:
            raise InputError(
                f"task {self.name!r}: max_acceleration does not go with quaternions "
                f"({', '.join(layout.names)}); give the target as a reference in time"
            )
        way = goal - now.x
        way[layout.endless] = [math.remainder(x, 2.0 * math.pi) for x in way[layout.endless]]
        return VectorWay.to(now, now.x + way, t, self._pace())

    def _recheck(self) -> None:
        """Check again what was given before the robot was known."""
        gains, target = self._gains, self._target
        self._set_gains(gains.kp, None if gains.critical else gains.kv, gains.max_speed)
        what = f"task {self.name!r}: target"
        self._target = Target(
            self._check_value(target.goal, what)
            if isinstance(target.goal, np.ndarray)
            else target.goal,
            self._vector(target.velocity if target.velocity.size else None, f"{what}_velocity"),
            self._vector(
                target.acceleration if target.acceleration.size else None, f"{what}_acceleration"
            ),
        )

    def _check_value(self, value: ArrayLike, what: str) -> Array:
        """Return the configuration entries of the selected joints."""
        values = finite_array(value, (None,), what)
        return values if self.layout is None else self.layout.select(values, what)
