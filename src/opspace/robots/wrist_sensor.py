"""What a force-torque sensor at the wrist says of the world beyond the tool that hangs on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

EARTH = (0.0, 0.0, -9.81)


class WristSensor:
    r"""Takes the weight and the inertia of the tool out of what a sensor before it measures.

    The sensor measures in its own axes what the robot exerts on the tool through it, force s and moment
    m_s about its origin, as MuJoCo's sensors of force and torque do; others measure the opposite, and
    their readings are to be negated. With the tool's mass m, its centre at r = R c from the sensor, and
    its acceleration a, the robot exerts through the tool on the environment

        F = R s + m (g − a),        M = R m_s + r × m (g − a)

    and at another point x the moment M + (p − x) × F. The tool is taken for a point mass.

    Args:
        frame: Name of the frame at the sensor.
        mass: Mass of everything beyond it, kg; 0 where the sensor does that itself.
        com: (3,) its centre of mass in axes of the sensor, m.
        gravity: (3,) m/s².

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        frame: str,
        *,
        mass: float = 0.0,
        com: ArrayLike = (0.0, 0.0, 0.0),
        gravity: ArrayLike = EARTH,
    ) -> None:
        if not (np.isfinite(mass) and mass >= 0.0):
            raise InputError(f"the mass behind a wrist sensor must be finite and >= 0, not {mass}")
        self.frame = frame
        self.mass = float(mass)
        self.com = _numbers(com, 3, "com of a wrist sensor")
        self.gravity = _numbers(gravity, 3, "gravity of a wrist sensor")
        self.offset = np.zeros(6)

    def tare(self, robot: Robot, reading: ArrayLike) -> None:
        """Call what is measured now, at rest and without contact, the weight of the tool.

        What exceeds the weight is the sensor's offset in its own axes, and stays subtracted.

        Args:
            robot: The robot in the state of the reading.
            reading: (6,) force and moment, N and N·m; the mean of many where it is noisy.

        Raises:
            InputError: Not six finite numbers.
            UnknownNameError: The robot has no frame of the sensor.
        """
        R = robot.rotation(robot.frame_id(self.frame))
        weight = R.T @ (-self.mass * self.gravity)
        expected = np.concatenate([weight, np.cross(self.com, weight)])
        self.offset = _numbers(reading, 6, "the reading of a wrist sensor") - expected

    def wrench(
        self,
        robot: Robot,
        reading: ArrayLike,
        *,
        at: str | None = None,
        acceleration: ArrayLike | None = None,
    ) -> np.ndarray:
        """Return the wrench on the environment as `opspace.Controller.step` takes it.

        Args:
            robot: The robot in the state of the reading.
            reading: (6,) force and moment in axes of the sensor, N and N·m.
            at: Name of the frame at whose origin the moment is wanted; None is the tool.
            acceleration: (n,) joint accelerations, rad/s², by which the inertia of the tool is taken
                out; None leaves it in, which a contact confidence may take for a touch.

        Returns:
            (6,) N and N·m, in world axes.

        Raises:
            InputError: An argument that is not so many finite numbers.
            UnknownNameError: There is no such frame.
        """
        s = _numbers(reading, 6, "the reading of a wrist sensor") - self.offset
        sensor, point = robot.frame_id(self.frame), robot.frame_id(at or robot.tool)
        R = robot.rotation(sensor)
        r = R @ self.com
        weight = self.mass * (self.gravity - self._moving(robot, sensor, r, acceleration))
        force = R @ s[:3] + weight
        moment = R @ s[3:] + np.cross(r, weight)
        arm = robot.position(sensor) - robot.position(point)
        return np.concatenate([force, moment + np.cross(arm, force)])

    def _moving(
        self, robot: Robot, sensor: int, r: np.ndarray, acceleration: ArrayLike | None
    ) -> np.ndarray:
        """Return the acceleration of the tool's centre, m/s²."""
        if acceleration is None:
            return np.zeros(3)
        found = _numbers(acceleration, robot.nv, "acceleration")
        a = robot.jacobian(sensor) @ found + robot.drift(sensor)
        omega = robot.velocity(sensor)[3:]
        return a[:3] + np.cross(a[3:], r) + np.cross(omega, np.cross(omega, r))


def _numbers(value: ArrayLike, size: int, what: str) -> np.ndarray:
    found = np.array(value, dtype=float)
    if found.shape != (size,) or not np.all(np.isfinite(found)):
        raise InputError(f"{what} must be {size} finite numbers, got {value}")
    return found
