"""What joints and motors can do of what the law wants: the projection behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from opspace.command import NO_CONTACTS, ContactStatus, Status
from opspace.controller.collisions import DistanceTerms
from opspace.controller.limit_task_sets import LimitTerms
from opspace.law import (
    BROKEN,
    LOST,
    Stacks,
    excess,
    excess_of_rows,
    leave_room,
    nearest_acceleration,
    task_metric,
    wants_more,
)
from opspace.robots.protocol import Robot


@dataclass(frozen=True)
class Bounds:
    """What every joint may do and what its motor can give in one tick.

    Attributes:
        terms: Joint limits that are bounds.
        M: (n, n) inertia.
        bias: (n,) Coriolis, centrifugal and gravity torque, N·m.
        room: (n,) what the motors give, N·m; inf where they are not asked.
        distances: Distances that may shrink only so fast; None for none.
        lower: (n,) least accelerations, rad/s².
        upper: (n,) largest accelerations, rad/s².
    """

    terms: Sequence[LimitTerms]
    M: np.ndarray
    bias: np.ndarray
    room: np.ndarray
    distances: DistanceTerms | None = None
    lower: np.ndarray = field(init=False)
    upper: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        lower, upper = self._by_joint([term.command for term in self.terms])
        haste = np.zeros((2, self.bias.size))
        for term in self.terms:
            haste[int(term.side.sign > 0.0), term.side.index] = term.haste
        # Who must stop at once may do so, whatever the speed limit behind it would say.
        upper += np.minimum(haste[0], np.maximum(lower - upper, 0.0))
        lower -= np.minimum(haste[1], np.maximum(lower - upper, 0.0))
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def more(self, change: np.ndarray) -> np.ndarray:
        """Return what joints do more towards their limits, (limits,) rad/s².

        Args:
            change: (n,) by how much their accelerations go on to change, rad/s².
        """
        towards = [term.side.sign * change[term.side.index] for term in self.terms]
        return np.maximum(towards, 0.0)

    def after(self, more: np.ndarray) -> Bounds:
        """Return what may be asked for where joints go on to do more, (limits,) rad/s².

        What a joint does more towards one limit it does less towards the other, which gives way.
        """
        terms = [
            term._replace(
                command=term.command - taken,
                haste=term.haste + taken,
                last=term.last - taken,
                by_position=term.by_position - taken,
            )
            for term, taken in zip(self.terms, more, strict=True)
        ]
        return replace(self, terms=terms)

    def by_position(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds as far as positions ask for them, least and largest, (n,) rad/s²."""
        return self._by_joint([term.by_position for term in self.terms])

    def _by_joint(self, towards: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = np.full(self.bias.size, -np.inf), np.full(self.bias.size, np.inf)
        for term, most in zip(self.terms, towards, strict=True):
            if term.side.sign > 0.0:
                upper[term.side.index] = most
            else:
                lower[term.side.index] = -most
        return lower, upper

    def passed(self, acceleration: np.ndarray) -> bool:
        """Tell whether a joint does more towards a limit than that one allows."""
        return any(
            t.side.sign * acceleration[t.side.index] - t.command > LOST * max(1.0, abs(t.command))
            for t in self.terms
        )

    def lost(self, acceleration: np.ndarray) -> bool:
        """Tell whether a joint does more than it may, or will pass its limit."""
        if excess(acceleration, self.lower, self.upper) > LOST:
            return True
        return any(t.side.sign * acceleration[t.side.index] > t.last for t in self.terms)

    def broken(self, tau: np.ndarray, acceleration: np.ndarray) -> bool:
        """Tell whether a torque or its acceleration is outside."""
        above = np.any(np.abs(tau) > self.room * (1.0 + BROKEN))
        joints = excess(acceleration, self.lower, self.upper) > BROKEN
        return bool(above) or joints or self.approach(acceleration) > BROKEN

    def approach(self, acceleration: np.ndarray) -> float:
        """Tell by how much distances shrink faster than they may, as `opspace.law.excess` does."""
        if self.distances is None:
            return -np.inf
        return excess_of_rows(acceleration, self.distances.G, self.distances.most)

    def will_close(self, acceleration: np.ndarray) -> bool:
        """Tell whether a distance will soon shrink faster than it may."""
        if self.distances is None:
            return False
        return excess_of_rows(acceleration, self.distances.G, self.distances.last) > LOST


NOTHING = np.zeros(0)


class Kept(NamedTuple):
    """A torque that keeps what it can.

    Attributes:
        tau: (n,) N·m.
        status: What happened.
        limits: By name how much each joint limit acts: the acceleration that it takes from its joint,
            as a part of its margin, at most 1.
        taken: What each distance takes from how fast it shrinks, (rows,) m/s².
        contacts: What each contact carries.
        hindrance: What contacts could not carry, as a multiple of what a contact that leaves may cost.
    """

    tau: np.ndarray
    status: Status = Status.OK
    limits: Mapping[str, float] = MappingProxyType({})
    taken: np.ndarray = NOTHING
    contacts: Mapping[str, ContactStatus] = NO_CONTACTS
    hindrance: float = 0.0


def realise(bounds: Bounds, tau: np.ndarray, stacks: Callable[[], Stacks]) -> Kept:
    """Replace a torque by the nearest one with which no joint, motor or distance does more than it may.

    Before that levels leave those above what is left of a limit, see `opspace.law.leave_room`; not of
    a speed, at which nothing rests.

    Args:
        bounds: What they may.
        tau: (n,) torque, N·m.
        stacks: Gives what is mixed, by which "near" is measured; asked only where a limit is near.

    Returns:
        The torque and what happened.
    """
    M, bias, near = bounds.M, bounds.bias, bounds.distances
    acceleration = np.linalg.solve(M, tau - bias)
    taken = np.zeros(0 if near is None else near.most.size)
    upper = lower = np.zeros(bias.size)
    by_position = bounds.by_position()
    gave_way, motors = wants_more(acceleration, *by_position), False
    if gave_way:
        L = np.linalg.cholesky(M)
        acceleration, upper, lower = leave_room(L, stacks(), acceleration, *by_position)
        tau = M @ acceleration + bias
    if bounds.broken(tau, acceleration):
        found = nearest_acceleration(
            np.linalg.cholesky(M),
            metric_of(stacks(), bias.size),
            acceleration,
            bounds.lower,
            bounds.upper,
            -bounds.room - bias,
            bounds.room - bias,
            None if near is None else near.G,
            None if near is None else near.most,
            None if near is None else near.softness(M),
        )
        acceleration, motors, taken = found.acceleration, found.motors, found.rows
        upper, lower = upper + found.upper, lower + found.lower
        tau = np.clip(M @ acceleration + bias, -bounds.room, bounds.room)
    elif not gave_way:
        lost = Status.LIMIT_LOST if bounds.lost(acceleration) else Status.OK
        return Kept(tau, lost, taken=taken)
    status = Status.FILTERED
    if motors:
        status |= Status.TORQUE_SCALED
    if bounds.lost(acceleration):
        status |= Status.LIMIT_LOST
    if np.any(taken > 0.0):
        status |= Status.COLLISION
    if bounds.will_close(acceleration):
        status |= Status.COLLISION_LOST
    return Kept(tau, status, acting(bounds.terms, upper, lower), taken)


def metric_of(stacks: Stacks, n: int) -> np.ndarray:
    """Return W of `opspace.law.task_metric` for what is mixed, (n, n)."""
    return task_metric(stacks.whitened, stacks.levels, stacks.shares(), n)


def change_within_tick(
    robot: Robot, tau: np.ndarray, acceleration: np.ndarray, period: float
) -> np.ndarray:
    """Tell by how much accelerations differ in the middle of a tick, while the torque stays.

    Args:
        robot: The robot at the beginning; it is there again in the end.
        tau: (n,) torque without what the world answers, N·m.
        acceleration: (n,) q̈ at the beginning, rad/s².
        period: Δt, s.

    Returns:
        (n,) A⁻¹ (Γ − b − g) at q + q̇ Δt/2 + q̈ Δt²/8, q̇ + q̈ Δt/2, less q̈, rad/s².
    """
    q, v, half = np.array(robot.q), np.array(robot.v), 0.5 * period
    robot.update(q + half * (v + 0.5 * half * acceleration), v + half * acceleration)
    later = np.linalg.solve(robot.M, tau - robot.bias)
    robot.update(q, v)
    return later - acceleration


def acting(terms: Sequence[LimitTerms], upper: np.ndarray, lower: np.ndarray) -> dict[str, float]:
    """Tell by name how much each limit acts.

    Args:
        terms: Joint limits that are bounds.
        upper: (n,) by how much each upper bound lowers its joint's acceleration, rad/s².
        lower: (n,) the same of each lower bound.

    Returns:
        The acceleration that a limit takes from its joint, as a part of its margin, at most 1.
    """
    taken = [(upper if term.side.sign > 0.0 else lower)[term.side.index] for term in terms]
    return {
        term.side.name: min(float(part) / term.margin, 1.0)
        for term, part in zip(terms, taken, strict=True)
        if part > 0.0
    }
