"""How many robots a second `Fleet.step` gets through."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from opspace.bench.newton_steps import NewtonSteps, newton_is_installed
from opspace.bench.scenes import SCENES
from opspace.errors import MissingExtraError
from opspace.fleet import Fleet
from opspace.fleet.warp_library import warp
from opspace.robots.protocol import Robot
from opspace.stack import Stack
from opspace.tasks import JointLimits, PoseTask, PostureTask
from opspace.tasks.rotation import quaternion_from_matrix

FLEET_HEADS = ("robot", "device", "robots", "who", "ticks/s", "µs a robot", "of Newton's time")
COUNTS = (1, 64, 4096)
ON_CARDS = (65536,)
"""Numbers of robots that are tried on graphics cards only."""
TURNS = 15
"""Turns of all subjects with each number of robots; the medians count."""
NEWTON, GIVEN = "Newton", "dynamics given"
KP = 100.0

Step = Callable[[], object]


def fleet_steps(
    counts: Sequence[int] = COUNTS,
    dtypes: Sequence[str] = ("float64", "float32"),
    turns: int = TURNS,
) -> list[tuple[str, ...]]:
    """Time fleets in turns with Newton's controller, where that is installed, on every device.

    All keep a pose above a posture. Fleets keep joint limits and fade singular directions as well,
    and compute the dynamics except one, which is given inertia, bias, Jacobians and drift; Newton's
    controller is given inertia, Jacobians and gravity. On a processor one core does all.

    Args:
        counts: Numbers of robots.
        dtypes: Types of numbers of the fleets.
        turns: How often each subject is timed.

    Returns:
        Rows for `FLEET_HEADS`.

    Raises:
        MissingExtraError: Warp is not installed.
    """
    wp, rows = warp(), []
    try:
        name, robot = "panda", SCENES["panda"].robot()
    except MissingExtraError:
        name, robot = "puma", SCENES["puma"].robot()
    for device in wp.get_devices():
        for count in [*counts, *(() if device.is_cpu else ON_CARDS)]:
            subjects = _subjects(name, robot, count, dtypes, device)
            seconds = {who: np.zeros(turns) for who in subjects}
            for k in range(turns):
                for who, step in subjects.items():
                    start = perf_counter()
                    step()
                    wp.synchronize_device(device)
                    seconds[who][k] = perf_counter() - start
            for who, times in seconds.items():
                rate = count / float(np.median(times))
                part = f"{np.median(times / seconds[NEWTON]):.2f}" if NEWTON in seconds else ""
                told = (name, str(device), str(count), who, f"{rate:,.0f}")
                rows.append((*told, f"{1e6 / rate:.3g}", part))
    return rows


def _subjects(
    name: str, robot: Robot, count: int, dtypes: Sequence[str], device: Any
) -> dict[str, Step]:
    """Build what is timed, and let each do its first step."""
    wp, scene = warp(), SCENES[name]
    Q, V = (np.resize(x, (count, x.shape[1])) for x in scene.states(robot))
    reference = scene.states(robot)[0][0]
    found: dict[str, Step] = {}
    for dtype, dynamics in [*((dtype, "own") for dtype in dtypes), (dtypes[-1], "given")]:
        stack, options = fleet_stack(robot, reference), {"device": device, "dtype": dtype}
        fleet = Fleet(scene.robot(), stack, count, dynamics=dynamics, **options)
        who = f"opspace {dtype}"
        if dynamics == "given":
            _give(fleet, robot, Q, V)
            who = f"{who}, {GIVEN}"
        q, v = (wp.array(x.astype(dtype), device=device) for x in (Q, V))
        found[who] = lambda fleet=fleet, q=q, v=v: fleet.step(1e-3, q, v)
    if newton_is_installed() and robot.nv > 6:
        found[NEWTON] = NewtonSteps(robot, Q, V, reference, KP, device).step
    for step in found.values():
        step()  # compiles
    return found


def _give(fleet: Fleet, robot: Robot, Q: np.ndarray, V: np.ndarray) -> None:
    """Tell a fleet the dynamics, as its simulator would; states that repeat are looked at once."""
    states, which = np.unique(np.hstack([Q, V]), axis=0, return_inverse=True)
    pose, frame, known = fleet["pose"], robot.frame_id(robot.tool), []
    for state in states:
        robot.update(*np.split(state, [Q.shape[1]]))
        turn = quaternion_from_matrix(robot.rotation(frame))
        place = np.array([*robot.position(frame), *turn])
        motion = (place, robot.jacobian(frame), robot.drift(frame))
        known.append([np.array(x) for x in (robot.M, robot.bias, *motion)])
    arrays = (fleet.M, fleet.bias, pose.pose, pose.jacobian, pose.drift)
    for array, rows in zip(arrays, zip(*known, strict=True), strict=True):
        array.assign(np.array(rows)[which.reshape(-1)])


def fleet_stack(robot: Robot, reference: np.ndarray, *, limits: bool = True) -> Stack:
    """Make the stack that is timed, a pose above a posture.

    Args:
        robot: The robot.
        reference: (n,) posture, rad; the pose is the tool's there.
        limits: Whether joint limits are kept.
    """
    robot.update(reference, np.zeros(robot.nv))
    frame = robot.frame_id(robot.tool)
    goal = np.eye(4)
    goal[:3, :3], goal[:3, 3] = robot.rotation(frame), robot.position(frame)
    tasks = [[PoseTask(target=goal, kp=KP, name="pose")], [PostureTask(target=reference, kp=KP)]]
    return Stack(tasks, limits=JointLimits() if limits else None)
