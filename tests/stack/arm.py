"""A redundant arm at one state, and tasks for it that ask for more than it has."""

import numpy as np

from opspace.robots import available_robots, load_robot
from opspace.tasks import JointTask, OrientationTask, PositionTask, PostureTask


def arm():
    """The Panda where its files are installed; else the arm that is always there."""
    installed = {info.name for info in available_robots() if info.installed}
    return load_robot("panda" if "panda" in installed else "puma560")


def tasks_for(robot):
    """Seven tasks with targets of their own, 17 rows on at most 7 joints."""
    robot.update(robot.q_reference, np.zeros(robot.nv))
    tool = robot.position(robot.frame_id(robot.tool))
    joints = robot.joint_names
    return [
        PositionTask(target=tool + [0.05, -0.1, 0.08], axes="z", name="height"),
        PositionTask(target=tool + [-0.04, 0.06, 0.0], axes="xy", name="table"),
        OrientationTask(target=np.eye(3), kp=25.0),
        JointTask(joints[0], float(robot.q_reference[0]) + 0.3, name="waist"),
        JointTask(joints[2], float(robot.q_reference[2]) - 0.2, name="elbow"),
        JointTask(joints[4], float(robot.q_reference[4]) + 0.2, name="wrist"),
        PostureTask(robot.q_reference + 0.1, kp=30.0),
    ]


def state(robot, seed=5):
    rng = np.random.default_rng(seed)
    q = robot.q_reference + rng.uniform(-0.15, 0.15, robot.nv)
    return q, rng.uniform(-0.3, 0.3, robot.nv)
