"""When a controller's ticks need no Python, and what is sent to them while they go on without."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from opspace.controller.reference import ReferenceController
from opspace.errors import InputError
from opspace.kernels.columns import REMEMBERS
from opspace.plan.pack_task import Packed
from opspace.plan.plan import Plan
from opspace.tasks import JointLimits
from opspace.tasks.task import CHANGES

if TYPE_CHECKING:
    from opspace.controller.controller import Controller


def check_free(controller: ReferenceController) -> None:
    """Refuse by name what needs Python at every tick.

    Raises:
        InputError: Something does.
    """
    limits: JointLimits | None = controller.stack.limits
    reasons = {
        "a tick in readable form": not hasattr(controller, "_not_compiled"),
        "collisions": controller.collisions is not None,
        "integral action (ki)": controller._integral is not None,
        "force tasks": controller._forces is not None,
        f"observer_time of {type(limits).__name__}": controller._observer is not None,
    }
    for what, there in reasons.items():
        if there:
            raise InputError(f"cycles without Python cannot have {what}")
    if own := controller._not_compiled():  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError(f"cycles without Python cannot call {own}")
    for task in controller.stack:
        if task._gains.max_acceleration is not None:  # pyright: ignore[reportAttributeAccessIssue]
            raise InputError(
                f"task {task.name!r} has a max_acceleration, whose ways begin in Python: give it a "
                "max_speed, and the driver a torque_rate"
            )


def free_plan(controller: Controller) -> Plan | None:
    """Return the plan that ticks could go on with alone, None where the next one needs Python."""
    stack, laid_out = controller.stack, controller._laid_out
    busy = controller._handover, controller._loading, controller._forces, controller._integral
    if laid_out is None or controller._bodies is None or any(one is not None for one in busy):
        return None
    if not stack.settled or stack.waiting or laid_out[0] is not stack.members:
        return None
    plan = laid_out[1]
    return None if plan.moving or not all(map(_settled, plan.packed)) else plan


class Letters:
    """A copy of a plan that takes changes of tasks from another thread, to be sent to the plan.

    Args:
        controller: The controller.
        plan: The plan that it ticks with.
    """

    def __init__(self, controller: Controller, plan: Plan) -> None:
        assert controller._axes is not None
        self.plan = plan
        self._copy = controller._planned(plan.members, controller._axes)
        self._seen: object = None

    @property
    def changed(self) -> bool:
        """Whether some task has changed since the last look."""
        return CHANGES.last is not self._seen

    def write(self) -> bool:
        """Take up what has changed; False where that needs a tick in Python."""
        last = CHANGES.last
        copy = self._copy
        # A goal that jumps lets angles take the short way, which is seen in what is remembered.
        copy.tick.kind[:, REMEMBERS] = 1
        for packed in copy.packed:
            if not _up_to_date(packed):
                packed._pack_ahead()
        self._seen = last
        return all(_up_to_date(packed) and _settled(packed) for packed in copy.packed)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return what is sent, by its names in `opspace.plan.cycle_records.CYCLES`."""
        tick = self._copy.tick
        found = {name: getattr(tick, name) for name in ("goal", "kp", "kv", "kind", "numbers")}
        return found | {"forgets": (tick.kind[:, REMEMBERS] == 0).astype(np.int64)}


def _up_to_date(packed: Packed) -> bool:
    task = packed.task
    same = packed.target is task._target and packed.held is task._held
    return same and packed.gains is task._gains


def _settled(packed: Packed) -> bool:
    return packed.settled and packed.task._gains.max_acceleration is None
