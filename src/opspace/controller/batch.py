"""Torques of one stack at many states at once, on every core."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.kernels.columns import OWN, REMEMBERS, TURN
from opspace.law.press_columns import MEMORY_SIZE
from opspace.machine.field_table import Record
from opspace.plan.entries import KERNELS
from opspace.plan.pack_contacts import fits
from opspace.plan.pack_task import kind_of
from opspace.plan.plan import Plan
from opspace.plan.records import REMEMBERED, STATES
from opspace.robots.adapter import AdapterBase
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.rigid_model import RigidModel
from opspace.stack import ContactMember, Member
from opspace.tasks.force import ForceTask
from opspace.tasks.tracking import TrackingTask

CHUNK = 64
"""States that a thread takes at a time: some tenths of a millisecond, so that all end together."""

Planned = Callable[[tuple[Member, ...], MotionAxes], Plan]


class Batch:
    """A stack at the moment, ready to be evaluated in many states.

    Every thread has a plan and dynamics of its own; what they share is only read.

    Attributes:
        robot: The robot.
        members: The tasks.
        threads: Number of threads.

    Args:
        robot: The robot of the controller; its state is never touched.
        model: Its bodies.
        members: The tasks.
        planned: Makes a plan for them.
        threads: Number of threads.
    """

    def __init__(
        self,
        robot: AdapterBase,
        model: RigidModel,
        members: tuple[Member, ...],
        planned: Planned,
        threads: int,
    ) -> None:
        self.members = members
        self.threads = threads
        self.robot = robot
        self._plans = [planned(members, axes_of(model, robot.nq)) for _ in range(threads)]

    @property
    def plan(self) -> Plan:
        """What one of the threads works with."""
        return self._plans[0]

    def touch(self, members: tuple[ContactMember, ...], t: float) -> bool:
        """Take over the contacts at time ``t`` [s], and tell whether there is room for them."""
        for plan in self._plans:
            if plan.contacts is not None:
                if len(members) > plan.contacts.most:
                    return False
                plan.contacts.begin(members, self.robot, t)
        return True

    def disturb(self, acceleration: np.ndarray) -> None:
        """Tell the joint limits what comes on top of the commanded accelerations, (n,) rad/s²."""
        for plan in self._plans:
            plan.disturb(acceleration)

    def torque(self, Q: np.ndarray, V: np.ndarray, t: float, before: Plan | None) -> np.ndarray:
        """Compute the torque at every state.

        Args:
            Q: (states, n) configurations, finite.
            V: (states, n) velocities, finite.
            t: Time, s.
            before: The plan of the tick before, None if there was none.

        Returns:
            (states, n) torques, N·m.

        Raises:
            InputError: A reference or activation gave unusable numbers.
        """
        first = self._plans[0]
        known = () if before is None else before.variables
        ramps = tuple(variable.ramp for variable in first.variables)
        first.go_on(first.heritage(before, known, first.variables, ramps), first.members)
        touches = [(one.task.memory, one.task.memory.row.copy()) for one in first.forces]
        refresh_apart(self._plans, self.robot, t)
        own = self._own_activations(Q, V, t)
        for memory, row in touches:  # an activation of the user's own may ask it
            memory.row[:] = row
        given = {"Q": Q, "V": V, "own": own, "before": _remembered(first)}
        states = STATES.make({}, given)
        ticks, record = KERNELS["ticks"], states.handle()
        chunks = iter(range(0, len(Q), CHUNK))

        def work(plan: Plan) -> None:
            for first in chunks:  # the next one that nobody has taken
                end = min(first + CHUNK, len(Q))
                ticks(t, plan.handle.address, record.address, first, end)

        used = self._plans[: max(1, -(-len(Q) // CHUNK))]
        if len(used) == 1:
            work(used[0])
        else:
            with ThreadPoolExecutor(len(used)) as pool:  # a kept one would not live in a fork
                list(pool.map(work, used))
        return states.tau

    def gravity(self, Q: np.ndarray, V: np.ndarray) -> np.ndarray:
        """Compute the gravity torque at every state, (states, n) N·m."""
        robot, found = self.robot.fresh(), np.zeros(V.shape)
        for row, q, v in zip(found, Q, V, strict=True):
            robot.update(q, v)
            row[:] = np.nan_to_num(robot.gravity, nan=0.0, posinf=0.0, neginf=0.0)
        return found

    def _own_activations(self, Q: np.ndarray, V: np.ndarray, t: float) -> np.ndarray:
        """Evaluate the activations that users gave to tasks, in Python, state by state."""
        own = np.ones((1, len(self.members)))
        chosen = [(i, one) for i, one in enumerate(self.plan.packed) if one.called is not None]
        if not chosen:
            return own
        own = np.ones((len(Q), len(self.members)))
        robot = self.robot.fresh()
        for row, q, v in zip(own, Q, V, strict=True):
            robot.update(q, v)
            for i, packed in chosen:
                row[i] = packed.own_activation(robot, t)
        return own


def axes_of(model: RigidModel, nq: int) -> MotionAxes:
    """Make memory of its own for a robot that compiled code computes, at rest."""
    n = model.bodies.before.size
    return model.motion_axes(np.zeros(nq), np.zeros(n))


def check_contacts(members: tuple[ContactMember, ...]) -> None:
    """Check that compiled code can evaluate the contacts in any state.

    Raises:
        InputError: A contact is the user's own, or has an activation of its own.
    """
    for member in members:
        contact = member.contact
        if contact.activation is not None:
            raise InputError(
                f"contact {contact.name!r} has an activation of its own, which a batch does not call"
            )
        if not fits((member,)):
            raise InputError(
                f"contact {contact.name!r} ({type(contact).__name__}) is evaluated in Python, one "
                "state at a time; a batch takes the contacts of the library only"
            )


def refresh_apart(plans: Sequence[Plan], robot: AdapterBase, t: float) -> None:
    """Bring plans of the same tasks up to date, without beginning for the tasks what they have not."""
    tasks = [m.task for m in plans[0].members if isinstance(m.task, TrackingTask)]
    progress = [task.progress for task in tasks]
    for plan in plans:
        plan.refresh(robot, t)
    for task, before in zip(tasks, progress, strict=True):
        task.recall(before)


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def checked_states(robot: AdapterBase, Q: ArrayLike, V: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Check states and copy them.

    Args:
        robot: The robot.
        Q: (states, nq) configurations.
        V: (states, n) velocities.

    Returns:
        Both as arrays.

    Raises:
        InputError: A wrong shape or a number that is not finite; it names the row.
    """
    q, v = _matrix("Q", Q, robot.nq, robot), _matrix("V", V, robot.nv, robot)
    if len(q) != len(v):
        raise InputError(f"Q has {len(q)} rows, V has {len(v)}: one of each for every state")
    good = np.isfinite(q).all(axis=1) & np.isfinite(v).all(axis=1)
    if not good.all():
        row = int(np.argmin(good))
        try:
            robot.check_state(q[row], v[row])
        except InputError as error:
            raise InputError(f"row {row}: {error}") from None
    return q, v


