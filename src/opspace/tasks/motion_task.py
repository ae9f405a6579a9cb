"""A task on the motion of a point or frame; position, orientation and pose tasks are made of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.motions import Motion, MotionSource, RelativeFrame
from opspace.tasks.quantities import Quantity
from opspace.tasks.references.sample import Reference, Sample
from opspace.tasks.rotation import cross
from opspace.tasks.task import TaskTerms
from opspace.tasks.tracking import TrackingTask
from opspace.tasks.validation import Array
from opspace.tasks.ways import Way

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

AxesFrame = Literal["world", "tool"]


class MotionTask(TrackingTask):
    """Controls selected rows of the motion of a source.

    In world axes the task velocity is S ẋ, with S the selected rows. In tool axes it is S Rᵀ ẋ
    with R the frame's rotation, so that Ṙᵀ = −Rᵀ [ω]× adds to the drift:

        J_t = S Rᵀ J        J̇_t v = S Rᵀ (J̇ v − ω × ẋ)
        f* = S Rᵀ (a_d − ω × ẋ) + kv S Rᵀ (v_d − ẋ) + kp S Rᵀ (x_d − x)

    The term ω × ẋ is in both and cancels in f* − J̇_t v: tool axes choose rows and gains, not
    another motion. Of the angular rows it is zero.

    Attributes:
        source: Where the motion is measured.
        quantity: What of it is controlled.
        selection: (m, k) the selected rows S.
        in_tool_axes: Whether they are rows of the frame's axes.
    """

    def __init__(
        self,
        name: str,
        *,
        source: MotionSource,
        quantity: Quantity,
        target: ArrayLike | Reference | None,
        selection: Array,
        axes_frame: AxesFrame,
        kp: ArrayLike,
        kv: ArrayLike | None,
        max_speed: float | Sequence[float] | None,
        max_acceleration: float | Sequence[float] | None = None,
        ki: float | None = None,
        max_integral: float = 0.05,
    ) -> None:
        if axes_frame not in ("world", "tool"):
            raise InputError(
                f"task {name!r}: axes_frame must be 'world' or 'tool', not {axes_frame!r}"
            )
        self._speed_groups = quantity.speed_groups
        super().__init__(
            name,
            rows=len(selection),
            units=quantity.units[: len(selection)],
            motion_size=len(quantity.units),
            kp=kp,
            kv=kv,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            ki=ki,
            max_integral=max_integral,
        )
        self.source = source
        self.quantity = quantity
        self.selection = selection
        self.in_tool_axes = axes_frame == "tool"
        self.target = target

    def evaluate(self, robot: Robot, t: float) -> TaskTerms:
        """Return the terms of the task at the robot's present state."""
        desired = self.asked(robot, t)
        quantity, block = self.quantity, self.quantity.block
        motion = self.source.measure(robot)
        error = quantity.error(motion, desired.x)
        basis, drift = self.selection, motion.drift[block]
        if self.in_tool_axes:
            transport = _transport(motion)[block]
            basis = basis @ _tool_axes(motion.rotation)[: len(error), : len(error)]
            drift = drift - transport
            desired = Sample(desired.x, desired.v, desired.a - transport)
        return self._terms(
            basis,
            J=motion.J[block],
            drift=drift,
            velocity=motion.velocity[block],
            error=error,
            desired=desired,
        )

    def _terms(
        self,
        basis: Array,
        *,
        J: Array,
        drift: Array,
        velocity: Array,
        error: Array,
        desired: Sample,
    ) -> TaskTerms:
        """Project the motion of k coordinates on the m task rows and apply Eq. 24 there.

        Args:
            basis: (m, k) rows of the task in the coordinates of the other arguments.
            J: (k, n) Jacobian.
            drift: (k,) J̇ v.
            velocity: (k,) J v.
            error: (k,) x_d − x.
            desired: Desired motion; only its velocity and acceleration (k,) are read.
        """
        error = basis @ error
        return TaskTerms(
            J=basis @ J,
            drift=basis @ drift,
            acceleration=self._gains.acceleration(
                error, basis @ (desired.v - velocity), basis @ desired.a
            ),
            error=error,
        )

    def row_axes(self, robot: Robot) -> Array | None:
        """See `Task.row_axes`; None for what is seen from another frame."""
        if isinstance(self.source, RelativeFrame):
            return None
        axes = self.selection
        if self.in_tool_axes:
            R = self.source.measure(robot).rotation
            axes = axes @ _tool_axes(R)[: axes.shape[1], : axes.shape[1]]
        found = np.zeros((self.rows, 6))
        found[:, self.quantity.block] = axes
        return found

    def reset(self) -> None:
        """Forget the held start value and which way round a rotation error went."""
        super().reset()
        self.quantity.reset()

    def _current(self, robot: Robot) -> Array:
        return self.quantity.value(self.source.measure(robot))

    def _resolve(self, robot: Robot) -> None:
        self.source.bind(robot)

    def _basis(self, robot: Robot) -> Array:
        size = len(self.quantity.units)
        if not self.in_tool_axes:
            return self.selection
        return self.selection @ _tool_axes(self.source.measure(robot).rotation)[:size, :size]

    def _way(self, now: Sample, goal: Array, t: float) -> Way:
        groups = range(len(self._speed_groups))
        return self.quantity.way(now, goal, t, [self._pace(group) for group in groups])

    def _check_value(self, value: ArrayLike, what: str) -> Array:
        return self.quantity.check(value, what)


def axes_selection(axes: str, name: str) -> Array:
    """Return the rows S, (m, 3), that a string such as "xz" selects, in the order x y z.

    Args:
        axes: Letters of the axes, each at most once and in any order.
        name: Name of the task, for the error message.

    Returns:
        (m, 3) rows of the identity.

    Raises:
        InputError: Empty, a letter twice, or another letter.
    """
    letters = set(axes)
    if not letters or letters - set("xyz") or len(letters) < len(axes):
        raise InputError(f"task {name!r}: axes must be some of the letters 'xyz', not {axes!r}")
    return np.eye(3)[[letter in letters for letter in "xyz"]]


def _transport(motion: Motion) -> Array:
    transport = np.zeros(6)
    transport[:3] = cross(motion.velocity[3:], motion.velocity[:3])
    return transport


def _tool_axes(R: Array) -> Array:
    axes = np.zeros((6, 6))
    axes[:3, :3] = axes[3:, 3:] = R.T
    return axes
