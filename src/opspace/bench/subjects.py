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
from opspace.robots.protocol import BASE, Robot
from opspace.tasks import ComTask, OrientationTask, PoseTask, PositionTask, PostureTask
from opspace.tasks.rotation import matrix_from_quaternion

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
    found[LIBRARY] = (
        (lambda q, v: controller.step(t, q, v))
        if wrenches is None
        else (lambda q, v: controller.step(t, q, v, wrenches=wrenches))
    )
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
    soft; limits of joints and torques are off, as they are inequalities there. A robot that stands has
    both on and its soles as hard constraints with their cones, all its tasks are soft.
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
    solver.mask_fbase(not robot.floating_base)
    solver.dt = 1e-3
    q, v = scene.states(robot)
    robot.update(q[0], v[0])
    levels = scene.levels()
    contacts = scene.contacts()
    for contact in contacts:
        contact.bind(robot)
        foot = _placed(robot, contact.frame_id)
        held = solver.add_frame_task(contact.frame, foot)
        held.configure(contact.name, "hard", 1.0, 1.0)
        sole = solver.add_planar_contact(held)
        sole.length, sole.width = (2.0 * side for side in contact.half)
        sole.mu = contact.friction
        sole.weight_forces = sole.weight_moments = 1e-3  # or the feet pull at each other
    if contacts:
        _keep_limits(solver, robot, wrapper)
    rows = 0
    for number, level in enumerate(levels):
        for task in level:
            task.bind(robot)
            rows += task.rows
            hard = number < len(levels) - 1 and rows <= robot.nv and not contacts
            _add(solver, robot, wrapper, task, "hard" if hard else "soft")
    state, rate = wrapper.state.q.copy(), wrapper.state.qd.copy()

    def tick(q: np.ndarray, v: np.ndarray) -> object:
        if robot.floating_base:
            w, x, y, z = q[3:7]
            state[:7], state[7:] = (*q[:3], x, y, z, w), q[7:]
            rate[:] = v
            rate[:3] = matrix_from_quaternion((w, x, y, z)).T @ v[:3]
        else:
            state[7:], rate[6:] = q, v
        wrapper.state.q, wrapper.state.qd = state, rate
        wrapper.update_kinematics()
        return solver.solve(False).tau

    return tick


def _add(solver: Any, robot: Robot, wrapper: Any, task: Any, priority: str) -> None:
    if isinstance(task, PostureTask):
        first = BASE + 1 if robot.floating_base else 0
        posture = dict(zip(wrapper.joint_names(), robot.q[first:].tolist(), strict=True))
        added = solver.add_joints_task()
        added.set_joints(posture)
        added.configure(task.name, "soft", 1e-3)
        return
    if isinstance(task, ComTask):
        solver.add_com_task(robot.com_position()).configure(task.name, priority, 1.0)
        return
    frame = task.source.id
    name = robot.frame_names[frame]
    R, p = robot.rotation(frame), robot.position(frame)
    if isinstance(task, PoseTask):
        solver.add_frame_task(name, _placed(robot, frame)).configure(task.name, priority, 1.0, 1.0)
    elif isinstance(task, OrientationTask):
        solver.add_orientation_task(name, R).configure(task.name, priority, 1.0)
    elif isinstance(task, PositionTask):
        solver.add_position_task(name, p).configure(task.name, priority, 1.0)


def _keep_limits(solver: Any, robot: Robot, wrapper: Any) -> None:
    """Let a solver keep the limits of joints and motors."""
    limits = robot.q_lower, robot.q_upper, robot.velocity_limit, robot.torque_limit
    for j, name in list(enumerate(robot.joint_names))[BASE:]:
        lower, upper, speed, torque = (float(limit[j]) for limit in limits)
        wrapper.set_joint_limits(name, lower, upper)
        wrapper.set_velocity_limit(name, speed)
        wrapper.set_torque_limit(name, torque)
    solver.enable_torque_limits(True)
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)


def _placed(robot: Robot, frame: int) -> np.ndarray:
    """Give where a frame is, (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = robot.rotation(frame), robot.position(frame)
    return pose