def _matrix(name: str, value: ArrayLike, size: int, robot: AdapterBase) -> np.ndarray:
    try:
        # A copy of one kind, whatever is given: compiled code distinguishes them.
        found = np.array(value, dtype=float, order="C")
    except (TypeError, ValueError):
        row = next((i for i, given in _rows(value) if np.shape(given) != (size,)), None)
        where = "" if row is None else f"row {row}: "
        raise InputError(
            f"{where}{name} must be numbers of shape (states, {size}) for {robot.name}"
        ) from None
    if found.ndim != 2 or found.shape[1] != size:
        raise InputError(f"{name} for {robot.name} has shape {found.shape}, not (states, {size})")
    return found


def _rows(value: object) -> Iterator[tuple[int, Any]]:
    return enumerate(value) if isinstance(value, list | tuple) else iter(())


def check_members(members: tuple[Member, ...]) -> None:
    """Check that compiled code can evaluate the tasks in any state.

    Raises:
        InputError: A task is the user's own, or holds, or begins with, what it finds and has found
            nothing yet; or there are too many.
    """
    check_count(members, "a batch")
    for member in members:
        task = member.task
        if kind_of(task) == OWN:
            raise InputError(
                f"task {task.name!r} ({type(task).__name__}) is evaluated in Python, one state "
                "at a time; a batch takes the tasks of the library only"
            )
        if isinstance(task, ForceTask) and not task.measured_once:
            raise InputError(
                f"task {task.name!r}: the wrench of {task.sensor!r} has never been measured: call step "
                "before"
            )
        if isinstance(task, TrackingTask) and task.holds_nothing_yet:
            raise InputError(
                f"task {task.name!r} will hold what it finds at its first tick: give it a target, "
                "or call step before"
            )
        if isinstance(task, TrackingTask) and task.begins_where_found:
            raise InputError(
                f"task {task.name!r} will begin its way where its first tick finds the robot: call "
                "step before"
            )


def check_count(members: tuple[Member, ...], who: str) -> None:
    """Check that compiled code can take so many tasks.

    Raises:
        InputError: It cannot.
    """
    if not Plan.fits(members):
        raise InputError(f"{len(members)} tasks are more than {who} can take; some thirty fit")


def _remembered(plan: Plan) -> Record:
    """Return what a plan knows of the tick before."""
    tick = plan.tick
    found = {
        "group": tick.group.copy(),
        "remembers": tick.kind[:, REMEMBERS].copy(),
        "turn": tick.numbers[:, TURN : TURN + 4].copy(),
        "press": tick.press[:, :MEMORY_SIZE].copy(),
        "row_unrest": tick.row_unrest.copy(),
        "unrest_at": tick.unrest_at.copy(),
    }
    return REMEMBERED.make({}, found)
