"""One frame of the robot as seen from another one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.tasks.motion_task import MotionTask, axes_selection
from opspace.tasks.motions import RelativeFrame
from opspace.tasks.pose import pose_stiffness
from opspace.tasks.quantities import Orientation, Pose, Position
from opspace.tasks.references.sample import Reference


class RelativePositionTask(MotionTask):
    """Moves a frame's origin to a position relative to another frame, x = R_rᵀ (p − p_r).

    Rows, target and feed-forward are in the axes of the reference frame; Eq. 24 acts on x as the
    reference frame sees it (``RelativeFrame`` gives ẋ and the drift).

    Args:
        frame: Name of the frame; None is the robot's tool.
        reference_frame: Name of the frame it is seen from.
        target: (3,) position in m, a reference, or None to hold the position found first.
        kp: Stiffness, a number or one per selected axis, 1/s².
        kv: Damping, a number or one per selected axis, 1/s; None is critical, 2 sqrt(kp).
        axes: Axes of the reference frame to control, some of "xyz".
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
        frame: str | None,
        reference_frame: str,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        axes: str = "xyz",
        max_speed: float | None = None,
        max_acceleration: float | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str = "relative_position",
    ) -> None:
        super().__init__(
            name,
            source=RelativeFrame(frame, reference_frame),
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


class RelativeOrientationTask(MotionTask):
    """Turns a frame to an orientation relative to another frame, R = R_rᵀ R_f.

    The error log(R_d Rᵀ), the rows and the feed-forward are in the axes of the reference frame.

    Args:
        frame: Name of the frame; None is the robot's tool.
        reference_frame: Name of the frame it is seen from.
        target: (3, 3) rotation matrix, (4,) quaternion wxyz, a reference, or None to hold the
            orientation found first.
        kp: Stiffness, a number or one per selected axis, 1/s².
        kv: Damping, a number or one per selected axis, 1/s; None is critical, 2 sqrt(kp).
        axes: Axes of the reference frame to turn about, some of "xyz".
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
        frame: str | None,
        reference_frame: str,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        axes: str = "xyz",
        max_speed: float | None = None,
        max_acceleration: float | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str = "relative_orientation",
    ) -> None:
        super().__init__(
            name,
            source=RelativeFrame(frame, reference_frame),
            quantity=Orientation(),
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


class RelativePoseTask(MotionTask):
    """Moves a frame to a pose relative to another frame, in the axes of that frame.

    The rows of a ``RelativePositionTask`` above those of a ``RelativeOrientationTask``.

    Args:
        frame: Name of the frame; None is the robot's tool.
        reference_frame: Name of the frame it is seen from.
        target: Pose in one of the forms that ``PoseTask`` takes, or None to hold the pose found
            first.
        kp: Stiffness, a number or (6,), 1/s².
        kv: Damping, a number or (6,), 1/s; None is critical, 2 sqrt(kp).
        kp_linear: Stiffness of the three linear rows in place of ``kp``.
        kp_angular: Stiffness of the three angular rows in place of ``kp``.
        max_speed: Speeds that the error may ask for, (linear m/s, angular rad/s); inf is none.
        max_acceleration: Accelerations of the way to a new target, (linear m/s², angular rad/s²); see
            `TrackingTask.max_acceleration`.
        ki: Integral gain, 1/s³, against friction and payload; None is none.
        max_integral: Error in m or rad whose pull, kp times it, the integral may add at most.
        name: Name of the task.

    Raises:
        InputError: A gain or target that cannot be used.
    """

    def __init__(
        self,
        frame: str | None,
        reference_frame: str,
        target: ArrayLike | Reference | None = None,
        *,
        kp: ArrayLike = 100.0,
        kv: ArrayLike | None = None,
        kp_linear: float | None = None,
        kp_angular: float | None = None,
        max_speed: tuple[float, float] | None = None,
        max_acceleration: tuple[float, float] | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
        name: str = "relative_pose",
    ) -> None:
        super().__init__(
            name,
            source=RelativeFrame(frame, reference_frame),
            quantity=Pose(),
            target=target,
            selection=np.eye(6),
            axes_frame="world",
            kp=pose_stiffness(kp, kp_linear, kp_angular, name),
            kv=kv,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
        )
