"""The controller: the tick of the readable form, compiled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from opspace.controller.command import Command, Status
from opspace.controller.compiled.layout import (
    DAMPING,
    KEEP_TORQUE,
    OPTION_SIZE,
    ROOM,
    SIGMA_LOWER,
    SIGMA_PROFILE,
    SIGMA_UPPER,
    SINGULAR,
    SOLVE,
    STATE_NOT_FINITE,
    TASK_BIAS,
)
from opspace.controller.compiled.plan import Plan
from opspace.controller.compiled.report import CompiledReport
from opspace.controller.compiled.tick import tick
from opspace.controller.compiled.warm_up import compiled_tick
from opspace.controller.tick import ReferenceController
from opspace.errors import InputError
from opspace.law.compiled.profiles import PROFILE_CODE
from opspace.robots.base import AdapterBase
from opspace.robots.motion_axes import MotionAxes
from opspace.stack import Member

STATUSES = tuple(Status(bits) for bits in range(1024))


class Controller(ReferenceController):
    """Operational space control of a stack of tasks on a robot.

    Every tick is one call of compiled code, which computes what `ReferenceController` computes; the
    arguments, errors and results are the same. The first controller on a machine compiles it, which
    takes half a minute; later ones read it from the disk.

    Options are fixed when it is built. Robots with joints of several coordinates, and stacks of more
    than some thirty tasks, take the readable form.
    """

    _axes: MotionAxes | None = None
    _plan: Plan | None = None

    def step(self, t: float, q: ArrayLike, v: ArrayLike) -> Command:
        """Compute the torque for one state; see `ReferenceController.step`."""
        axes = self._axes
        if axes is None:
            axes = self._axes = self._compiled_robot()
            if axes is None:
                return super().step(t, q, v)
            compiled_tick()
        t = float(t)
        if not math.isfinite(t):
            raise InputError(f"time must be finite, got {t}")
        robot: AdapterBase = self.robot  # pyright: ignore[reportAssignmentType]
        q, v = _vector(q), _vector(v)
        if q.shape != axes.q.shape or v.shape != axes.v.shape:
            robot.check_state(q, v)
        robot.place(q, v)
        timing = Status.OK
        if self._timing is not None:
            robot.check_state(q, v)
            timing = self._timing.check(t, q, v)
            if timing & Status.TIME_JUMP and self._holds:
                return self._hold(t, timing)
        members = self.stack.begin_tick(t)
        plan = self._plan
        if plan is None or members is not plan.members:
            if not Plan.fits(members):
                return super().step(t, q, v)
            plan = self._plan = self._planned(members, axes)
        plan.refresh(robot, t)
        observer = self._observer
        if observer is not None:
            observer.observe(t, v)
            plan.disturb(observer.acceleration)
        answer = tick(t, plan.handle)
        if answer < 0:
            if answer == STATE_NOT_FINITE:
                robot.check_state(q, v)
            return self._hold(t, timing | Status.FAULT)
        if observer is not None:
            observer.remember(t, v, plan.tick.joint_acceleration)
        found = plan.memory.copy()
        return Command(
            t,
            found[: plan.n],
            STATUSES[answer % SOLVE | timing],
            answer // SOLVE,
            CompiledReport(plan, found),
        )

    def warm_up(self) -> float:
        """Compile the tick, or read what was compiled before; the first tick does it otherwise.

        What is compiled depends neither on the robot nor on the stack, so nothing is compiled later,
        whatever transitions come.

        Returns:
            How long it took, s.
        """
        axes = self._axes = self._axes or self._compiled_robot()
        return 0.0 if axes is None else compiled_tick()

    def _compiled_robot(self) -> MotionAxes | None:
        robot = self.robot
        return robot.motion_axes() if isinstance(robot, AdapterBase) else None

    def _planned(self, members: tuple[Member, ...], axes: MotionAxes) -> Plan:
        plan = Plan(
            members,
            axes,
            self._scales,
            self.stack.limits,
            self.robot.torque_limit,
            self._options(),
            self._blending.room,
        )
        if self._plan is not None:
            plan.go_on_from(self._plan)
        return plan

    def _options(self) -> np.ndarray:
        option = np.zeros(OPTION_SIZE)
        singularity = self.singularity
        if singularity is not None:
            option[SINGULAR] = 1.0
            option[SIGMA_LOWER], option[SIGMA_UPPER] = singularity.lower, singularity.upper
            option[SIGMA_PROFILE] = PROFILE_CODE[singularity.profile]
        option[DAMPING] = self.damping
        option[TASK_BIAS] = float(self.bias == "task")
        option[ROOM] = self._blending.room
        option[KEEP_TORQUE] = float(self.torque_limits == "priority")
        return option


def _vector(value: ArrayLike) -> np.ndarray:
    return value if type(value) is np.ndarray else np.asarray(value, dtype=float)
