"""When a controller's ticks need no Python, and what is sent to them while they go on without."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from opspace.controller.reference import ReferenceController
from opspace.errors import InputError
from opspace.kernels.columns import REMEMBERS
from opspace.kernels.led_columns import FROM_FOLLOWED
from opspace.plan.pack_task import Packed
from opspace.plan.plan import Plan
from opspace.tasks import JointLimits
from opspace.tasks.task import CHANGES
from opspace.tasks.tracking import Target

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
        self._told: deque[tuple[int, dict[int, Target]]] = deque()
        self._leads: list[bool] = []

    def begin(self, last: int) -> None:
        """Have a look at the plan before cycles go on with it; for the thread that ticks.

        Args:
            last: Number of the last letter before.
        """
        self._drop(last)
        self._leads = [packed._is_led for packed in self.plan.packed]

    @property
    def changed(self) -> bool:
        """Whether some task has changed since the last look."""
        return CHANGES.last is not self._seen

    def write(self, number: int) -> bool:
        """Take up what has changed; False where that needs a tick in Python.

        Args:
            number: Of the letter, one more than that of the letter before.
        """
        last = CHANGES.last
        copy, told = self._copy, dict[int, Target]()
        # A goal that jumps lets angles take the short way, which is seen in what is remembered.
        copy.tick.kind[:, REMEMBERS] = 1
        copy.tick.led.asked[:] = 0
        for i, packed in enumerate(copy.packed):
            if not _up_to_date(packed) and packed._is_led == self._leads[i]:
                if packed._is_led:
                    self._lead(i, packed, told)
                else:
                    packed._pack_ahead()
        self._seen = last
        if not all(_up_to_date(packed) and _settled(packed) for packed in copy.packed):
            return False
        self._told.append((number, told))
        return True

    def _lead(self, i: int, packed: Packed, told: dict[int, Target]) -> None:
        """Ask for a way to a target that is a value; any other is left to Python."""
        task, led = packed.task, packed.led
        target, held, goal = task._target, task._held, task._target.goal
        asked = next((them[i] for _, them in reversed(tuple(self._told)) if i in them), None)
        before = task._before if asked is None else asked
        if target is not before:
            if before is None or not isinstance(goal, np.ndarray) or target.velocity.any():
                return
            known = before.goal
            assert led is not None
            on_way = asked is not None or task.way is not None
            # One that is told again is the same way.
            if not (on_way and isinstance(known, np.ndarray) and np.array_equal(known, goal)):
                led.ask(target, FROM_FOLLOWED)
                led.asked = None  # nothing ticks with the copy
            told[i] = target
        packed._pack_gains(task._gains)
        packed.target, packed.held = target, held

    def hand_back(self, taken: int) -> None:
        """Let tasks know the ways that have begun, for the thread that ticks.

        Args:
            taken: Number of the last letter that has been taken.
        """
        for number, told in tuple(self._told):
            for i, target in told.items() if number <= taken else ():
                self.plan.packed[i].go_to(target)
        self.plan.note_ways()
        self._drop(taken)

    def _drop(self, last: int) -> None:
        while self._told and self._told[0][0] <= last:
            self._told.popleft()

    def arrays(self) -> dict[str, np.ndarray]:
        """Return what is sent, by its names in `opspace.plan.cycle_records.CYCLES`."""
        tick = self._copy.tick
        found = {name: getattr(tick, name) for name in ("goal", "kp", "kv", "kind", "numbers")}
        found |= {"forgets": (tick.kind[:, REMEMBERS] == 0).astype(np.int64)}
        led = tick.led
        ways = {"pace": led.pace, "asked_way": led.asked, "way_goal": led.asked_goal}
        return found | ways | {"joint_way_goal": led.joint_asked}


def _up_to_date(packed: Packed) -> bool:
    task = packed.task
    same = packed.target is task._target and packed.held is task._held
    return same and packed.gains is task._gains


def _settled(packed: Packed) -> bool:
    led = packed.led
    if packed.task._gains.max_acceleration is not None and led is None:
        return False
    return packed.settled and (led is None or led.asked is None)
