"""Controllers that change tasks in other ways; tasks, gains, bias and references are the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command
from opspace.compare.blendings import CrossFade, Present
from opspace.compare.laws import (
    REGULARISATION,
    SOFTNESS,
    Inverse,
    continuous_inverse,
    damped_inverse,
    presences,
    stack_of_tasks,
    weighted_least_squares,
)
from opspace.controller import ReferenceController
from opspace.law import LawInfo, TaskSet, Weighted, task_torque
from opspace.stack import Member, Mixture
from opspace.tasks import TaskTerms

MAX_RATE = 1000.0
"""Torque rate that the clamp lets through, N·m/s: 1 N·m per millisecond."""


class CrossFadeController(ReferenceController):
    """Linear cross-fade between the hard torques before and after each change."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._blending = CrossFade()


class GainRampController(ReferenceController):
    """A task takes its directions at once; only the acceleration that it asks for fades."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._blending = Present()

    def _task_sets(
        self,
        members: Sequence[Member],
        activations: Sequence[float],
        terms: Sequence[TaskTerms],
        mixed: Mixture,
    ) -> tuple[list[TaskSet], Sequence[Weighted]]:
        faded = [
            replace(term, acceleration=h * term.acceleration)
            for h, term in zip(activations, terms, strict=True)
        ]
        return super()._task_sets(members, activations, faded, mixed)


class SoftWeightsController(ReferenceController):
    """Weights in one least-squares problem instead of priorities; weights fade.

    A level weighs 100^(−number), so that one in between does not move the others.
    """

    _numbers: tuple[float, ...] = ()

    def _task_sets(
        self,
        members: Sequence[Member],
        activations: Sequence[float],
        terms: Sequence[TaskTerms],
        mixed: Mixture,
    ) -> tuple[list[TaskSet], Sequence[Weighted]]:
        self._numbers = mixed.levels
        return super()._task_sets(members, activations, terms, mixed)

    def _weight(self, rank: int) -> float:
        """Weight of a level by its rank: joint limits have −1, the damping of the rest the last."""
        if rank >= len(self._numbers):
            return REGULARISATION
        number = -2.0 if rank < 0 else self._numbers[rank]
        return SOFTNESS**-number

    def _blend(
        self, L: np.ndarray, sets: Sequence[TaskSet], blend: Sequence[Weighted]
    ) -> tuple[np.ndarray, LawInfo]:
        presence = presences(blend, len(sets))
        weights = [h * self._weight(t.priority) for h, t in zip(presence, sets, strict=True)]
        return weighted_least_squares(L, sets, weights), LawInfo(1, 1, ())


class _StackOfTasksController(ReferenceController):
    """Levels one after the other, each with a generalised inverse of its own."""

    _inverse: Inverse

    def _blend(
        self, L: np.ndarray, sets: Sequence[TaskSet], blend: Sequence[Weighted]
    ) -> tuple[np.ndarray, LawInfo]:
        tau = stack_of_tasks(L, sets, presences(blend, len(sets)), self._inverse)
        return tau, LawInfo(1, len({task.priority for task in sets}), ())


class ContinuousInverseController(_StackOfTasksController):
    """Mansard's continuous inverse at every level."""

    _inverse = staticmethod(continuous_inverse)


class DampedController(_StackOfTasksController):
    """Damped least squares at every level, for tasks that switch."""

    _inverse = staticmethod(damped_inverse)


class AsPrintedController(ReferenceController):
    """Eq. 15-23 to the letter, without the term that subtracts what higher levels do."""

    def _blend(
        self, L: np.ndarray, sets: Sequence[TaskSet], blend: Sequence[Weighted]
    ) -> tuple[np.ndarray, LawInfo]:
        presence = presences(blend, len(sets))
        active = [task.replace(activation=h) for task, h in zip(sets, presence, strict=True)]
        return task_torque(L @ L.T, active, coupling="as-printed", info=True)


class RateClampController(ReferenceController):
    """Whatever the controller commands, the torque changes by at most 1 N·m per millisecond."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._sent: tuple[float, np.ndarray] | None = None

    def step(self, t: float, q: ArrayLike, v: ArrayLike) -> Command:
        """See `opspace.Controller.step`."""
        command = super().step(t, q, v)
        tau = command.tau
        if self._sent is not None:
            before, sent = self._sent
            most = MAX_RATE * (command.t - before)
            tau = sent + np.clip(tau - sent, -most, most)
        self._sent = command.t, tau
        return command._replace(tau=tau)
