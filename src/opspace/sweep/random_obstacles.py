"""Obstacles drawn at random, clear of the posture in which an arm starts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from opspace.controller.collisions import distance_terms
from opspace.robots import Robot
from opspace.robots.shapes import LinkCapsule
from opspace.scenario.obstacle_entries import ObstacleEntry
from opspace.tasks import CollisionAvoidance

MARGIN = 0.02
"""Distance that is kept, twice what is usual because the model is wrong, m."""
CLEAR = 0.01
"""How far outside the margin everything starts, m."""
REACT = 0.2
"""Time that one that moves is away beside that, with which the arm can still give way, s."""
MOVING = 1.0 / 3.0
"""Part of the obstacles that moves."""
SPEED = 0.3
"""How fast they move at most, m/s."""
TRIES = 500
"""Obstacles that are drawn until enough are clear of the start; then there are fewer."""


def random_obstacle(rng: np.random.Generator, place: np.ndarray) -> dict[str, Any]:
    """Draw a ball, a box or a capsule, turned anyhow.

    Args:
        rng: Where every number comes from.
        place: (3,) where its middle is, m.

    Returns:
        Its entry in a scenario.
    """
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    kind = rng.integers(3)
    at = {"position": place.tolist()}
    if kind == 0:
        return {"shape": "ball", "radius": float(rng.uniform(0.03, 0.12)), **at}
    at["orientation"] = turn.tolist()
    if kind == 1:
        return {"shape": "box", "size": rng.uniform(0.05, 0.3, 3).tolist(), **at}
    radius, length = rng.uniform((0.02, 0.1), (0.08, 0.4)).tolist()
    return {"shape": "capsule", "radius": radius, "length": length, **at}


def random_collisions(
    rng: np.random.Generator, robot: Robot, start: np.ndarray, span: tuple[np.ndarray, np.ndarray]
) -> dict[str, Any]:
    """Draw 2 to 6 obstacles where an arm may come, some of them moving.

    Each has its middle in a link of another posture, and is so far from all links that the arm can
    still keep the margin. Links that are too near each other already are not kept apart.

    Args:
        rng: Where every number comes from.
        robot: The arm; its state changes.
        start: (n,) the posture in which it starts, rad or m.
        span: (n,) and (n,) between which joints are, rad or m.

    Returns:
        ``collisions`` of a scenario.
    """
    own, still = _own(robot), np.zeros(robot.nv)
    robot.update(start, still)
    apart = _gaps(CollisionAvoidance(shapes=own.shapes, pairs=own.pairs), robot)
    wanted = int(rng.integers(2, 7))
    obstacles: dict[str, dict[str, Any]] = {}
    for _ in range(TRIES):
        if len(obstacles) == wanted:
            break
        entry = _in_the_way(rng, robot, own.shapes, span)
        robot.update(start, still)
        drawn = ObstacleEntry(**entry).build("drawn")
        gaps = _gaps(CollisionAvoidance(drawn, shapes=own.shapes, pairs="none"), robot)
        speed = float(np.linalg.norm(entry.get("velocity", 0.0)))
        if min(gaps.values()) > MARGIN + CLEAR + REACT * speed:
            obstacles[f"{entry['shape']}{len(obstacles) + 1}"] = entry
    pairs = [[one, two] for one, two in own.pairs if apart[f"{one}/{two}"] > MARGIN + CLEAR]
    return {"margin": MARGIN, "pairs": pairs, "obstacles": obstacles}


def _in_the_way(
    rng: np.random.Generator,
    robot: Robot,
    shapes: Sequence[LinkCapsule],
    span: tuple[np.ndarray, np.ndarray],
) -> dict[str, Any]:
    """Draw an obstacle in a link of any posture, which the robot is then in."""
    robot.update(rng.uniform(*span), np.zeros(robot.nv))
    link = shapes[int(rng.integers(len(shapes)))]
    frame = robot.frame_id(link.frame)
    inside = robot.rotation(frame) @ rng.choice([link.start, link.end])
    entry = random_obstacle(rng, robot.position(frame) + inside)
    if rng.random() < MOVING:
        way = rng.normal(size=3)
        speed = rng.uniform(0.1 * SPEED, SPEED)
        entry["velocity"] = (speed * way / np.linalg.norm(way)).tolist()
    return entry


@cache
def _own(robot: Robot) -> CollisionAvoidance:
    """Find shapes and pairs of an arm, once in a process."""
    guard = CollisionAvoidance(margin=MARGIN)
    guard.bind(robot)
    return guard


def _gaps(guard: CollisionAvoidance, robot: Robot) -> dict[str, float]:
    """Distances at the present state of the robot by pair, m."""
    guard.bind(robot)
    terms = distance_terms(guard, robot, 0.0, np.full(robot.nv, np.inf))
    told = terms.layout.status(terms.distance, np.zeros(terms.distance.size))
    return {pair: apart.distance for pair, apart in told.items()}
