"""Tasks as rows of numbers, repacked only when somebody changes them."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Mapping
from inspect import isfunction
from typing import Any

import numpy as np

from opspace.errors import InputError
from opspace.kernels.columns import (
    BODY,
    CARRIES,
    CENTRE_OF_MASS,
    COVERS_ALL,
    FIRST_ROW,
    FORCE,
    GOAL_ACCELERATION,
    GOAL_POSITION,
    GOAL_ROTATION,
    GOAL_VELOCITY,
    JOINT,
    JOINTS,
    KIND,
    KIND_SIZE,
    LOCAL,
    MAX_SPEED,
    MOMENTUM,
    MOTION,
    NUMBERS_SIZE,
    OFFSET,
    ORIENTATION,
    OTHER_BODY,
    OTHER_JOINT,
    OTHER_LOCAL,
    OWN,
    POSE,
    POSITION,
    QUANTITY,
    RELATIVE,
    REMEMBERS,
    ROWS,
    SOURCE,
    SPEED_LIMITED,
    TOOL_AXES,
    TOUCH,
    TURN,
    WORLD,
)
from opspace.kernels.led_columns import FROM_FOLLOWED, FROM_FOUND
from opspace.law.scalars import SIGNS
from opspace.machine.field_table import Record
from opspace.plan.pack_contact import Activation, activated
from opspace.plan.pack_led import LedGoal
from opspace.robots.adapter import AdapterBase
from opspace.robots.motion_axes import FramePlace, MotionAxes
from opspace.stack import Member
from opspace.tasks import TASK_KINDS, Task
from opspace.tasks.activations import checked_activation
from opspace.tasks.angular_momentum import AngularMomentumTask
from opspace.tasks.force import ForceTask
from opspace.tasks.gains import Gains
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import CenterOfMass, RelativeFrame, WorldFrame
from opspace.tasks.posture import PostureTask
from opspace.tasks.quantities import Orientation, Pose, Position
from opspace.tasks.references import Sample
from opspace.tasks.tracking import Hold, Target, TrackingTask
from opspace.tasks.way_round import WayRound
from opspace.tasks.ways import Way

QUANTITIES = {Position: POSITION, Orientation: ORIENTATION, Pose: POSE}
SOURCES = {WorldFrame: WORLD, RelativeFrame: RELATIVE, CenterOfMass: CENTRE_OF_MASS}


HONOURED = {
    "activation",
    "bind",
    "reset",
    "resume",
    "row_axes",
    "_resolve",
    "_recheck",
    "_words",
    "_abc_impl",
}
"""What a subclass may override and still be computed from numbers: either form calls it, or no tick
does."""
PACKED_ONCE = ("source", "quantity", "selection", "in_tool_axes", "layout", "rows")
"""Attributes that a subclass may not compute anew, as a property would."""

MOST_JOINTS = 4 * SIGNS
"""Joints of a task whose signs fit into what compiled code remembers of it."""


def kind_of(task: Task) -> int:
    """Tell whether a task is one that the compiled tick evaluates, and which.

    It is one by exact type, or as a subclass that overrides nothing that a tick asks a task for.
    """
    kind = type(task)
    if kind is AngularMomentumTask:
        return MOMENTUM
    known = {one.task for one in TASK_KINDS.values()} | {MotionTask, PostureTask}
    built_in = next((base for base in kind.__mro__ if base in known), None)
    if built_in is None or _overrides(task, built_in) or type(task._gains) is not Gains:
        return OWN
    if isinstance(task, ForceTask):
        return FORCE
    if isinstance(task, PostureTask):
        return JOINTS if task.rows <= MOST_JOINTS and _of_joints(task) else OWN
    assert isinstance(task, MotionTask)
    known_parts = type(task.source) in SOURCES and type(task.quantity) in QUANTITIES
    return MOTION if known_parts else OWN


def code_of(task: Task, axes: MotionAxes) -> int:
    """Tell what the compiled tick evaluates of a task on a robot: not what its followers move."""
    code = kind_of(task)
    return OWN if code and hides(axes, task) else code


def hides(axes: MotionAxes, task: Task) -> bool:
    """Tell whether joints that follow others move what a task measures."""
    source = getattr(task, "source", None)
    if not axes.followers or source is None:
        return False
    if isinstance(source, CenterOfMass):
        return True
    ids = source.ids if isinstance(source, RelativeFrame) else (source.id,)
    return any(axes.frames[id_].hidden for id_ in ids)


def _of_joints(task: PostureTask) -> bool:
    """Tell whether a posture has nothing of a floating base, where q and v count differently."""
    layout = task.layout
    if layout is None:
        return True
    more = layout.nq - layout.J.shape[1]
    return np.array_equal(layout.entries, layout.coordinates + more)


def _overrides(task: Task, built_in: type[Task]) -> bool:
    """Tell whether a task has anything of its own where a tick would ask the built-in one."""
    kind = type(task)
    own = {name for name in vars(task) if isfunction(getattr(built_in, name, None))}
    if kind is not built_in:
        asked = {name for name in dir(built_in) if not name.startswith("__")}
        own |= {
            name
            for name in (*asked, *PACKED_ONCE, "_target", "_held", "_gains", "__getattribute__")
            if getattr(kind, name, None) is not getattr(built_in, name, None)
        }
    return bool(own - HONOURED)


def _silent(task: Task) -> bool:
    """Tell whether its class may decide anew at every tick what it has, or tells nobody of changes."""
    kind = type(task)
    return kind.activation is not None or kind.__setattr__ is not Task.__setattr__


class Packed:
    """One task in the arrays of a plan.

    Args:
        member: The task in its stack.
        index: Its row in ``kind`` and ``numbers``.
        first: Its first row among those of all tasks.
        axes: The robot's arrays.
        tick: The arrays of the plan.
        presses: Rows of force tasks in ``press``, by identity.
    """

    def __init__(
        self,
        member: Member,
        index: int,
        first: int,
        axes: MotionAxes,
        tick: Record,
        presses: Mapping[int, int],
    ) -> None:
        task = member.task
        self.task: Any = task
        self.index = index
        self.rows = slice(first, first + task.rows)
        code = code_of(task, axes)
        self.own_kind = code == OWN
        self.moving = True
        self._timed = False
        self._presses = presses
        self._activation: Activation | None = None
        self.called: Activation | None = None
        self._tick = tick
        self.target: object = None
        self.held: object = None
        self.gains: object = None
        kind = tick.kind[index]
        kind[:] = np.zeros(KIND_SIZE)
        kind[[KIND, FIRST_ROW, ROWS]] = code, first, task.rows
        covers = isinstance(task, PostureTask) and task.rows == axes.v.size
        kind[COVERS_ALL] = int(covers)
        tick.numbers[index] = np.zeros(NUMBERS_SIZE)
        # Which way round angles went, where there are any.
        self.remembers = kind[REMEMBERS : REMEMBERS + 1].data
        self.turn = tick.numbers[index, TURN : TURN + 4].data
        self.way_round: WayRound | None = None
        self._turning = np.zeros(0)
        self.led: LedGoal | None = None
        if code in (MOTION, JOINTS) and tick.led.pace.size:
            self.led = LedGoal(self.task, index, self.rows, tick)
        self._take_activation()
        if kind[KIND] == MOTION:
            self._pack_source(axes)
            kind[QUANTITY] = QUANTITIES[type(self.task.quantity)]
            if kind[QUANTITY] != POSITION:
                self.way_round = self.task.quantity.turn
                self._turning = tick.numbers[index, GOAL_ROTATION : GOAL_ROTATION + 9]
        elif kind[KIND] == JOINTS:
            layout = self.task.layout
            tick.coordinate[self.rows] = layout.coordinates
            tick.endless[self.rows] = layout.endless
            if layout.endless.any():
                self.way_round = self.task.turn
                self._turning = tick.goal[self.rows, 0]
        self._pack_more(axes)
        self._pack_ahead()

    def refresh(self, robot: AdapterBase, t: float) -> None:
        """Bring the arrays up to date with the task at time ``t`` [s].

        Args:
            robot: The robot at the present state.
            t: Time, s.

        Raises:
            InputError: A reference or a task of the user's own gave unusable numbers.
        """
        task = self.task
        if task.activation is not self._activation:
            self._take_activation()
        if self.called is not None:
            robot.check_state(robot.q, robot.v)
            self._tick.own[self.index] = self.own_activation(robot, t)
        if self.own_kind:
            self._evaluate(robot, t)
        elif self._changed:
            self._pack(robot, t)
        self.moving = self.own_kind or self._timed or self.called is not None or _silent(task)

    def own_activation(self, robot: AdapterBase, t: float) -> float:
        """Evaluate what Python evaluates of the task's own activation, 1 where that is nothing.

        Raises:
            InputError: It is not in [0, 1].
        """
        return checked_activation(f"task {self.task.name!r}", self.called, robot, t)

    def _take_activation(self) -> None:
        """Look how the task is activated; what is a contact's is compiled."""
        self._activation = self.task.activation
        touch, self.called = activated(self._activation, self._presses)
        self._tick.kind[self.index, TOUCH] = touch
        self._tick.own[self.index] = 1.0

    @property
    def joints(self) -> bool:
        """Whether the kernels know it as a task of joints."""
        return bool(self._tick.kind[self.index, KIND] == JOINTS)

    @property
    def _changed(self) -> bool:
        """Whether something is to be packed."""
        task = self.task
        return (
            self._timed
            or task._target is not self.target
            or task._held is not self.held
            or task._gains is not self.gains
            or (self._is_led and (task.way is not self._way or task._before is not task._target))
        )

    @property
    def _is_led(self) -> bool:
        """Whether compiled code leads the task to its targets."""
        return self.led is not None and self.task._gains.max_acceleration is not None

    @property
    def _way(self) -> Way | None:
        """The way that compiled code follows."""
        return None if self.led is None else self.led.way

    @property
    def settled(self) -> bool:
        """Whether all is packed that a tick would pack, until the task says that it has changed."""
        task = self.task
        if self.own_kind or self.called is not None or _silent(task):
            return False
        return self._packed_ahead

    @property
    def _packed_ahead(self) -> bool:
        """Whether all numbers of the task itself are there."""
        task = self.task
        return self.target is task._target and self.held is task._held and not self._timed

    def remember(self, before: Packed | None) -> None:
        """Go on from the same task in the plan before: which way round it went, and to where."""
        if self.way_round is None or before is self:
            return  # none is remembered, or it is there already
        if before is None or before.way_round is None:
            self.remembers[0] = 0
        elif self._timed or before._timed or self._is_led or not self._agrees(before):
            self._go_on(before.remembers[0], before.turn, before._turning)
        else:  # on the way to the same goal
            self.remembers[0] = before.remembers[0]
            self.turn[:] = before.turn

    def _agrees(self, before: Packed) -> bool:
        """Tell whether both have packed the same target."""
        return self.target is before.target and self.held is before.held

    def leave(self) -> None:
        """Let the readable form go on with the way round, from the tick before."""
        if self.way_round is not None:
            a, b, c, d = self.turn.tolist()
            self.way_round.previous = (a, b, c, d) if self.remembers[0] else None
            goal = self._turning.copy()
            self.way_round.goal = goal.reshape(3, 3) if goal.size == 9 else goal

    def come_back(self) -> None:
        """Go on with the way round, from the readable form's tick before."""
        known = self.way_round
        if known is not None and known.previous is not None and known.goal is not None:
            goal = known.goal[:3, :3].ravel() if known.goal.ndim == 2 else known.goal
            self._go_on(1, known.previous, goal)

    def forget(self) -> None:
        """Take the short way at the next tick."""
        self.remembers[0] = 0

    def _go_on(self, remembers: int, turn: Iterable[float], goal: np.ndarray) -> None:
        """Take over the way round to a goal; whether the target is still there is seen at packing."""
        self.remembers[0] = remembers
        self.turn[:] = array("d", turn)
        self._turning[:] = goal
        self.target = None

    def _evaluate(self, robot: AdapterBase, t: float) -> None:
        tick, rows = self._tick, self.rows
        robot.check_state(robot.q, robot.v)
        terms = self.task.evaluate(robot, t)
        for given, kept in (
            (terms.J, tick.J[:, : robot.v.size]),
            (terms.drift, tick.drift),
            (terms.acceleration, tick.wanted),
            (terms.error, tick.error),
        ):
            kept[rows] = self._checked(given, kept[rows].shape, t)
        tick.kind[self.index, CARRIES] = int(terms.torque is not None)
        if terms.torque is not None:
            tick.torque[self.index] = self._checked(terms.torque, robot.v.shape, t)

    def _checked(self, given: object, shape: tuple[int, ...], t: float) -> np.ndarray:
        found = np.asarray(given, dtype=float)
        if found.shape == shape and np.isfinite(found).all():
            return found
        raise InputError(
            f"task {self.task.name!r}: its terms at t = {t:.6g} s must be finite, of shape {shape}, "
            f"got shape {found.shape}"
            f"{'' if np.isfinite(found).all() else ' with numbers that are not finite'}"
        )

    def _pack_more(self, axes: MotionAxes) -> None:
        """Pack what only tasks of one kind have, and keep."""

    def _pack_ahead(self) -> None:
        """Pack what is known before the tick, from any thread; `refresh` sees what changes later."""
        if getattr(self.task, "ki", None) is None and not self._is_led:
            self.pack_value()

    def pack_value(self) -> None:
        """Pack a target that stays what it is, without what an integral adds; no other one.

        A task that is led to it begins where it finds the robot, as one that has followed nothing yet.
        """
        task = self.task
        if self.own_kind or type(task).desired is not TrackingTask.desired:
            return
        target, held = task._target, task._held
        goal = target.goal
        if isinstance(goal, Hold):
            if held is None or held[0] is not goal:
                return
            goal = held[1]
        elif callable(goal):
            return
        elif task._gains.max_acceleration is not None and not target.velocity.any():
            if self.led is not None:
                self._pack_gains(task._gains)
                self.led.ask(target, FROM_FOUND)
                self.target, self.held, self._timed = target, held, False
            return
        elif task._led is not None and task._led.target is target:
            return  # it goes on to it on a way, though none would begin now
        sample = Sample(goal, target.velocity, target.acceleration)
        self._write(sample, target, held, task._gains)

    def _pack(self, robot: AdapterBase, t: float) -> None:
        task = self.task
        if self.led is not None and self._is_led:
            self._lead(robot, t, self.led)
            return
        target = task._target
        if not self._timed:  # it may hold what it finds
            robot.check_state(robot.q, robot.v)
        gains = task._gains
        desired = task.pushed(task.desired(robot, t))
        self._write(desired, target, task._held, gains)
        self._timed = task.moves(t)
        if self.led is not None:
            self.led.leave()

    def _lead(self, robot: AdapterBase, t: float, led: LedGoal) -> None:
        """Pack a task whose ways compiled code plans and follows."""
        task = self.task
        target, gains = task._target, task._gains
        led.push(task.integral)
        same = target is self.target and gains is self.gains
        if same and led.way is not None and task.way is led.way:
            return
        self._pack_gains(gains)
        robot.check_state(robot.q, robot.v)  # it may hold what it finds
        if task.approaches(target):
            self._ask(robot, t, target, led)
        else:
            desired = task.desired(robot, t)
            if task.way is not None:
                led.load(task.way)
            else:
                led.leave()
                self._write(task.pushed(desired), target, task._held, gains)
        self.target, self.held, self.gains = target, task._held, gains
        self._timed = task.ki is not None or callable(target.goal)

    def go_to(self, target: Target) -> None:
        """Take it that compiled code has been asked for a way to a target by somebody else."""
        assert self.led is not None
        self.target, self.held = target, self.task._held
        self.led.asked, self.led.way = target, None

    def _ask(self, robot: AdapterBase, t: float, target: Any, led: LedGoal) -> None:
        """Have a way begin with what is followed until now, or else with what is found."""
        task = self.task
        followed, start = None, FROM_FOLLOWED
        if task.way is not None:
            led.load(task.way)
        else:
            led.leave()
            followed = task.followed_before(robot, t)
            if followed is None:
                start = FROM_FOUND
            else:
                self._write(followed, target, task._held, task._gains)
        led.ask(target, start)

    def _write(self, desired: Any, target: Any, held: object, gains: Any) -> None:
        tick, rows = self._tick, self.rows
        before = self._turning.copy() if self.remembers[0] else None
        self._pack_gains(gains)
        if self.joints:
            tick.goal[rows, 0], tick.goal[rows, 1], tick.goal[rows, 2] = desired
        else:
            self._pack_goal(desired)
        way = self.way_round
        if before is not None and way is not None and way.jumps(before, self._turning):
            self.forget()
        self.target, self.held = target, held

    def _pack_gains(self, gains: Any) -> None:
        tick, rows = self._tick, self.rows
        if gains is not self.gains:
            tick.kp[rows], tick.kv[rows] = gains.kp, gains.kv
            limited = gains.max_speed is not None
            tick.kind[self.index, SPEED_LIMITED] = int(limited)
            if limited:
                most = slice(MAX_SPEED, MAX_SPEED + len(gains.max_speed))
                tick.numbers[self.index, most] = gains.max_speed
            if self.led is not None:
                self.led.set_pace(gains)
            self.gains = gains

    def _pack_goal(self, desired: Any) -> None:
        number, quantity = self._tick.numbers[self.index], self._tick.kind[self.index, QUANTITY]
        size = len(desired.v)
        number[GOAL_VELOCITY : GOAL_VELOCITY + size] = desired.v
        number[GOAL_ACCELERATION : GOAL_ACCELERATION + size] = desired.a
        rotation = slice(GOAL_ROTATION, GOAL_ROTATION + 9)
        position = slice(GOAL_POSITION, GOAL_POSITION + 3)
        if quantity == POSITION:
            number[position] = desired.x
        elif quantity == ORIENTATION:
            number[rotation] = desired.x.reshape(9)
        else:
            number[rotation] = desired.x[:3, :3].reshape(9)
            number[position] = desired.x[:3, 3]

    def _pack_source(self, axes: MotionAxes) -> None:
        task, kind = self.task, self._tick.kind[self.index]
        number = self._tick.numbers[self.index]
        source = task.source
        kind[SOURCE] = SOURCES[type(source)]
        kind[TOOL_AXES] = int(task.in_tool_axes)
        selection = task.selection
        self._tick.select[self.rows] = 0.0
        self._tick.select[self.rows, : selection.shape[1]] = selection
        if isinstance(source, WorldFrame):
            self._pack_frame(axes.frames[source.id], BODY, JOINT, LOCAL)
            if source.offset is not None:
                number[OFFSET : OFFSET + 3] = source.offset
        elif isinstance(source, RelativeFrame):
            frame, other = source.ids
            self._pack_frame(axes.frames[frame], BODY, JOINT, LOCAL)
            self._pack_frame(axes.frames[other], OTHER_BODY, OTHER_JOINT, OTHER_LOCAL)

    def _pack_frame(self, place: FramePlace, body: int, joint: int, local: int) -> None:
        kind = self._tick.kind[self.index]
        kind[body], kind[joint] = place.body, place.joint
        self._tick.numbers[self.index, local : local + 12] = place.local
