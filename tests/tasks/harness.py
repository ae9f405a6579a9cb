"""Robots, tasks and numerical derivatives that the tests of tasks share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from opspace import tasks
from opspace.errors import MissingExtraError
from opspace.robots import load_robot
from opspace.robots.protocol import Robot
from opspace.tasks import Task, TaskTerms

# A floating base, a hinge, a slide and a ball: every kind of joint in one small tree.
TREE = """
<mujoco model="tree">
  <worldbody>
    <body name="trunk" pos="0 0 1">
      <freejoint name="root"/>
      <geom type="box" size="0.2 0.1 0.1" mass="3"/>
      <body name="arm" pos="0.2 0 0.1">
        <joint name="shoulder" type="hinge" axis="0.6 0.8 0"/>
        <geom type="capsule" size="0.03 0.1" pos="0 0 0.1" mass="1"/>
        <body name="slider" pos="0 0 0.25">
          <joint name="rail" type="slide" axis="0 0.28 0.96"/>
          <geom type="capsule" size="0.03 0.1" pos="0 0 0.1" mass="0.7"/>
          <body name="hand" pos="0 0 0.2">
            <joint name="wrist" type="ball"/>
            <geom type="box" size="0.03 0.05 0.08" pos="0 0.02 0.05" mass="0.5"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

ROBOTS = ("puma560", "panda", "tree")


def make_robot(name: str, folder: Path) -> Robot:
    if name == "tree":
        path = folder / "tree.xml"
        path.write_text(TREE)
        return load_robot(path)
    try:
        return load_robot(name)
    except MissingExtraError as error:
        pytest.skip(str(error))


def base_frame(robot: Robot) -> str:
    """Return a frame low on the chain that moves, for relative tasks."""
    robot.update(robot.q_reference, np.zeros(robot.nv))
    moving = [
        name
        for name in robot.frame_names
        if np.abs(robot.jacobian(robot.frame_id(name))).any(axis=0).sum() > 0
    ]
    return moving[0] if robot.floating_base else moving[1]


OFFSET = (0.03, -0.05, 0.11)

TASKS: dict[str, Callable[[Robot], Task]] = {
    "position": lambda _: tasks.PositionTask(),
    "position offset": lambda _: tasks.PositionTask(offset=OFFSET),
    "position zx": lambda _: tasks.PositionTask(axes="zx"),
    "position tool": lambda _: tasks.PositionTask(axes_frame="tool"),
    "position tool y offset": lambda _: tasks.PositionTask(
        axes="y", axes_frame="tool", offset=OFFSET
    ),
    "orientation": lambda _: tasks.OrientationTask(),
    "orientation yz": lambda _: tasks.OrientationTask(axes="yz"),
    "orientation tool x": lambda _: tasks.OrientationTask(axes="x", axes_frame="tool"),
    "pose": lambda _: tasks.PoseTask(),
    "pose tool offset": lambda _: tasks.PoseTask(axes_frame="tool", offset=OFFSET),
    "com": lambda _: tasks.ComTask(),
    "com xy": lambda _: tasks.ComTask(axes="xy"),
    "relative position": lambda r: tasks.RelativePositionTask(None, base_frame(r)),
    "relative orientation": lambda r: tasks.RelativeOrientationTask(None, base_frame(r)),
    "relative orientation z": lambda r: tasks.RelativeOrientationTask(
        None, base_frame(r), axes="z"
    ),
    "relative pose": lambda r: tasks.RelativePoseTask(None, base_frame(r)),
    "posture": lambda _: tasks.PostureTask(),
    "posture some": lambda r: tasks.PostureTask(joints=r.joint_names[-1:-4:-1]),
    "joint": lambda r: tasks.JointTask(scalar_joint(r)),
}


def scalar_joint(robot: Robot) -> str:
    """Return a joint of one degree of freedom."""
    return next(name for name in robot.joint_names if "/" not in name)


def bound(name: str, robot: Robot) -> Task:
    task = TASKS[name](robot)
    task.bind(robot)
    return task


def random_state(robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    q = robot.integrate(robot.q_reference, rng.uniform(-0.5, 0.5, robot.nv), 1.0)
    return q, rng.uniform(-1.0, 1.0, robot.nv)


def terms_at(task: Task, robot: Robot, q: np.ndarray, v: np.ndarray, t: float = 0.0) -> TaskTerms:
    robot.update(q, v)
    return task.evaluate(robot, t)


def numerical_velocity(task: Task, robot: Robot, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the rate of the task value along v, from the error to the value held at q."""
    step = 1e-5
    task.reset()
    terms_at(task, robot, q, v)
    ahead = terms_at(task, robot, robot.integrate(q, v, step), v).error
    behind = terms_at(task, robot, robot.integrate(q, v, -step), v).error
    return (behind - ahead) / (2.0 * step)


def numerical_drift(task: Task, robot: Robot, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return d(J v)/dt along constant v."""
    step = 1e-5
    ahead = terms_at(task, robot, robot.integrate(q, v, step), v).J @ v
    behind = terms_at(task, robot, robot.integrate(q, v, -step), v).J @ v
    return (ahead - behind) / (2.0 * step)
