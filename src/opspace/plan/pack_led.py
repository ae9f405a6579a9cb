"""What compiled code is told of the ways of a task to its targets, and what it answers."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from opspace.kernels.columns import JOINTS, KIND, ORIENTATION, POSITION, QUANTITY
from opspace.kernels.led_columns import GOAL_PLACE, GOAL_TURN
from opspace.machine.field_table import Record
from opspace.tasks.gains import Gains
from opspace.tasks.tracking import Target, TrackingTask
from opspace.tasks.ways import PoseWay, RotationWay, SwiftWay, VectorWay, Way

PLACE = slice(GOAL_PLACE, GOAL_PLACE + 3)
TURN = slice(GOAL_TURN, GOAL_TURN + 9)


class LedGoal:
    """The ways of one task in the arrays of a plan.

    Args:
        task: The task.
        index: Its row among tasks.
        rows: Its rows among those of all tasks.
        tick: The arrays of the plan.

    Attributes:
        way: The way that compiled code follows, None for none.
        asked: Target to which it begins one with the next tick, None for none.
    """

    way: Way | None = None
    asked: Target | None = None

    def __init__(self, task: TrackingTask, index: int, rows: slice, tick: Record) -> None:
        self._task, self._index, self._rows = task, index, rows
        self._led, self._kind = tick.led, tick.kind[index]

    def set_pace(self, gains: Gains) -> None:
        """Tell the limits of ways that begin from now on."""
        pace = self._led.pace[self._index]
        pace[:] = 0.0
        if gains.max_acceleration is not None:
            found = np.ravel([*zip(gains.max_speed or (), gains.max_acceleration, strict=True)])
            pace[: found.size] = found

    def ask(self, target: Target, start: int) -> None:
        """Have a way begin with the next tick.

        Args:
            target: Where it goes.
            start: Where it begins, see `opspace.kernels.led_columns`.
        """
        goal, told = cast("np.ndarray", target.goal), self._led.asked_goal[self._index]
        if self._of_joints:
            self._led.joint_asked[self._rows] = goal
        elif self._kind[QUANTITY] == POSITION:
            told[PLACE] = goal
        elif self._kind[QUANTITY] == ORIENTATION:
            told[TURN] = goal.ravel()
        else:
            told[PLACE], told[TURN] = goal[:3, 3], goal[:3, :3].ravel()
        self._led.asked[self._index] = start
        self.asked, self.way = target, None

    def leave(self) -> None:
        """Have no way: what is desired is what is told."""
        self._led.asked[self._index] = self._led.on[self._index] = 0
        self.asked = self.way = None

    def push(self, integral: np.ndarray) -> None:
        """Tell what integral action adds (k,)."""
        if self._of_joints:
            self._led.joint_more[self._rows] = integral
        else:
            self._led.more[self._index, : integral.size] = integral

    def load(self, way: Way) -> None:
        """Go on with a way that has been planned before."""
        if way is self.way:
            return
        led, i = self._led, self._index
        led.asked[i], led.on[i] = 0, 1
        self.asked, self.way = None, way
        if self._of_joints:
            assert isinstance(way, VectorWay)
            led.joint_parts[self._rows], led.joint_goal[self._rows] = way.motion.rows, way.goal
            self._load_times(0, way)
            return
        place, turn = (way.place, way.turn) if isinstance(way, PoseWay) else (way, way)
        if isinstance(place, VectorWay):
            led.parts[i, :3], led.goal[i, PLACE] = place.motion.rows, place.goal
            self._load_times(0, place)
        if isinstance(turn, RotationWay):
            led.parts[i, 3:], led.goal[i, TURN] = turn.motion.rows, turn.goal.ravel()
            led.start[i] = turn.start.ravel()
            self._load_times(int(place is not turn), turn)

    def note(self) -> None:
        """Let the task know the way that the tick has begun."""
        if self.asked is not None and not self._led.asked[self._index]:
            target, self.asked, self.way = self.asked, None, self._begun()
            self._task.go_on(target, self.way)

    @property
    def _of_joints(self) -> bool:
        return bool(self._kind[KIND] == JOINTS)

    def _load_times(self, part: int, way: Any) -> None:
        led, i = self._led, self._index
        led.begun[i], led.ends[i, part], led.most[i, part] = way.begin, way.end, way.motion.most

    def _begun(self) -> Way:
        """Copy the way that compiled code has planned."""
        led, i = self._led, self._index
        begin, first, second = led.begun[i].item(), *led.most[i].tolist()
        if self._of_joints:
            motion = SwiftWay(led.joint_parts[self._rows].copy(), first)
            return VectorWay(motion, led.joint_goal[self._rows].copy(), begin)
        parts, goal = led.parts[i].copy(), led.goal[i].copy()
        alone = self._kind[QUANTITY] in (POSITION, ORIENTATION)
        place = VectorWay(SwiftWay(parts[:3], first), goal[PLACE], begin)
        if self._kind[QUANTITY] == POSITION:
            return place
        motion = SwiftWay(parts[3:], first if alone else second)
        start = led.start[i].reshape(3, 3).copy()
        turn = RotationWay(motion, start, goal[TURN].reshape(3, 3), begin)
        return turn if alone else PoseWay(place, turn)
