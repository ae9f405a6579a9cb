"""What joints and motors can do of what the law wants: the projection behind it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from opspace.command import Status
from opspace.controller.limit_task_sets import LimitTerms
from opspace.law import BROKEN, LOST, Nearest, excess, nearest_acceleration


@dataclass(frozen=True)
class Bounds:
    """What every joint may do and what its motor can give in one tick.

    Attributes:
        terms: Joint limits that are bounds.
        M: (n, n) inertia.
        bias: (n,) Coriolis, centrifugal and gravity torque, N·m.
        room: (n,) what the motors give, N·m; inf where they are not asked.
        lower: (n,) least accelerations, rad/s².
        upper: (n,) largest accelerations, rad/s².
    """

    terms: Sequence[LimitTerms]
    M: np.ndarray
    bias: np.ndarray
    room: np.ndarray
    lower: np.ndarray = field(init=False)
    upper: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        lower, upper = np.full(self.bias.size, -np.inf), np.full(self.bias.size, np.inf)
        for term in self.terms:
            if term.side.sign > 0.0:
                upper[term.side.index] = term.command
            else:
                lower[term.side.index] = -term.command
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def broken(self, tau: np.ndarray, acceleration: np.ndarray) -> bool:
        """Tell whether a torque or its acceleration is outside."""
        above = np.any(np.abs(tau) > self.room * (1.0 + BROKEN))
        return bool(above) or excess(acceleration, self.lower, self.upper) > BROKEN


def realise(
    bounds: Bounds, tau: np.ndarray, metric: Callable[[], np.ndarray]
) -> tuple[np.ndarray, Status, dict[str, float]]:
    """Replace a torque by the nearest one with which no joint and no motor does more than it may.

    Args:
        bounds: What they may.
        tau: (n,) torque, N·m.
        metric: Gives W, in which "near" is measured; asked only where something is outside.

    Returns:
        The torque, what happened, and by name how much each limit acts: the acceleration that it
        takes from its joint, as a part of its margin, at most 1.
    """
    M, bias = bounds.M, bounds.bias
    acceleration = np.linalg.solve(M, tau - bias)
    if not bounds.broken(tau, acceleration):
        return tau, Status.OK, {}
    found = nearest_acceleration(
        np.linalg.cholesky(M),
        metric(),
        acceleration,
        bounds.lower,
        bounds.upper,
        -bounds.room - bias,
        bounds.room - bias,
    )
    tau = np.clip(M @ found.acceleration + bias, -bounds.room, bounds.room)
    status = Status.FILTERED
    if found.motors:
        status |= Status.TORQUE_SCALED
    if excess(found.acceleration, bounds.lower, bounds.upper) > LOST:
        status |= Status.LIMIT_LOST
    return tau, status, _acting(bounds.terms, found)


def _acting(terms: Sequence[LimitTerms], found: Nearest) -> dict[str, float]:
    taken = [
        (found.upper if term.side.sign > 0.0 else found.lower)[term.side.index] for term in terms
    ]
    return {
        term.side.name: min(float(part) / term.margin, 1.0)
        for term, part in zip(terms, taken, strict=True)
        if part > 0.0
    }
