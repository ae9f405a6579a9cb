"""TSID, the task-space inverse dynamics library, behind the controller's interface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, ContactStatus, Found, Status, TaskStatus
from opspace.compare.laws import SOFTNESS
from opspace.compare.tsid_model import TsidModel
from opspace.compare.tsid_on_contacts import COST, StandingProgram
from opspace.controller import ReferenceController
from opspace.controller.wrenches import Wrenches
from opspace.errors import InputError
from opspace.stack import ContactMember, Member


class TsidController(ReferenceController):
    """Every task a cost of one quadratic program; `ArmProgram` and `StandingProgram` say which.

    There are no speed limits in the tasks.
    """

    _program: Any = None

    def step(
        self, t: float, q: ArrayLike, v: ArrayLike, *, wrenches: Wrenches | None = None
    ) -> Command:
        """See `opspace.Controller.step`."""
        q, v = np.array(q, dtype=float), np.array(v, dtype=float)
        robot = self.robot
        robot.update(q, v)
        if self._program is None:
            if self.collisions is not None:
                raise InputError("this form of TSID keeps nothing apart: run it without collisions")
            self._program = StandingProgram(self) if robot.floating_base else ArmProgram(self)
        members = self.stack.begin_tick(float(t))
        touching = self.stack.begin_contacts(float(t)) if robot.floating_base else ()
        if wrenches is not None or self._forces is not None:
            raise InputError("the method tsid cannot press: it has no force tasks")
        tau, solved, contacts = self._program.solve(t, q, v, members, touching)
        status = Status.OK if solved and np.all(np.isfinite(tau)) else Status.FAULT
        if status:
            tau = self._braking()
        else:
            self._last_torque = tau if robot.floating_base else None
        tasks = {}
        for member in members:
            error = member.task.evaluate(robot, float(t)).error
            h = member.presence.value(float(t))
            norm = float(np.linalg.norm(error))
            tasks[member.task.name] = TaskStatus(h, ((member.level, 1.0),), error, norm)
        return Command(float(t), tau, status, 1, Found(tasks, (), {}, contacts=contacts))


class ArmProgram:
    """TSID's formulation for the robot of a controller that is bolted down, without joint limits.

    Tasks come and go with the transition durations that TSID takes; a task that moves changes its
    weight, 100 to 1 from level to level, with its activation.

    Raises:
        InputError: TSID is not there, or the robot does not come from a URDF.
    """

    def __init__(self, controller: ReferenceController) -> None:
        self._model = model = TsidModel(controller.robot)
        self._formulation = model.tsid.InverseDynamicsFormulationAccForce(
            "all", model.wrapper, False
        )
        self._solver = model.tsid.SolverHQuadProgFast("solver")
        self._tasks: dict[str, tuple[Any, float]] = {}

    def solve(
        self,
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        members: Sequence[Member],
        touching: Sequence[ContactMember],
    ) -> tuple[np.ndarray, bool, dict[str, ContactStatus]]:
        """See `StandingProgram.solve`; there are no contacts."""
        del touching
        self._formulation.computeProblemData(t, q, v)
        for name in set(self._tasks) - {member.task.name for member in members}:
            self._formulation.removeTask(name, 0.0)
            del self._tasks[name]
        for member in members:
            self._update(member, t)
        f = self._formulation
        self._solver.resize(f.nVar, f.nEq, f.nIn)
        found = self._solver.solve(f.computeProblemData(t, q, v))
        return np.array(f.getActuatorForces(found)), found.status == 0, {}

    def _update(self, member: Member, t: float) -> None:
        name = member.task.name
        weight = SOFTNESS**-member.level
        if name not in self._tasks:
            task = self._model.task(member.task)
            ramp = member.presence.ramp
            self._formulation.addMotionTask(task, weight, COST, float(ramp.duration))
            self._tasks[name] = task, weight
        task, before = self._tasks[name]
        wanted = weight * max(member.presence.value(t), 1e-9)
        if wanted != before:
            self._formulation.updateTaskWeight(name, wanted)
            self._tasks[name] = task, wanted
        task.setReference(self._model.sample(member.task, t))
