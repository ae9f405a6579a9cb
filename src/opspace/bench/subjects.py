"""What is timed in a scene: functions of the state that do one tick each."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np

from opspace.bench.scenes import Scene
from opspace.controller import ReferenceController
from opspace.plan.entries import KERNELS
from opspace.robots.adapter import AdapterBase, held_joints
from opspace.robots.protocol import Robot
from opspace.tasks import OrientationTask, PoseTask, PositionTask, PostureTask

Tick = Callable[[np.ndarray, np.ndarray], object]

LIBRARY, MODEL, READABLE, PLACO = "opspace", "model calls alone", "readable form", "placo"


def subjects(scene: Scene, readable: bool = False) -> dict[str, Tick]:
    """Build everything that can be timed in a scene.

    Args:
        scene: The scene.
        readable: Time the readable form of the tick as well.

    Returns:
        One function per subject, each with a robot of its own.
    """
    found: dict[str, Tick] = {}
    controller = scene.controller()
    KERNELS.load()
    t = scene.time
    wrenches = scene.wrenches
    found[LIBRARY] = lambda q, v: controller.step(t, q, v, wrenches=wrenches)
    robot = scene.robot()
    found[MODEL] = _model_calls(robot)
    if readable:
        slow = scene.controller(ReferenceController)
        found[READABLE] = lambda q, v: slow.step(t, q, v, wrenches=wrenches)
    urdf = robot.source is not None and robot.source.suffix == ".urdf"
    if scene.peers and urdf and importlib.util.find_spec("placo") is not None:
        found[PLACO] = placo_tick(scene)
    return found


def _model_calls(robot: Robot) -> Tick:
    """Put the state to the robot's own library, which the controller does not need to do."""
    assert isinstance(robot, AdapterBase)

    def tick(q: np.ndarray, v: np.ndarray) -> None:
        robot.place(q, v)
        robot.catch_up()

    return tick


def placo_tick(scene: Scene) -> Tick:
    """Put the nearest equivalent of a scene to placo's dynamics solver.

    Tasks above the last level are hard constraints as long as they fit the joints, everything else is
    soft; limits of joints and torques are off, as they are inequalities there.
    """
    import placo  # noqa: PLC0415 - an optional peer  # pyright: ignore[reportMissingImports]

    from opspace.robots.urdf import read_urdf  # noqa: PLC0415
    from opspace.robots.urdf_export import to_xml  # noqa: PLC0415

    robot = scene.robot()
    source = robot.source
    assert source is not None
    urdf = read_urdf(source, held_joints(robot))
    wrapper = placo.RobotWrapper(
        "", int(placo.Flags.ignore_collisions), to_xml(urdf, inertias=True)
    )
    solver = placo.DynamicsSolver(wrapper)
    solver.mask_fbase(True)
    solver.dt = 1e-3
    q, v = scene.states(robot)
    robot.update(q[0], v[0])
    levels = scene.levels()
    rows = 0
    for number, level in enumerate(levels):
        for task in level:
            task.bind(robot)
            rows += task.rows
            hard = number < len(levels) - 1 and rows <= robot.nv
            _add(solver, robot, wrapper, task, "hard" if hard else "soft")
    state, rate = wrapper.state.q.copy(), wrapper.state.qd.copy()

    def tick(q: np.ndarray, v: np.ndarray) -> object:
        state[7:], rate[6:] = q, v
        wrapper.state.q, wrapper.state.qd = state, rate
        wrapper.update_kinematics()
        return solver.solve(False).tau

    return tick


def _add(solver: Any, robot: Robot, wrapper: Any, task: Any, priority: str) -> None:
    if isinstance(task, PostureTask):
        posture = dict(zip(wrapper.joint_names(), robot.q.tolist(), strict=True))
        added = solver.add_joints_task()
        added.set_joints(posture)
        added.configure(task.name, "soft", 1e-3)
        return
    frame = task.source.id
    name = robot.frame_names[frame]
    R, p = robot.rotation(frame), robot.position(frame)
    if isinstance(task, PoseTask):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = R, p
        solver.add_frame_task(name, pose).configure(task.name, priority, 1.0, 1.0)
    elif isinstance(task, OrientationTask):
        solver.add_orientation_task(name, R).configure(task.name, priority, 1.0)
    elif isinstance(task, PositionTask):
        solver.add_position_task(name, p).configure(task.name, priority, 1.0)
