"""What one tick answers: the torque, and what a person wants to know about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Flag, IntFlag
from typing import NamedTuple, Protocol

import numpy as np


class Status(IntFlag):
    """What happened in a tick; several may hold at once, 0 is an ordinary tick."""

    OK = 0
    DIRECTION_OFF = 1
    """A singular direction is partly or fully deactivated."""
    JOINT_LIMIT = 2
    """A joint-limit task is partly or fully active."""
    ABOVE_TORQUE_LIMIT = 4
    """The tasks ask for more than the robot's motors give."""
    TORQUE_SCALED = 16
    """Levels, the lowest first, got less torque than they asked for."""
    LATE = 32
    """A tick was missed: more than one and a half periods have passed."""
    TIME_JUMP = 64
    """Time stood still, ran backwards, or jumped by more than ten periods."""
    STALE = 128
    """The state is that of the tick before to the last bit, although the robot moves."""
    FILTERED = 256
    """The torque is the nearest one that keeps what every joint may do: limits pushed each other, or
    the motors."""
    LIMIT_LOST = 512
    """No torque of the motors keeps what every joint may do, and the excess is as small as can be; or a
    joint came too fast to be stopped at its limit."""
    HANDOVER = 1024
    """The torque is on its way from or to another controller's."""
    WRENCH_STALE = 2048
    """A wrench that a task needs has not been measured lately; the task presses on without it."""
    COLLISION = 4096
    """A pair of bodies is kept from coming nearer: tasks get less than they ask for."""
    COLLISION_LOST = 8192
    """No torque of the motors keeps a pair of bodies from soon closing faster than it can be stopped;
    the excess is as small as can be."""
    GIVEN_UP = 16384
    """Contacts, motors or joints do not allow what the tasks want, and more than a thousandth of the
    weight was given up."""
    CONTACT_WAITS = 32768
    """A contact that is to go stays, because the others cannot carry what it does."""
    NOT_BALANCED = 65536
    """What was given up is more than 0.3 weights: the robot will fall if this lasts."""
    FALLING = 1048576
    """The robot is given up, by the rule that the controller was given: its joints are only damped."""
    FAULT = 8
    """No finite torque was found; the command is bias compensation with damping."""

    __str__ = Flag.__str__  # names rather than a number, also from Python 3.11 on


@dataclass(frozen=True, slots=True)
class TaskStatus:
    """One task in one tick.

    Attributes:
        activation: h of the task, 0 to 1: its presence in the stack times its own activation.
        levels: Numbers of the levels where it is, each with its weight; more than one while the task
            moves. The weights sum to 1.
        error: (m,) x_d − x, in the units of the task's rows.
        error_norm: Euclidean norm of ``error``.
    """

    activation: float
    levels: tuple[tuple[float, float], ...]
    error: np.ndarray
    error_norm: float


@dataclass(frozen=True, slots=True)
class LevelStatus:
    """One level in one tick.

    Attributes:
        level: Number of the level.
        tasks: Names of its tasks; during transitions those of the stack with the largest weight
            among the ones that have tasks here, which the directions belong to.
        sigma: (k,) eigenvalues of the projected inverse inertia of the level, Eq. 25, strongest
            first; multiples of the tasks' reference values unless the buffer is absolute.
        activation: (k,) activation of each direction: below 1 its motion is released to the levels
            below.
        response: (k,) part of what the tasks ask for that each direction answers; below 1 it follows
            slower and is damped, but arrives.
        directions: (m, k) the directions as columns, in the stacked rows of the tasks.
        scale: Part of its torque that the level got; below 1 only with ``torque_limits="priority"``.
    """

    level: float
    tasks: tuple[str, ...]
    sigma: np.ndarray
    activation: np.ndarray
    response: np.ndarray
    directions: np.ndarray
    scale: float = 1.0


@dataclass(frozen=True, slots=True)
class ContactStatus:
    """One contact in one tick.

    Attributes:
        progress: How far it has come, 0 out to 1 in.
        motion: h_m, activation of its motion.
        activation: h_f, activation of its force.
        force: (3,) force on the robot that the command plans, in world axes, N.
        moment: (3,) moment about the contact's point, in world axes, N·m; zero for a point.
        cop: (2,) centre of pressure in the contact's axes, m; zero where nothing presses.
        cone_use: Part of its cone that the force uses, 1 at the edge.
        waiting: Whether it is to go and stays because the others cannot carry.
    """

    progress: float
    motion: float
    activation: float
    force: np.ndarray
    moment: np.ndarray
    cop: np.ndarray
    cone_use: float
    waiting: bool


@dataclass(frozen=True, slots=True)
class Distance:
    """Two bodies in one tick.

    Attributes:
        distance: Between their shapes, m; below zero where they overlap.
        taken: By how much the pair slows down how fast its distance shrinks, m/s²; 0 where it does
            not act.
    """

    distance: float
    taken: float


class Report(Protocol):
    """What a tick tells about tasks, levels and limits, perhaps worked out only when asked."""

    @property
    def distances(self) -> Mapping[str, Distance]:
        """Pairs of bodies that are kept apart, by "body/body", the nearest first."""
        ...

    @property
    def tasks(self) -> Mapping[str, TaskStatus]:
        """Status of each task in the stack by name."""
        ...

    @property
    def levels(self) -> tuple[LevelStatus, ...]:
        """Status of each level, most important first; joint limits are not among them."""
        ...

    @property
    def limits(self) -> Mapping[str, float]:
        """Activation of the joint-limit tasks that are not at 0, by "joint/side"."""
        ...

    @property
    def contacts(self) -> Mapping[str, ContactStatus]:
        """Status of each contact by name."""
        ...


NO_CONTACTS: Mapping[str, ContactStatus] = {}


@dataclass(frozen=True, slots=True)
class Found:
    """A report that is complete from the start; the attributes are those of `Report`."""

    tasks: Mapping[str, TaskStatus]
    levels: tuple[LevelStatus, ...]
    limits: Mapping[str, float]
    distances: Mapping[str, Distance] = field(default_factory=dict)
    contacts: Mapping[str, ContactStatus] = field(default_factory=dict[str, ContactStatus])


class Command(NamedTuple):
    """The answer of one tick.

    Attributes:
        t: Time of the tick, s.
        tau: (n,) joint torque, N·m, bias included; always finite.
        status: What happened.
        hard_solves: Hard torques that entered the blend.
        report: Tasks, levels and limits; read them as attributes of the command.
    """

    t: float
    tau: np.ndarray
    status: Status
    hard_solves: int
    report: Report

    def __repr__(self) -> str:
        present = ", ".join(f"{name} {task.activation:.2g}" for name, task in self.tasks.items())
        size = float(np.linalg.norm(self.tau))
        return f"Command(t={self.t:g} s, {self.status!s}, |tau|={size:.4g} N·m, tasks: {present})"

    @property
    def tasks(self) -> Mapping[str, TaskStatus]:
        """Status of each task in the stack by name."""
        return self.report.tasks

    @property
    def levels(self) -> tuple[LevelStatus, ...]:
        """Status of each level, most important first; joint limits are not among them."""
        return self.report.levels

    @property
    def limits(self) -> Mapping[str, float]:
        """Activation of the joint-limit tasks that are not at 0, by "joint/side"."""
        return self.report.limits

    @property
    def contacts(self) -> Mapping[str, ContactStatus]:
        """Status of each contact by name."""
        return self.report.contacts

    @property
    def distances(self) -> Mapping[str, Distance]:
        """Pairs of bodies that are kept apart, by "body/body", the nearest first."""
        return self.report.distances
