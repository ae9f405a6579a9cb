"""The one loop: read the plant, compute the command, tell the observers, advance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from opspace.command import Command
from opspace.controller.wrenches import Wrenches
from opspace.errors import InputError
from opspace.loop.any_plant import AnyPlant
from opspace.robots.joint_units import effort_unit, joint_units
from opspace.robots.protocol import Robot


class Observer(Protocol):
    """Something that watches a run without changing it: a recorder, a progress bar, a viewer."""

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """See one tick: the measured state, and the command computed for it."""
        ...


class Stepping(Protocol):
    """What the loop needs of a controller."""

    @property
    def robot(self) -> Robot:
        """The robot that it computes with."""
        ...

    def step(self, t: float, q: np.ndarray, v: np.ndarray) -> Command:
        """See `opspace.Controller.step`."""
        ...


@dataclass(frozen=True)
class StopRule:
    """When a run is given up, as a person at the emergency stop would.

    Attributes:
        max_joint_speed: rad/s or m/s; None for no limit.
        max_torque: Commanded torque of a joint, N·m or N; None for no limit.
    """

    max_joint_speed: float | None = None
    max_torque: float | None = None

    def reason(self, robot: Robot, v: np.ndarray, tau: np.ndarray) -> str:
        """Say why to stop, or the empty string."""
        if not (np.all(np.isfinite(v)) and np.all(np.isfinite(tau))):
            return "the simulation diverged"
        if self.max_joint_speed is not None and np.max(np.abs(v)) > self.max_joint_speed:
            worst = int(np.argmax(np.abs(v)))
            unit = joint_units(robot)[worst]
            return f"joint {robot.joint_names[worst]!r} moved at {abs(v[worst]):.1f} {unit}/s"
        if self.max_torque is not None and np.max(np.abs(tau)) > self.max_torque:
            worst = int(np.argmax(np.abs(tau)))
            unit = effort_unit(joint_units(robot)[worst])
            return f"joint {robot.joint_names[worst]!r} was asked for {abs(tau[worst]):.0f} {unit}"
        return ""


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes:
        completed: Whether it ran to its end.
        t: Time of the last tick, s.
        reason: Why it was stopped; empty when it was not.
    """

    completed: bool
    t: float
    reason: str


def check_gravity(plant: object, controller: object) -> None:
    """Check that exactly one of the two adds the torque against gravity, as far as both say.

    Args:
        plant: The robot.
        controller: What commands it.

    Raises:
        InputError: Both add it, or none.
    """
    adds, left_to = getattr(plant, "adds_gravity", None), getattr(controller, "gravity", None)
    if adds is None or left_to is None or adds == (left_to == "robot"):
        return
    whose, wanted = ("adds", "robot") if adds else ("does not add", "controller")
    raise InputError(
        f"the {type(plant).__name__} {whose} the torque against gravity itself; the controller must "
        f"be built with gravity={wanted!r}, not {left_to!r}"
    )


def _measured(plant: AnyPlant) -> Wrenches | None:
    """Read the wrenches of a plant that measures some."""
    read = getattr(plant, "wrenches", None)
    return None if read is None else read()


def answered(
    controller: Stepping, t: float, q: np.ndarray, v: np.ndarray, wrenches: Wrenches | None
) -> Command:
    """Step a controller, with what the robot feels where both have to do with wrenches."""
    if not wrenches or not hasattr(controller, "wrenches"):
        return controller.step(t, q, v)
    return controller.step(t, q, v, wrenches=wrenches)  # pyright: ignore[reportCallIssue]


def simulate(
    plant: AnyPlant,
    controller: Stepping,
    duration: float,
    observers: Sequence[Observer] = (),
    stop: StopRule = StopRule(),
) -> Outcome:
    """Run a controller on a plant; the same inputs give the same run, bit for bit.

    A second call goes on where the first one ended.

    Args:
        plant: The robot, for example `opspace.sim.Plant`.
        controller: The controller.
        duration: Simulated time, s.
        observers: Told about every tick before the plant advances.
        stop: When to give up.

    Returns:
        How the run ended.

    Raises:
        InputError: The duration is not a time, or gravity would be added twice or by nobody.
    """
    if not (math.isfinite(duration) and duration >= 0.0):
        raise InputError(f"the duration must be finite and >= 0 s, got {duration}")
    check_gravity(plant, controller)
    start = plant.t
    t = start
    for tick in range(round(duration / plant.dt)):
        t = start + tick * plant.dt
        if not (np.all(np.isfinite(plant.q)) and np.all(np.isfinite(plant.v))):
            return Outcome(False, t, "the simulation diverged")
        q, v = plant.measure()
        command = answered(controller, t, q, v, _measured(plant))
        for observer in observers:
            observer.observe(q, v, command)
        reason = stop.reason(controller.robot, plant.v, command.tau)
        if reason:
            return Outcome(False, t, reason)
        plant.advance(command.tau)
    return Outcome(True, t, "")
