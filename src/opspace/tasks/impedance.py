"""A spring and a damper between a frame and its target."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.law.scalars import LIGHTEST
from opspace.tasks.motion_task import AxesFrame, MotionTask
from opspace.tasks.motions import WorldFrame, as_offset
from opspace.tasks.quantities import Pose, Position
from opspace.tasks.references.sample import Reference
from opspace.tasks.task import TaskTerms
from opspace.tasks.validation import Array, finite_array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


class ImpedanceTask(MotionTask):
    r"""Holds a frame at its target like a spring with a damper, whatever mass it moves.

        f* = ẍ_d + σ (K e + D ė + F),        σ = J A⁻¹ Jᵀ,   D_i = 2 ζ √(K_i / σ_ii)

    At the top of the stack that is the torque Jᵀ (K e + D ė + F), and a push P moves the frame by P/K at
    rest. The inertia is the natural one; no matrix is inverted, so a direction in which the arm cannot
    move asks for nothing. It needs no wrench.

    Args:
        frame: Name of the frame; None is the robot's tool.
        target: (3,) position, or with six numbers of stiffness a pose as of `PoseTask`; a reference, or
            None to hold what is found first.
        stiffness: K, a number or (3,), N/m, for the position; or (6,), the last three N·m/rad.
        damping_ratio: ζ, 1 is critical.
        force: Force on the environment beside the spring's, (3,) N or (6,) with N·m; None is none.
        axes_frame: Whether the rows are along the axes of the world or of the frame ("tool").
        offset: (3,) point in the frame's axes, m; None is the frame's origin.
        name: Name of the task.

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        frame: str | None = None,
        target: ArrayLike | Reference | None = None,
        *,
        stiffness: ArrayLike = 500.0,
        damping_ratio: float = 1.0,
        force: ArrayLike | None = None,
        axes_frame: AxesFrame = "world",
        offset: ArrayLike | None = None,
        name: str = "impedance",
    ) -> None:
        K = np.asarray(stiffness, dtype=float)
        pose = K.shape == (6,)
        rows = 6 if pose else 3
        super().__init__(
            name,
            source=WorldFrame(frame, as_offset(offset, name)),
            quantity=Pose() if pose else Position(),
            target=target,
            selection=np.eye(rows),
            axes_frame=axes_frame,
            kp=0.0,
            kv=0.0,
            max_speed=None,
        )
        self._force = np.zeros(rows)
        self._stiffness, self._ratio = np.zeros(rows), 0.0
        self.stiffness, self.damping_ratio = K, damping_ratio
        if force is not None:
            self.force = force

    @property
    def stiffness(self) -> Array:
        """K of every row, N/m and N·m/rad."""
        return self._stiffness.copy()

    @stiffness.setter
    def stiffness(self, value: ArrayLike) -> None:
        K = np.asarray(value, dtype=float)
        K = np.full(self.rows, K) if K.ndim == 0 else K
        K = finite_array(K, (self.rows,), f"task {self.name!r}: stiffness")
        if np.any(K < 0.0):
            raise InputError(f"task {self.name!r}: stiffness must be at least zero, not {K}")
        self._stiffness = K

    @property
    def damping_ratio(self) -> float:
        """ζ, 1 is critical."""
        return self._ratio

    @damping_ratio.setter
    def damping_ratio(self, value: float) -> None:
        if not (np.isfinite(value) and value >= 0.0):
            raise InputError(
                f"task {self.name!r}: damping_ratio must be finite and at least zero, not {value}"
            )
        self._ratio = float(value)

    @property
    def force(self) -> Array:
        """Force on the environment beside the spring's, N and N·m; assigned, it steps."""
        return self._force.copy()

    @force.setter
    def force(self, value: ArrayLike) -> None:
        self._force = finite_array(value, (self.rows,), f"task {self.name!r}: force")

    @property
    def kp(self) -> float:
        """0: an impedance task has a stiffness."""
        return 0.0

    @kp.setter
    def kp(self, value: object) -> None:
        raise InputError(f"task {self.name!r}: an impedance task has a stiffness, no kp")

    @property
    def kv(self) -> float:
        """0: an impedance task has a damping_ratio."""
        return 0.0

    @kv.setter
    def kv(self, value: object) -> None:
        raise InputError(f"task {self.name!r}: an impedance task has a damping_ratio, no kv")

    @property
    def max_speed(self) -> None:
        """None: a spring limits no speed."""
        return None

    @max_speed.setter
    def max_speed(self, value: object) -> None:
        raise InputError(f"task {self.name!r}: an impedance task limits no speed")

    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state."""
        desired = self.asked(robot, t)
        motion, block = self.source.measure(robot), self.quantity.block
        basis = self._basis(robot)
        J = basis @ motion.J[block]
        error = basis @ self.quantity.error(motion, desired.x)
        rate = basis @ (desired.v - motion.velocity[block])
        sigma = J @ np.linalg.solve(robot.M, J.T)
        light = np.maximum(np.diagonal(sigma), LIGHTEST)
        damping = 2.0 * self._ratio * np.sqrt(self._stiffness / light)
        pull = self._stiffness * error + damping * rate + self._force
        return TaskTerms(
            J=J,
            drift=basis @ motion.drift[block],
            acceleration=basis @ desired.a + sigma @ pull,
            error=error,
        )

    def _words(self) -> list[str]:
        return [f"stiffness={self._stiffness.tolist()}", f"damping_ratio={self._ratio:g}"]
