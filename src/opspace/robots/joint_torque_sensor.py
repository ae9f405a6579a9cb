"""What the torques that joints feel say of the wrench at a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


class JointTorqueSensor:
    r"""Estimates the wrench at a frame from the torque that the world puts on the joints.

    For robots without a sensor at the wrist that measure or estimate joint torques. With the torque
    τ_e that the environment puts on the joints, of all wrenches at the frame the one that explains it
    best in the metric A⁻¹, whose negative is what the robot exerts,

        F = −(J A⁻¹ Jᵀ)⁻¹ J A⁻¹ τ_e

    so that what pushes elsewhere on a redundant arm is seen only as far as it moves the frame. In a
    direction in which the arm can hardly move, 1/σ of that matrix is large and so is what becomes of an
    error of τ_e: it fades from the estimate as σ falls through ``fade``, and the estimate is 0 there.
    Moments are put beside forces by a lever.

    Args:
        robot: The robot; it is left alone.
        frame: Name of the frame that touches; None is the tool.
        moments: Whether moments are estimated as well. With False all is put down to a force at the
            frame's origin, which is more exact where a point touches.
        lever: What a moment is divided by to count like a force, m.
        fade: Eigenvalues σ (absent, full) of J A⁻¹ Jᵀ, 1/kg.

    Raises:
        InputError: Numbers that cannot be used.
        UnknownNameError: The robot has no such frame.
    """

    def __init__(
        self,
        robot: Robot,
        frame: str | None = None,
        *,
        moments: bool = True,
        lever: float = 0.1,
        fade: tuple[float, float] = (0.002, 0.01),
    ) -> None:
        if not 0.0 < fade[0] < fade[1] < np.inf:
            raise InputError(f"fade of a joint torque sensor must be 0 < absent < full, not {fade}")
        if not 0.0 < lever < np.inf:
            raise InputError(f"lever of a joint torque sensor must be above 0 m, not {lever}")
        self._robot = robot.fresh()
        self.frame = robot.tool if frame is None else frame
        self._id = self._robot.frame_id(self.frame)
        self._levers = np.array([1.0, 1.0, 1.0, lever, lever, lever])[: 6 if moments else 3]
        self._fade = fade

    def wrench(self, q: ArrayLike, external: ArrayLike) -> np.ndarray:
        """Return the wrench on the environment as `opspace.Controller.step` takes it.

        Args:
            q: (nq,) configuration, rad.
            external: (n,) torque that the environment puts on the joints, N·m; some robots tell the
                negative, check it once by pressing.

        Returns:
            (6,) N and N·m, in world axes at the frame's origin.

        Raises:
            InputError: An argument that is not so many finite numbers.
        """
        robot, levers = self._robot, self._levers
        felt = np.array(external, dtype=float)
        if felt.shape != (robot.nv,) or not np.all(np.isfinite(felt)):
            raise InputError(f"external torques must be {robot.nv} finite numbers, got {external}")
        robot.update(np.array(q, dtype=float), np.zeros(robot.nv))
        J = levers[:, None] * robot.jacobian(self._id)[: levers.size]
        moved = np.linalg.solve(robot.M, np.column_stack([J.T, felt]))
        sigma, axes = np.linalg.eigh(J @ moved[:, :-1])
        absent, full = self._fade
        part = np.clip((sigma - absent) / (full - absent), 0.0, 1.0)
        seen = part * part * (3.0 - 2.0 * part)
        parts = axes.T @ (J @ moved[:, -1]) * seen / np.maximum(sigma, absent)
        found = np.zeros(6)
        found[: levers.size] = -levers * (axes @ parts)
        return found

    def wrenches(self, q: ArrayLike, external: ArrayLike) -> dict[str, np.ndarray]:
        """Return the same under the name of the frame, as drivers hand it on."""
        return {self.frame: self.wrench(q, external)}
