"""Position of the robot's centre of mass."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.tasks.motion_task import MotionTask, axes_selection
from opspace.tasks.motions import CenterOfMass
from opspace.tasks.quantities import Position
from opspace.tasks.references.sample import Reference


class ComTask(MotionTask):
    """Moves the centre of mass c: f* = a_d + kv (v_d − ċ) + kp (c_d − c), Eq. 24.

    Args:
        target: (3,) world position in m, a reference, or None to hold the position found first.
            Always all three coordinates, whatever ``axes`` selects.
        kp: Stiffness, a number or one per selected axis, 1/s².
        kv: Damping, a number or one per selected axis, 1/s; None is critical, 2 sqrt(kp).
        axes: World axes to control, some of "xyz".
        max_speed: Speed that the position error may ask for, m/s.
        max_acceleration: Acceleration of the way to a new target, m/s²; see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        name: Name of the task.

    Raises:
        InputError: A gain, target or axis that cannot be used.
    """

    def __init__(
        self,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        axes: str = "xyz",
        max_speed: float | None = None,
        max_acceleration: float | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str = "com",
    ) -> None:
        super().__init__(
            name,
            source=CenterOfMass(),
            quantity=Position(),
            target=target,
            selection=axes_selection(axes, name),
            axes_frame="world",
            kp=kp,
            kv=kv,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
        )
