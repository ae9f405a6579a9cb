"""TSID's own model of a robot, and TSID's tasks for ours."""

# The compiled module tsid has no type stubs, and is not a dependency.
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
# ruff: noqa: PLC0415 - an optional peer

from __future__ import annotations

import importlib
import importlib.util
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from opspace.errors import InputError
from opspace.robots.adapter import added_armature, held_joints
from opspace.robots.protocol import Robot
from opspace.tasks import Task
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import CenterOfMass, WorldFrame
from opspace.tasks.posture import PostureTask
from opspace.tasks.quantities import Orientation, Pose
from opspace.tasks.rotation import matrix_from_quaternion

PACKAGE, COMPILED = "tsid", "tsid_pywrap"
INSTALLS_TSID = "pip install tsid==1.7.1 pin==3.4.0 'cmeel-urdfdom<5' 'cmeel-tinyxml2<11'"
"""What installs a release that has been tried, in an environment of its own."""


def tsid_installed() -> bool:
    """Tell whether the package can be found; a folder that has its name is not it."""
    spec = importlib.util.find_spec(PACKAGE)
    places = [] if spec is None else spec.submodule_search_locations or []
    return any(any(Path(place).glob(f"{COMPILED}*")) for place in places)


def tsid_module() -> Any:
    """Import TSID's compiled module.

    Raises:
        InputError: It is not installed, or does not import.
    """
    needs = f"the method tsid needs TSID's Python package: {INSTALLS_TSID}"
    if not tsid_installed():
        raise InputError(needs)
    try:
        importlib.import_module("pinocchio")  # whose types TSID's functions take
        return importlib.import_module(f"{PACKAGE}.{COMPILED}")
    except ImportError as error:
        raise InputError(f"{needs}; the one that is there does not import: {error}") from error


def lacks_in_tsid(robot: Robot) -> str:
    """Say why TSID cannot drive a robot here; empty where it can."""
    try:
        tsid_module()
    except InputError as error:
        return str(error)
    if robot.source is None or robot.source.suffix != ".urdf":
        return f"the method tsid needs a robot from a URDF, not {robot.source}"
    return ""


class TsidModel:
    """A robot of ours as TSID sees it.

    Attributes:
        tsid: The module.
        wrapper: TSID's robot.
        robot: Ours.
        base: Number of velocity coordinates of the floating base, 0 for none.

    Raises:
        InputError: TSID is not there, or the robot does not come from a URDF.
    """

    def __init__(self, robot: Robot) -> None:
        if lacking := lacks_in_tsid(robot):
            raise InputError(lacking)
        self.tsid, self.robot = tsid_module(), robot
        self.base = 6 if robot.floating_base else 0
        self.wrapper = _wrapper(self.tsid, robot)
        joints = list(self.wrapper.model().names)[-(robot.nv - self.base) :]
        assert joints == list(robot.joint_names[self.base :])

    def state(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Write a state as TSID has it: quaternions end with w, the base moves in its own axes."""
        if not self.base:
            return q, v
        turned = matrix_from_quaternion(tuple(q[3:7].tolist()))
        return (
            np.concatenate([q[:3], q[4:7], q[3:4], q[7:]]),
            np.concatenate([turned.T @ v[:3], v[3:]]),
        )

    def task(self, task: Task) -> Any:
        """Make TSID's task with the same rows and gains.

        Raises:
            InputError: TSID has none like it.
        """
        tsid, wrapper, size = self.tsid, self.wrapper, 6
        if isinstance(task, PostureTask):
            made = tsid.TaskJointPosture(task.name, wrapper)
            rows, size = self._coordinates(task), self.robot.nv - self.base
        elif isinstance(task, MotionTask) and isinstance(task.source, WorldFrame):
            frame = self.robot.frame_names[task.source.id]
            made = tsid.TaskSE3Equality(task.name, wrapper, frame)
            made.useLocalFrame(False)
            rows = np.flatnonzero(task.selection.any(axis=0)) + task.quantity.block.start
        elif isinstance(task, MotionTask) and isinstance(task.source, CenterOfMass):
            made = tsid.TaskComEquality(task.name, wrapper)
            rows, size = np.flatnonzero(task.selection.any(axis=0)), 3
        else:
            raise InputError(f"the method tsid has no task like {task.name!r}")
        mask, kp, kv = np.zeros(size), np.ones(size), np.ones(size)
        gains = task._gains
        mask[rows], kp[rows], kv[rows] = 1.0, gains.kp, gains.kv
        made.setMask(mask)
        made.setKp(kp)
        made.setKd(kv)
        return made

    def sample(self, task: Any, t: float) -> Any:
        """Write down where a task is to be, and how that moves."""
        desired, robot = task.desired(self.robot, t), self.robot
        if isinstance(task, PostureTask):
            n, rows = robot.nv - self.base, self._coordinates(task)
            x, rate, ahead = robot.q[-n:].copy(), np.zeros(n), np.zeros(n)
            x[rows], rate[rows], ahead[rows] = desired
        elif isinstance(task.source, CenterOfMass):
            x, rate, ahead = desired
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
        sample = self.tsid.TrajectorySample(x.size, rate.size)
        sample.value(x)
        sample.derivative(rate)
        sample.second_derivative(ahead)
        return sample

    def _coordinates(self, task: PostureTask) -> np.ndarray:
        """Number the joints of a bound posture task as TSID does, which leaves out the base."""
        layout = task.layout
        assert layout is not None  # bound
        return layout.coordinates - self.base


def _wrapper(tsid: Any, robot: Robot) -> Any:
    """Hand the robot's URDF to TSID."""
    import pinocchio as pin

    from opspace.robots.urdf import read_urdf
    from opspace.robots.urdf_export import to_xml

    source = robot.source
    assert source is not None  # see `lacks_in_tsid`
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        urdf = read_urdf(source, held_joints(robot))
        path.write_text(to_xml(urdf, inertias=True), encoding="utf-8")
        root = (pin.JointModelFreeFlyer(),) if robot.floating_base else ()
        model = pin.buildModelFromUrdf(str(path), *root)
    armature = np.full(model.nv, added_armature(robot))
    armature[: 6 if root else 0] = 0.0
    model.armature = armature
    kind = tsid.FLOATING_BASE_SYSTEM if root else tsid.FIXED_BASE_SYSTEM
    return tsid.RobotWrapper(model, kind, False)
