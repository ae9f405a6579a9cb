"""Position of a point of the robot."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.tasks.motion_task import AxesFrame, MotionTask, axes_selection
from opspace.tasks.motions import WorldFrame, as_offset
from opspace.tasks.quantities import Position
from opspace.tasks.references.sample import Reference


class PositionTask(MotionTask):
    """Moves a point of a frame to a position, Eq. 24: f* = a_d + kv (v_d − ẋ) + kp (x_d − x).

    Args:
        frame: Name of the frame; None is the robot's tool.
        target: (3,) world position in m, a reference, or None to hold the position found first.
            Always all three coordinates, whatever ``axes`` selects.
        kp: Stiffness, a number or one per selected axis, 1/s².
        kv: Damping, a number or one per selected axis, 1/s; None is critical, 2 sqrt(kp).
        axes: Axes to control, some of "xyz".
        axes_frame: Whether these are the axes of the world or of the frame ("tool").
        max_speed: Speed that the position error may ask for, m/s.
        max_acceleration: Acceleration of the way to a new target, m/s²; see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        offset: (3,) point to control in the frame's axes, m; None is the frame's origin.
        name: Name of the task.

    Raises:
        InputError: A gain, target, offset or axis that cannot be used.
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
        offset: ArrayLike | None = None,
        name: str = "position",
    ) -> None:
        super().__init__(
            name,
            source=WorldFrame(frame, as_offset(offset, name)),
            quantity=Position(),
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
