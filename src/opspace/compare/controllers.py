"""Controllers that change tasks in other ways; tasks, gains, bias and references are the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command
from opspace.compare.laws import (
    REGULARISATION,
    SOFTNESS,
    Inverse,
    presences,
    stack_of_tasks,
    weighted_least_squares,
)
from opspace.controller import ReferenceController
from opspace.controller.stages import Law, Question
from opspace.controller.wrenches import Wrenches
from opspace.law import LawInfo, task_torque
from opspace.robots.protocol import Robot
from opspace.stack import Blending, Stack

MAX_RATE = 1000.0
"""Torque rate that the clamp lets through, N·m/s: 1 N·m per millisecond."""


def blended_by(make: Callable[[], Blending]) -> Callable[..., ReferenceController]:
    """Make controllers with another blending than the one that the scenario names."""

    def controller(robot: Robot, stack: Stack, **options: Any) -> ReferenceController:
        return ReferenceController(robot, stack, **{**options, "blending": make()})

    return controller


def soft_weights(asked: Question) -> tuple[np.ndarray, LawInfo]:
    """Weights in one least-squares problem instead of priorities; weights fade.

    A level weighs 100^(−number), so that one in between does not move the others.
    """
    sets = asked.task_sets
    weights = [
        h * _weight(asked.levels, task.priority)
        for h, task in zip(presences(asked.corners, len(sets)), sets, strict=True)
    ]
    return weighted_least_squares(asked.L, sets, weights), LawInfo(1, 1, ())


def _weight(levels: Sequence[float], rank: int) -> float:
    """Weight of a level by its rank: joint limits have −1, the damping of the rest the last."""
    if rank >= len(levels):
        return REGULARISATION
    number = -2.0 if rank < 0 else levels[rank]
    return SOFTNESS**-number


def level_by_level(inverse: Inverse) -> Law:
    """Levels one after the other, each with a generalised inverse of its own."""

    def law(asked: Question) -> tuple[np.ndarray, LawInfo]:
        sets = asked.task_sets
        tau = stack_of_tasks(asked.L, sets, presences(asked.corners, len(sets)), inverse)
        return tau, LawInfo(1, len({task.priority for task in sets}), ())

    return law


def as_printed(asked: Question) -> tuple[np.ndarray, LawInfo]:
    """Eq. 15-23 to the letter, without the term that subtracts what higher levels do."""
    presence = presences(asked.corners, len(asked.task_sets))
    active = [t.replace(activation=h) for t, h in zip(asked.task_sets, presence, strict=True)]
    return task_torque(asked.L @ asked.L.T, active, coupling="as-printed", info=True)


class RateClampController(ReferenceController):
    """Whatever the controller commands, the torque changes by at most 1 N·m per millisecond."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._sent: tuple[float, np.ndarray] | None = None

    def step(
        self, t: float, q: ArrayLike, v: ArrayLike, *, wrenches: Wrenches | None = None
    ) -> Command:
        """See `opspace.Controller.step`."""
        command = super().step(t, q, v, wrenches=wrenches)
        tau = command.tau
        if self._sent is not None:
            before, sent = self._sent
            most = MAX_RATE * (command.t - before)
            tau = sent + np.clip(tau - sent, -most, most)
        self._sent = command.t, tau
        return command._replace(tau=tau)
