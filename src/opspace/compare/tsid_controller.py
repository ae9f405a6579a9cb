"""TSID, the task-space inverse dynamics library, behind the controller's interface."""

# The compiled module tsid has no type stubs, and is not a dependency.
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
# ruff: noqa: PLC0415 - an optional peer

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, Found, Status, TaskStatus
from opspace.compare.laws import SOFTNESS
from opspace.controller import ReferenceController
from opspace.controller.wrenches import Wrenches
from opspace.errors import InputError
from opspace.stack import Member
from opspace.tasks import PostureTask
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import WorldFrame
from opspace.tasks.quantities import Orientation, Pose

WEIGHTED = 1
"""TSID's level of costs; its level 0 is for constraints that must hold exactly."""


def tsid_installed() -> bool:
    """Tell whether the package can be found."""
    return importlib.util.find_spec("tsid") is not None


class TsidController(ReferenceController):
    """Every task a cost of one quadratic program, 100 to 1 from level to level.

    Tasks come and go with the transition durations that TSID takes; a task that moves changes its
    weight with its activation. There are no joint limits and no speed limits in the tasks.
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
            if robot.floating_base:
                raise InputError(
                    f"the method tsid knows no contacts, and robot {robot.name!r} stands on them: "
                    "its robots are bolted down"
                )
            if self.collisions is not None:
                raise InputError("this form of TSID keeps nothing apart: run it without collisions")
            self._program = Program(self)
        members = self.stack.begin_tick(float(t))
        if wrenches is not None or self._forces is not None:
            raise InputError("the method tsid cannot press: it has no force tasks")
        tau, solved = self._program.solve(t, q, v, members)
        status = Status.OK if solved and np.all(np.isfinite(tau)) else Status.FAULT
        if status:
            tau = self._braking()
        tasks = {}
        for member in members:
            error = member.task.evaluate(robot, float(t)).error
            h = member.presence.value(float(t))
            norm = float(np.linalg.norm(error))
            tasks[member.task.name] = TaskStatus(h, ((member.level, 1.0),), error, norm)
        return Command(float(t), tau, status, 1, Found(tasks, (), {}))


class Program:
    """TSID's formulation for the robot of a controller.

    Raises:
        InputError: TSID is not installed, or the robot does not come from a URDF.
    """

    def __init__(self, controller: ReferenceController) -> None:
        if not tsid_installed():
            raise InputError("the method tsid needs TSID's Python package: pip install tsid")
        import tsid
        from pinocchio import StdVec_StdString

        from opspace.robots.adapter import held_joints
        from opspace.robots.urdf import read_urdf
        from opspace.robots.urdf_export import to_xml

        self._tsid, self._robot = tsid, controller.robot
        source = controller.robot.source
        if source is None or source.suffix != ".urdf":
            raise InputError(f"the method tsid needs a robot from a URDF, not {source}")
        urdf = read_urdf(source, held_joints(controller.robot))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "robot.urdf"
            path.write_text(to_xml(urdf, inertias=True), encoding="utf-8")
            self._wrapper = tsid.RobotWrapper(str(path), StdVec_StdString(), False)
        self._formulation = tsid.InverseDynamicsFormulationAccForce("all", self._wrapper, False)
        self._solver = tsid.SolverHQuadProgFast("solver")
        self._tasks: dict[str, tuple[Any, float]] = {}

    def solve(
        self, t: float, q: np.ndarray, v: np.ndarray, members: tuple[Member, ...]
    ) -> tuple[np.ndarray, bool]:
        """Bring the formulation up to date and solve it; returns the torque and whether it is one."""
        self._formulation.computeProblemData(t, q, v)
        for name in set(self._tasks) - {member.task.name for member in members}:
            self._formulation.removeTask(name, 0.0)
            del self._tasks[name]
        for member in members:
            self._update(member, t)
        f = self._formulation
        self._solver.resize(f.nVar, f.nEq, f.nIn)
        found = self._solver.solve(f.computeProblemData(t, q, v))
        return np.array(f.getActuatorForces(found)), found.status == 0

    def _update(self, member: Member, t: float) -> None:
        name = member.task.name
        weight = SOFTNESS**-member.level
        if name not in self._tasks:
            task = self._make(member.task)
            ramp = member.presence.ramp
            self._formulation.addMotionTask(task, weight, WEIGHTED, float(ramp.duration))
            self._tasks[name] = task, weight
        task, before = self._tasks[name]
        wanted = weight * max(member.presence.value(t), 1e-9)
        if wanted != before:
            self._formulation.updateTaskWeight(name, wanted)
            self._tasks[name] = task, wanted
        task.setReference(self._sample(member.task, t))

    def _make(self, task: Any) -> Any:
        """Make TSID's task with the same rows and gains."""
        tsid, gains = self._tsid, task._gains
        if isinstance(task, PostureTask):
            made = tsid.TaskJointPosture(task.name, self._wrapper)
            mask = np.zeros(self._robot.nv)
            rows = _coordinates(task)
            mask[rows] = 1.0
            made.setMask(mask)
            size = self._robot.nv
        elif isinstance(task, MotionTask) and isinstance(task.source, WorldFrame):
            frame = self._robot.frame_names[task.source.id]
            made = tsid.TaskSE3Equality(task.name, self._wrapper, frame)
            made.useLocalFrame(False)
            mask = np.zeros(6)
            rows = np.flatnonzero(task.selection.any(axis=0)) + task.quantity.block.start
            mask[rows] = 1.0
            made.setMask(mask)
            size = 6
        else:
            raise InputError(f"the method tsid has no task like {task.name!r}")
        kp, kv = np.ones(size), np.ones(size)
        kp[rows], kv[rows] = gains.kp, gains.kv
        made.setKp(kp)
        made.setKd(kv)
        return made

    def _sample(self, task: Any, t: float) -> Any:
        desired, robot = task.desired(self._robot, t), self._robot
        if isinstance(task, PostureTask):
            x, rate, ahead = robot.q.copy(), np.zeros(robot.nv), np.zeros(robot.nv)
            rows = _coordinates(task)
            x[rows], rate[rows], ahead[rows] = desired
        else:
            frame = task.source.id
            position, R = robot.position(frame), robot.rotation(frame)
            if isinstance(task.quantity, Pose):
                position, R = desired.x[:3, 3], desired.x[:3, :3]
            elif isinstance(task.quantity, Orientation):
                R = desired.x
            else:
                position = desired.x
            x = np.concatenate((position, R.T.reshape(9)))
            rate, ahead = np.zeros(6), np.zeros(6)
            rate[task.quantity.block], ahead[task.quantity.block] = desired.v, desired.a
        sample = self._tsid.TrajectorySample(x.size, rate.size)
        sample.value(x)
        sample.derivative(rate)
        sample.second_derivative(ahead)
        return sample


def _coordinates(task: PostureTask) -> np.ndarray:
    """Velocity coordinates of the joints of a bound posture task."""
    layout = task.layout
    assert layout is not None  # bound
    return layout.coordinates
