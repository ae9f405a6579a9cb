"""What a simulated tool may touch: flat pieces that push back like springs, with friction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from opspace.errors import InputError

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot
    from opspace.sim.hole import Hole

CREEP = 1e-3
"""Speed along a surface up to which friction grows, m/s."""


@dataclass(frozen=True)
class Surface:
    """A flat surface that a point of the robot can press.

    At the depth d the force along the normal is k d + b ḋ and never pulls; friction is μ times that,
    against the motion along the surface. Unlike MuJoCo's own contacts, whose force depends on how
    fast the tool slides, it is what a controller of forces should be tested with. With a ``give`` the
    surface is that of a button: soft as far as that, then as stiff as said.

    Attributes:
        point: (3,) a point of it, m; its middle where it has a size.
        normal: (3,) direction out of it.
        stiffness: k, N/m.
        friction: μ.
        damping: b, N·s/m.
        size: Radius in which it is flat, m; inf is everywhere.
        bevel: Width of the rim beyond, which falls away down to 45° and ends there, m.
        give: How far it is soft, m.
        soft_stiffness: Its stiffness as far as that, N/m.
    """

    point: Sequence[float]
    normal: Sequence[float] = (0.0, 0.0, 1.0)
    stiffness: float = 1e5
    friction: float = 0.3
    damping: float = 0.0
    size: float = math.inf
    bevel: float = 0.0
    give: float = 0.0
    soft_stiffness: float = 1000.0

    def __post_init__(self) -> None:
        for name in ("point", "normal"):
            found = np.asarray(getattr(self, name), dtype=float)
            if found.shape != (3,) or not np.all(np.isfinite(found)):
                raise InputError(f"{name} of a surface must be 3 finite numbers, got {found}")
        if not np.linalg.norm(self.normal) > 0.0:
            raise InputError("the normal of a surface must point somewhere")
        for name in ("stiffness", "soft_stiffness", "size"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"{name} of a surface must be above 0, got {getattr(self, name)}")
        for name in ("friction", "damping", "give", "bevel"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise InputError(
                    f"{name} of a surface must be finite and >= 0, got {getattr(self, name)}"
                )

    def force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the force on a point, N.

        Args:
            x: (3,) the point, m.
            v: (3,) its velocity, m/s.

        Returns:
            (3,) zero where it is not touched.
        """
        n = np.asarray(self.normal, dtype=float) / np.linalg.norm(self.normal)
        away = x - np.asarray(self.point, dtype=float)
        below = -float(n @ away)
        outwards = away + below * n
        radius = float(np.linalg.norm(outwards))
        past = max(radius - self.size, 0.0)
        if below <= 0.0 or past > self.bevel:
            return np.zeros(3)
        # The rim falls by past²/(2 bevel): its slope is the gradient of the depth.
        slope = past / self.bevel if past > 0.0 else 0.0
        depth = below - 0.5 * slope * past
        if depth <= 0.0:
            return np.zeros(3)
        up = n + slope * outwards / radius if slope > 0.0 else n
        soft = min(depth, self.give)
        spring = self.soft_stiffness * soft + self.stiffness * (depth - soft)
        normal = max(spring - self.damping * float(up @ v), 0.0)
        along = v - (up @ v) / (up @ up) * up
        rubbing = self.friction * np.linalg.norm(up) / math.hypot(np.linalg.norm(along), CREEP)
        return normal * (up - rubbing * along)


class TouchedWorld:
    """What is around one point of a robot.

    Args:
        robot: The robot; it is left alone.
        surfaces: What its point may touch.
        holes: Holes for a peg that ends there.
        frame: Name of the frame whose origin touches; None is the tool.
    """

    def __init__(
        self,
        robot: Robot,
        surfaces: Sequence[Surface],
        holes: Sequence[Hole] = (),
        frame: str | None = None,
    ) -> None:
        self.surfaces, self.holes = tuple(surfaces), tuple(holes)
        self.name = robot.tool if frame is None else frame
        self._robot = robot.fresh() if self else robot
        self._frame = robot.frame_id(self.name)
        self.wrench = np.zeros(6)

    def __bool__(self) -> bool:
        """Whether there is anything."""
        return bool(self.surfaces or self.holes)

    def torque(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return Jᵀ F of all that is touched, (n,) N·m, and keep what the robot exerts on it."""
        robot, frame = self._robot, self._frame
        robot.update(q, v)
        x, twist, J = robot.position(frame), robot.velocity(frame), robot.jacobian(frame)
        force, torque = np.zeros(3), np.zeros(robot.nv)
        if self.surfaces:
            force = np.sum([surface.force(x, twist[:3]) for surface in self.surfaces], axis=0)
            torque = J[:3].T @ force
        self.wrench = np.concatenate([-force, np.zeros(3)])
        for hole in self.holes:
            wrench = hole.wrench(x, robot.rotation(frame), twist)
            self.wrench -= wrench
            torque = torque + J.T @ wrench
        return torque
