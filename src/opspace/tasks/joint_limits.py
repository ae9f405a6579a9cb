"""Joint limits, one per joint and side: bounds on what the stack may do, or task sets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.law import PROFILES
from opspace.law.scalars import LIMIT_LAWS, Approach, allowed_speed
from opspace.tasks.known_attributes import KnownAttributes
from opspace.tasks.validation import Array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

T = TypeVar("T")
OWN_SPEEDS: Mapping[str, float] = MappingProxyType({})
"""The speed limits of the robot, none of them replaced."""


@dataclass(frozen=True)
class Side:
    """One limit of one joint.

    Attributes:
        joint: Name of the joint.
        index: Its velocity coordinate.
        sign: +1 for the upper limit, −1 for the lower one.
        limit: Position of the limit, rad or m.
        brake: Acceleration with which the joint can be counted on to brake, rad/s² or m/s².
        speed: Largest speed in this direction, rad/s or m/s; inf where there is none.
    """

    joint: str
    index: int
    sign: float
    limit: float
    brake: float
    speed: float = math.inf

    @property
    def name(self) -> str:
        """The side's name in diagnostics, for example ``joint1/upper``."""
        return f"{self.joint}/{'upper' if self.sign > 0 else 'lower'}"


class JointLimits(KnownAttributes):
    r"""Keep joints inside their limits, whatever the tasks ask for.

    With d the distance to the limit, v the joint's speed towards it and a the braking acceleration,

        v_adm(d) = k₁ d                    for 0 <= d <= a/k₁²
                   √(2 a (d − a/2k₁²))     beyond            (constant braking; C¹ where they meet)
                   −v_r tanh(k₁ |d| / v_r) outside the limit
        q̈_adm = min(−v v_adm'(d) + k₂ (v_adm(d) − v), k₂ (v_max − v))

    is the largest acceleration towards the limit from which the joint still stops at it, and with
    which it does not become faster than v_max. A joint that comes faster than v_adm brakes more, as
    much as its motors give, see `opspace.law.scalars.stopping_command`.

    In mode ``admissible`` it is a bound: the controller answers the acceleration nearest to what the
    stack wants among those that no joint's q̈_adm forbids, see `opspace.law.nearest`. The whole
    range is usable, and a limit only ever pushes inwards and lets go by itself.

    In mode ``buffer`` the activation rises with the position, from 0 at the inner edge of the buffer
    to 1 at the limit (Section 4.2, Fig. 7), and the task set pulls back to the inner edge; a target
    at the limit would hold the joint there for ever. The inner edge retreats by the braking
    distance v²/2a.

    Args:
        buffer: Width of the position buffer, rad or m; used in mode ``buffer``.
        mode: A name in `opspace.law.scalars.LIMIT_LAWS`.
        joints: Limits (lower, upper) by joint name that replace the robot's own, rad or m.
        speeds: Largest speed by joint name in place of the robot's own, rad/s or m/s, inf for none;
            None limits no speed. Used in mode ``admissible``.
        clearance: How far inside its limits every joint is kept, rad or m. An acceleration that is wrong
            by δ, because masses or friction are, lets a joint rest δ/(k₁ k₂) beyond where it should.
        brake_acceleration: a, rad/s² or m/s²; None derives it per joint from the torque limits.
        observer_time: Time with which the limits learn the acceleration δ that the model does not
            explain, s: 0.002 to 0.01 lets them hold although masses are wrong by a fifth. q̈_adm counts
            without it. The torques must really go to the joints, tick by tick, which takes a
            controller with ``torque_limits="priority"``.
            None trusts the model. Used in mode ``admissible``.
        profile: Name of the activation profile.

    Raises:
        InputError: A number that cannot be used.
        UnknownNameError: An unknown mode; at binding an unknown joint.
    """

    k1 = 10.0
    k2 = 20.0
    kp = 400.0

    def __init__(
        self,
        buffer: float = 0.1,
        *,
        mode: str = "admissible",
        joints: Mapping[str, Sequence[float]] | None = None,
        speeds: Mapping[str, float] | None = OWN_SPEEDS,
        clearance: float = 0.0,
        observer_time: float | None = None,
        brake_acceleration: float | None = None,
        profile: str = "quintic",
    ) -> None:
        if mode not in LIMIT_LAWS:
            raise unknown_name("joint-limit mode", mode, LIMIT_LAWS)
        if not (math.isfinite(buffer) and buffer > 0.0):
            raise InputError(f"joint limits: buffer must be above 0, got {buffer}")
        if brake_acceleration is not None and not (
            math.isfinite(brake_acceleration) and brake_acceleration > 0.0
        ):
            raise InputError(
                f"joint limits: brake_acceleration must be above 0, got {brake_acceleration}"
            )
        if not (math.isfinite(clearance) and clearance >= 0.0):
            raise InputError(f"joint limits: clearance must be at least 0, got {clearance}")
        if observer_time is not None and not (math.isfinite(observer_time) and observer_time > 0.0):
            raise InputError(f"joint limits: observer_time must be above 0 s, got {observer_time}")
        self.buffer = float(buffer)
        self.observer_time = observer_time
        self.clearance = float(clearance)
        self.mode = mode
        self.law = LIMIT_LAWS[mode]
        self.profile = profile
        self.brake_acceleration = brake_acceleration
        ranges, largest = _by_joint("joints", joints), _by_joint("speeds", speeds)
        self._joints = {name: _pair(name, limits) for name, limits in ranges.items()}
        self._limits_speed = speeds is not None and LIMIT_LAWS[mode].bound
        self._speeds = {name: _speed(name, speed) for name, speed in largest.items()}
        self.sides: tuple[Side, ...] = ()

    def __repr__(self) -> str:
        width = (
            f"buffer={self.buffer:g}" if self.mode == "buffer" else f"clearance={self.clearance:g}"
        )
        return f"{type(self).__name__}(mode={self.mode!r}, {width}, {len(self.sides)} sides)"

    def bind(self, robot: Robot, brake: Array) -> None:
        """Find the limited joints of a robot.

        Args:
            robot: The robot.
            brake: Braking acceleration of every joint, (n,), used where none was given.

        Raises:
            UnknownNameError: A joint that the robot does not have.
            InputError: The clearance leaves a joint no range.
        """
        for name in (*self._joints, *self._speeds):
            if name not in robot.joint_names:
                raise unknown_name("joint", name, robot.joint_names)
        sides: list[Side] = []
        for index, joint in enumerate(robot.joint_names):
            own = (float(robot.q_lower[index]), float(robot.q_upper[index]))
            limits = self._inside(joint, self._joints.get(joint, own))
            a = float(brake[index]) if self.brake_acceleration is None else self.brake_acceleration
            speed = math.inf
            if self._limits_speed:
                speed = self._speeds.get(joint, float(robot.velocity_limit[index]))
            sides += [
                Side(joint, index, sign, limit, a, speed)
                for sign, limit in zip((-1.0, 1.0), limits, strict=True)
                if math.isfinite(limit) or math.isfinite(speed)
            ]
        self.sides = tuple(sides)

    def _inside(self, joint: str, limits: tuple[float, float]) -> tuple[float, float]:
        lower, upper = limits[0] + self.clearance, limits[1] - self.clearance
        if lower >= upper:
            raise InputError(
                f"joint limits: a clearance of {self.clearance:g} leaves no range to {joint!r}, "
                f"which has {limits[0]:g} to {limits[1]:g}"
            )
        return lower, upper

    def margin(self, side: Side) -> float:
        """Acceleration that a limit takes from its joint when told fully active, rad/s² or m/s²."""
        return 0.25 * side.brake

    def admissible(self, side: Side, position: float, speed: float) -> float:
        """Acceleration towards a limit that its task set asks for, at most where the joint does less.

        Args:
            side: The limit.
            position: Joint position, rad or m.
            speed: Joint velocity (in the joint's own direction), rad/s or m/s.

        Returns:
            q̈_adm; in mode ``buffer`` f* of Eq. 24 with the inner edge as target, rad/s² or m/s².
        """
        d, towards = side.sign * (side.limit - position), side.sign * speed
        return self.law.command(
            d, towards, side.brake, side.speed, self.k1, self.k2, self.kp, self.buffer
        )

    def presence(self, side: Side, position: float, speed: float) -> float:
        """Activation of a limit's task set, 0 to 1; in mode ``admissible`` there is none.

        Args:
            side: The limit.
            position: Joint position, rad or m.
            speed: Joint velocity, rad/s or m/s.
        """
        d, towards = side.sign * (side.limit - position), side.sign * speed
        code = PROFILES.index(self.profile)
        return self.law.presence(d, towards, side.brake, self.buffer, code)

    def hurry(
        self, side: Side, position: float, speed: float, most: float, period: float
    ) -> tuple[float, float]:
        """What a joint that is too fast may do, and must do to stop at its limit.

        Args:
            side: The limit.
            position: Joint position, rad or m.
            speed: Joint velocity, rad/s or m/s.
            most: Braking that the motors can give now, rad/s² or m/s²; inf where that is not known.
            period: Time between two ticks, s; 0 where it is not known.

        Returns:
            Acceleration towards the limit that it may have, and the largest with which it does not
            pass, rad/s² or m/s²; inf where it is not too fast, and in mode ``buffer``.
        """
        d, towards = side.sign * (side.limit - position), side.sign * speed
        approach = Approach(d, towards, side.brake, side.speed)
        return self.law.hurries([approach], [most], self.k1, period)[0]

    def commands(self, q: Array, v: Array, *, speeds: bool = True) -> list[float]:
        """Evaluate `admissible` of every side.

        Args:
            q: (n,) joint positions, rad or m.
            v: (n,) joint velocities, rad/s or m/s.
            speeds: Whether speeds are limited, too.
        """
        sides = self.sides if speeds else [replace(s, speed=math.inf) for s in self.sides]
        if self.overridden:
            return [self.admissible(s, float(q[s.index]), float(v[s.index])) for s in sides]
        approaches = self._approaches(q, v, sides)
        return self.law.commands(approaches, self.k1, self.k2, self.kp, self.buffer)

    def presences(self, q: Array, v: Array) -> list[float]:
        """Evaluate `presence` of every side at positions (n,) and velocities (n,)."""
        if self.overridden:
            return [self.presence(s, float(q[s.index]), float(v[s.index])) for s in self.sides]
        code = PROFILES.index(self.profile)
        return self.law.presences(self._approaches(q, v, self.sides), self.buffer, code)

    def hurries(self, q: Array, v: Array, most: Array, period: float) -> list[tuple[float, float]]:
        """Evaluate `hurry` of every side at positions, velocities and for braking, (n,) each."""
        braking = most.tolist()
        if self.overridden:
            return [
                self.hurry(s, float(q[s.index]), float(v[s.index]), braking[s.index], period)
                for s in self.sides
            ]
        given = [braking[s.index] for s in self.sides]
        return self.law.hurries(self._approaches(q, v, self.sides), given, self.k1, period)

    def margins(self) -> list[float]:
        """Evaluate `margin` of every side."""
        return [self.margin(side) for side in self.sides]

    def _approaches(self, q: Array, v: Array, sides: Sequence[Side]) -> list[Approach]:
        positions, speeds = q.tolist(), v.tolist()
        return [
            Approach(
                s.sign * (s.limit - positions[s.index]), s.sign * speeds[s.index], s.brake, s.speed
            )
            for s in sides
        ]

    def allowed_speed(self, side: Side, distance: float) -> float:
        """Speed towards a limit from which the joint still stops at it, v_adm(d), rad/s or m/s."""
        return allowed_speed(distance, side.brake, self.k1)[0]

    @property
    def overridden(self) -> bool:
        """Whether a subclass has a law of its own, which only the readable tick can call."""
        return any(
            getattr(type(self), name) is not getattr(JointLimits, name)
            for name in ("admissible", "presence", "margin", "hurry")
        )


def _by_joint(what: str, given: Mapping[str, T] | None) -> Mapping[str, T]:
    found: object = {} if given is None else given
    if not isinstance(found, Mapping):
        raise InputError(f"joint limits: {what} must be given by joint name, got {found!r}")
    return cast("Mapping[str, T]", found)


def _speed(name: str, speed: float) -> float:
    if not speed > 0.0:
        raise InputError(f"the largest speed of {name!r} must be above 0, got {speed}")
    return float(speed)


def _pair(name: str, limits: Sequence[float]) -> tuple[float, float]:
    values = np.asarray(limits, dtype=float)
    if values.shape != (2,) or np.isnan(values).any() or not values[0] < values[1]:
        raise InputError(f"joint limits of {name!r} must be (lower, upper), got {limits!r}")
    return float(values[0]), float(values[1])
