"""The slowest ticks of a scene: states of the whole workspace, and what a search makes of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np

from opspace.bench.scenes import SCENES, Scene
from opspace.bench.timing import pinned
from opspace.command import Command, Status
from opspace.errors import InputError, unknown_name
from opspace.robots.protocol import BASE, Robot

HEADS = ("scene", "states", "p50 [µs]", "p99 [µs]", "max [µs]", "of usual", "statuses there")
KEPT = 16
"""States that the search climbs from, and that are timed in the end."""
REPEATED = 5
"""Ticks at one state, the quickest of which counts: what else the machine does is no state's fault."""
NEAR = 0.02
"""How near its limits a joint is put, part of its range."""
STEP = 0.1
"""Size of the first steps of the search, part of each range, which is halved where it finds nothing."""

State = tuple[np.ndarray, np.ndarray]


class Sampler:
    """Draws states of a robot, and steps from one to another.

    A joint without limits turns by a half to both sides; one without a speed limit moves at 1 rad/s.

    Args:
        robot: The robot.
        seed: Seed of what is drawn.
    """

    def __init__(self, robot: Robot, seed: int) -> None:
        self._chance = np.random.default_rng(seed)
        self._robot = robot
        first = BASE if robot.floating_base else 0
        self._lower, self._upper = (
            np.where(np.isfinite(limit), limit, half)[first:]
            for limit, half in ((robot.q_lower, -np.pi), (robot.q_upper, np.pi))
        )
        self._speed = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
        self._speed[:first] = 0.2

    def draw(self) -> State:
        """Draw a state: joints anywhere, or some of them at their limits, and any speed."""
        size = self._lower.size
        part = self._chance.uniform(size=size)
        at_limit = self._chance.uniform(size=size) < self._chance.choice([0.0, 0.5])
        near = NEAR * self._chance.uniform(size=size)
        part = np.where(at_limit, np.where(part < 0.5, near, 1.0 - near), part)
        speed = self._chance.uniform(-1.0, 1.0, self._speed.size) * self._chance.choice([0.1, 1.0])
        return self._state(part, speed)

    def near(self, state: State, step: float) -> State:
        """Step from a state, by a part of each range."""
        q, v = state
        part = (q[q.size - self._lower.size :] - self._lower) / (self._upper - self._lower)
        speed = v / self._speed
        part = part + step * self._chance.normal(size=part.size)
        return self._state(part, speed + step * self._chance.normal(size=speed.size))

    def _state(self, part: np.ndarray, speed: np.ndarray) -> State:
        q = self._robot.q_reference.copy()
        joints = self._lower + (self._upper - self._lower) * part
        q[q.size - part.size :] = joints.clip(self._lower, self._upper)
        return q, self._speed * speed.clip(-1.0, 1.0)


class Slowest(NamedTuple):
    """Ticks of a scene, µs, each the quickest of several at one state.

    Attributes:
        usual: At the states that the scene is timed at.
        drawn: At states of the whole workspace.
        found: At the slowest states that the search has found.
        statuses: What happened there.
    """

    usual: np.ndarray
    drawn: np.ndarray
    found: np.ndarray
    statuses: Status


def slowest(scene: Scene, count: int, seed: int = 0) -> Slowest:
    """Search for the slowest ticks of a scene.

    Half of the states are drawn; the slowest of these are climbed from, step by step.

    Args:
        scene: The scene.
        count: How many states to try.
        seed: Seed of what is drawn.
    """
    controller = scene.controller()
    t, wrenches = scene.time, scene.wrenches

    def tick(q: np.ndarray, v: np.ndarray) -> Command:
        return controller.step(t, q, v, wrenches=wrenches)

    usual = list(zip(*scene.states(controller.robot), strict=True))
    for state in usual:
        tick(*state)
    sampler = Sampler(controller.robot, seed)
    drawn = [sampler.draw() for _ in range(max(count // 2, KEPT))]
    times = np.array([_quickest(tick, state) for state in drawn])
    worst = [drawn[i] for i in np.argsort(times)[-KEPT:]]
    climbed = [_climbed(tick, sampler, state, count // (2 * KEPT)) for state in worst]
    statuses = Status.OK
    for state in climbed:
        statuses |= tick(*state).status
    again, found = (
        np.array([_quickest(tick, state) for state in there]) for there in (usual, climbed)
    )
    return Slowest(again, times, found, statuses)


def _quickest(tick: Callable[[np.ndarray, np.ndarray], object], state: State) -> float:
    """Time a state, µs."""
    found = []
    for _ in range(REPEATED):
        start = perf_counter_ns()
        tick(*state)
        found.append(perf_counter_ns() - start)
    return min(found) * 1e-3


def _climbed(
    tick: Callable[[np.ndarray, np.ndarray], object], sampler: Sampler, state: State, steps: int
) -> State:
    """Step from a state to slower ones."""
    time, step, failed = _quickest(tick, state), STEP, 0
    for _ in range(steps):
        other = sampler.near(state, step)
        # Whoever seems slower is looked at once more: one disturbance must not hold the search up.
        found = min(_quickest(tick, other), _quickest(tick, other))
        if found > time:
            state, time, failed = other, found, 0
            continue
        failed += 1
        if failed % 8 == 0:
            step = max(0.5 * step, 1e-3)
    return state


def worst_table(
    names: Sequence[str], count: int, core: int | None = None
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Search every scene as it is, and with all tasks but the last on their way in or out.

    Args:
        names: Scenes; none is all of them whose robot is installed.
        count: States to try in each.
        core: Core to stay on; None leaves it to the system.

    Returns:
        Heads and rows for a person.

    Raises:
        InputError: There is no such core, or fewer states than are kept.
        UnknownNameError: There is no such scene.
    """
    if count < 2 * KEPT:
        raise InputError(f"a search for the worst case needs {2 * KEPT} states, got {count}")
    for name in names:
        if name not in SCENES:
            raise unknown_name("scene", name, SCENES)
    rows: list[tuple[str, ...]] = []
    with pinned(core):
        for name in names or SCENES:
            for title, scene in _with_all_moving(name):
                rows += _rows(title, slowest(scene, count))
    return HEADS, rows


def _with_all_moving(name: str) -> list[tuple[str, Scene]]:
    """Return a scene, and the same with everything on its way, where that is another one."""
    scene = SCENES[name]
    moving = sum(map(len, scene.levels())) - 1
    if moving <= scene.transitions:
        return [(name, scene)]
    return [(name, scene), (f"{name}, {moving} moving", replace(scene, transitions=moving))]


def _rows(title: str, found: Slowest) -> list[tuple[str, ...]]:
    usual = float(np.median(found.usual))
    parts = ("usual", found.usual), ("drawn", found.drawn), ("slowest", found.found)
    rows: list[tuple[str, ...]] = []
    for what, times in parts:
        p50, p99 = np.percentile(times, (50, 99)).tolist()
        told = str(found.statuses) if what == "slowest" else "-"
        numbers = (f"{x:.3g}" for x in (p50, p99, times.max()))
        rows.append((title, what, *numbers, f"{p50 / usual:.2f}", told))
    return rows
