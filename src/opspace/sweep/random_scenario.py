"""Scenarios drawn at random: robots, tasks, targets, transitions and everything that can be wrong."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from opspace.robots import Robot, load_robot
from opspace.robots.registry import available_robots
from opspace.sweep.random_obstacles import random_collisions

ARM = "arm"
DT = 0.001
NEAR = 0.05
"""Width of the strip inside a joint limit where joints like to start, rad or m."""
CLEARANCE = 0.02
"""What joints keep between themselves and their limits, because the model is wrong, rad or m."""
OBSERVER_TIME = 0.002
"""How fast joint limits learn what the model does not explain, s."""
OUTSIDE = 0.15
"""How far outside its limits a joint may start, rad or m."""
SUBSTEPS = 20
"""Steps of the simulation in each tick: limits are to hold for an arm that moves between ticks."""
AMONG_OBSTACLES = 1.0 / 3.0
"""Part of the scenarios that have obstacles."""


@cache
def _arms() -> tuple[str, ...]:
    return tuple(r.name for r in available_robots() if r.kind == ARM and r.installed)


@cache
def _robot(name: str) -> Robot:
    return load_robot(name)


def random_scenario(rng: np.random.Generator) -> dict[str, Any]:
    """Draw a scenario.

    An arm starts anywhere, often near or outside its joint limits, with a stack of one to three
    tasks above a posture, targets within and out of reach, gains over more than a decade and up to
    five transitions that may overlap. Masses are off by up to 20 %, joints have friction, sensors
    noise, and the tool may be pushed. In a third of the scenarios there are obstacles; they are drawn
    last, so the others do not depend on them.

    Args:
        rng: Where every number comes from.

    Returns:
        The scenario in plain values.
    """
    name = str(rng.choice(_arms()))
    robot = _robot(name)
    duration = round(float(rng.uniform(0.6, 1.2)), 3)
    tasks = _tasks(rng, robot)
    scenario = {
        "description": "drawn at random",
        "robot": name,
        "backend": str(rng.choice(["pinocchio", "mujoco"])),
        "duration": duration,
        "dt": DT,
        "start": _start(rng, robot).tolist(),
        "torque_limits": "priority",
        "blending": str(rng.choice(["auto", "chain", "idv"])),
        "tasks": tasks,
        "events": _events(rng, tasks, duration),
        "joint_limits": {"clearance": CLEARANCE, "observer_time": OBSERVER_TIME},
        "plant": _plant(rng, robot, duration),
    }
    if rng.random() < AMONG_OBSTACLES:
        start = np.array(scenario["start"])
        scenario["collisions"] = random_collisions(rng, robot, start, _ranges(robot))
    return scenario


def _ranges(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)
    return lower, upper


def _start(rng: np.random.Generator, robot: Robot) -> np.ndarray:
    """A posture within the limits, with some joints near them and, now and then, one outside."""
    lower, upper = _ranges(robot)
    q = rng.uniform(lower, upper)
    for joint in np.flatnonzero(rng.random(robot.nv) < 0.25):
        away = rng.uniform(0.0, NEAR)
        q[joint] = rng.choice([lower[joint] + away, upper[joint] - away])
    if rng.random() < 0.15:
        joint = int(rng.integers(robot.nv))
        away = rng.uniform(0.0, OUTSIDE)
        q[joint] = rng.choice([lower[joint] - away, upper[joint] + away])
    return q


def _tasks(rng: np.random.Generator, robot: Robot) -> dict[str, Any]:
    kinds = list(rng.permutation(["position", "orientation", "pose", "joint"]))
    chosen = [str(kind) for kind in kinds[: int(rng.integers(1, 4))]]
    found: dict[str, Any] = {}
    for kind in chosen:
        task = {"type": kind, "level": int(rng.integers(0, 3)), "kp": _gain(rng)}
        if rng.random() < 0.5:
            speed = round(float(rng.uniform(0.3, 2.0)), 3)
            task["max_speed"] = [speed, 2.0 * speed] if kind == "pose" else speed
        task.update(_aim(rng, robot, kind))
        found[kind] = task
    lower, upper = _ranges(robot)
    wide = 0.2 * (upper - lower)
    found["posture"] = {
        "type": "posture",
        "level": 3,
        "kp": _gain(rng),
        # Some of the posture's targets lie beyond the limits.
        "target": rng.uniform(lower - wide, upper + wide).tolist(),
        "max_speed": round(float(rng.uniform(0.5, 3.0)), 3),
    }
    return found


def _gain(rng: np.random.Generator) -> float:
    return round(float(np.exp(rng.uniform(np.log(20.0), np.log(400.0)))), 2)


def _aim(rng: np.random.Generator, robot: Robot, kind: str) -> dict[str, Any]:
    """A target that some posture reaches, stretched out of reach now and then."""
    lower, upper = _ranges(robot)
    q = rng.uniform(lower, upper)
    if kind == "joint":
        joint = int(rng.integers(robot.nv))
        beyond = rng.uniform(-0.3, 0.3)
        return {"joint": robot.joint_names[joint], "target": float(q[joint] + beyond)}
    robot.update(q, np.zeros(robot.nv))
    tool = robot.frame_id(robot.tool)
    point = (robot.position(tool) * (rng.uniform(1.2, 2.0) if rng.random() < 0.3 else 1.0)).tolist()
    turn = rng.normal(size=4)
    quaternion = (turn / np.linalg.norm(turn)).tolist()
    if kind == "position":
        return {"target": point}
    if kind == "orientation":
        return {"target": quaternion}
    return {"target": {"position": point, "orientation": quaternion}}


def _events(
    rng: np.random.Generator, tasks: dict[str, Any], duration: float
) -> list[dict[str, Any]]:
    """Changes of the stack that make sense one after the other, in time they may overlap."""
    times = np.sort(rng.uniform(0.05, 0.8 * duration, int(rng.integers(0, 6))))
    there = dict.fromkeys(tasks, True)
    events: list[dict[str, Any]] = []
    for at in times:
        name = str(rng.choice(list(tasks)))
        event: dict[str, Any] = {
            "at": round(float(at), 3),
            "duration": round(float(rng.choice([0.1, 0.2, 0.4, 0.8])), 3),
        }
        others = [other for other in tasks if there[other] and other != name]
        if not there[name]:
            event["insert"] = name
            there[name] = True
        elif others and rng.random() < 0.4:
            event["swap"] = [name, str(rng.choice(others))]
        elif rng.random() < 0.5:
            event["move"], event["level"] = name, float(rng.integers(-1, 4)) + 0.5
        else:
            event["remove"] = name
            there[name] = False
        events.append(event)
    return events


def _plant(rng: np.random.Generator, robot: Robot, duration: float) -> dict[str, Any]:
    plant: dict[str, Any] = {
        "substeps": SUBSTEPS,
        "mass_error": round(float(rng.uniform(0.0, 0.2)), 4),
    }
    if np.all(np.isfinite(robot.torque_limit)) and rng.random() < 0.5:
        plant["dry_friction"] = round(float(rng.uniform(0.0, 0.03)), 4)
    if rng.random() < 0.5:
        plant["position_noise"] = float(10.0 ** rng.uniform(-6.0, -4.0))
        plant["velocity_noise"] = float(10.0 ** rng.uniform(-4.0, -2.5))
    if rng.random() < 0.5:
        force = rng.normal(size=3)
        size = rng.uniform(0.0, 0.1) * float(np.median(robot.torque_limit))
        plant["pushes"] = [
            {
                "at": round(float(rng.uniform(0.0, 0.7 * duration)), 3),
                "duration": round(float(rng.uniform(0.02, 0.2)), 3),
                "force": (size * force / np.linalg.norm(force)).tolist()
                if np.isfinite(size)
                else [0.0, 0.0, 0.0],
            }
        ]
    return plant
