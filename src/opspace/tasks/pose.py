"""Position and orientation of a frame of the robot together."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.motion_task import AxesFrame, MotionTask
from opspace.tasks.motions import WorldFrame, as_offset
from opspace.tasks.quantities import Pose
from opspace.tasks.references.sample import Reference


class PoseTask(MotionTask):
    """Moves a frame to a pose: the rows of a position task above those of an orientation task.

    Args:
        frame: Name of the frame; None is the robot's tool.
        target: (4, 4) homogeneous matrix, (7,) [x y z, qw qx qy qz], a pair (position,
            orientation), a reference that gives one of these, or None to hold the pose found
            first.
        kp: Stiffness, a number or (6,), 1/s².
        kv: Damping, a number or (6,), 1/s; None is critical, 2 sqrt(kp).
        kp_linear: Stiffness of the three linear rows in place of ``kp``.
        kp_angular: Stiffness of the three angular rows in place of ``kp``.
        axes_frame: Whether the rows are along the axes of the world or of the frame ("tool").
        max_speed: Speeds that the error may ask for, (linear m/s, angular rad/s); inf is none.
        max_acceleration: Accelerations of the way to a new target, (linear m/s², angular rad/s²); see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        offset: (3,) point to control in the frame's axes, m; None is the frame's origin.
        name: Name of the task.

    Raises:
        InputError: A gain, target or offset that cannot be used.
    """

    def __init__(
        self,
        frame: str | None = None,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        kp_linear: float | None = None,
        kp_angular: float | None = None,
        axes_frame: AxesFrame = "world",
        max_speed: tuple[float, float] | None = None,
        max_acceleration: tuple[float, float] | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        offset: ArrayLike | None = None,
        name: str = "pose",
    ) -> None:
        super().__init__(
            name,
            source=WorldFrame(frame, as_offset(offset, name)),
            quantity=Pose(),
            target=target,
            selection=np.eye(6),
            axes_frame=axes_frame,
            kp=pose_stiffness(kp, kp_linear, kp_angular, name),
            kv=kv,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
        )


def pose_stiffness(
    kp: ArrayLike, kp_linear: float | None, kp_angular: float | None, name: str
) -> ArrayLike:
    """Join the stiffness of linear and angular rows.

    Args:
        kp: Stiffness of the rows that are not given on their own, a number or (6,), 1/s².
        kp_linear: Stiffness of rows 0 to 2, or None.
        kp_angular: Stiffness of rows 3 to 5, or None.
        name: Name of the task, for the error message.

    Returns:
        ``kp`` itself or (6,).

    Raises:
        InputError: ``kp`` neither a number nor (6,), or a separate gain that is not a number.
    """
    if kp_linear is None and kp_angular is None:
        return kp
    try:
        rows = np.broadcast_to(np.asarray(kp, dtype=float), 6).copy()
        rows[:3] = rows[:3] if kp_linear is None else float(kp_linear)
        rows[3:] = rows[3:] if kp_angular is None else float(kp_angular)
    except (TypeError, ValueError):
        raise InputError(
            f"task {name!r}: kp must be a number or (6,), kp_linear and kp_angular numbers"
        ) from None
    return rows
