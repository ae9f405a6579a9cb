"""Orientation of a frame of the robot."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.tasks.motion_task import AxesFrame, MotionTask, axes_selection
from opspace.tasks.motions import WorldFrame
from opspace.tasks.quantities import Orientation
from opspace.tasks.references.sample import Reference


class OrientationTask(MotionTask):
    """Turns a frame to an orientation: f* = a_d + kv (ω_d − ω) + kp R log(Rᵀ R_d).

    The error is the rotation vector from R to R_d in world axes. It stays continuous when it
    grows past half a turn, and where it then goes over to the short way (see ``RotationError``);
    ``reset`` and a target that leaps make it take the short way at once.

    Args:
        frame: Name of the frame; None is the robot's tool.
        target: (3, 3) rotation matrix, (4,) quaternion wxyz, a reference, or None to hold the
            orientation found first.
        kp: Stiffness, a number or one per selected axis, 1/s².
        kv: Damping, a number or one per selected axis, 1/s; None is critical, 2 sqrt(kp).
        axes: Axes to turn about, some of "xyz".
        axes_frame: Whether these are the axes of the world or of the frame ("tool").
        max_speed: Speed that the orientation error may ask for, rad/s.
        max_acceleration: Acceleration of the way to a new target, rad/s²; see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        name: Name of the task.

    Raises:
        InputError: A gain, target or axis that cannot be used.
    """

    def __init__(
        self,
        frame: str | None = None,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        axes: str = "xyz",
        axes_frame: AxesFrame = "world",
        max_speed: float | None = None,
        max_acceleration: float | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str = "orientation",
    ) -> None:
        super().__init__(
            name,
            source=WorldFrame(frame),
            quantity=Orientation(),
            target=target,
            selection=axes_selection(axes, name),
            axes_frame=axes_frame,
            kp=kp,
            kv=kv,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
        )
