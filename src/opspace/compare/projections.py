"""Other ways to keep bodies apart, joints in their ranges and motors in theirs, behind the same law."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, Status
from opspace.controller import Controller
from opspace.controller.collisions import closing
from opspace.controller.wrenches import Wrenches
from opspace.errors import InputError
from opspace.kernels.columns import KEEP_TORQUE
from opspace.law import nearest_acceleration
from opspace.law.convex import set_distance
from opspace.law.polyhedra import Meshes
from opspace.law.scalars import level_weight
from opspace.machine.field_table import Record
from opspace.plan.plan import Plan
from opspace.tasks import CollisionAvoidance

ALPHA = 10.0
"""Decay of the barriers, 1/s: a distance may shrink by this part of itself per second."""

SWITCHED = 0.05
"""Distance beyond the margin at which the hard switch takes a pair in, m."""

SWITCH_KP, SWITCH_KV = 400.0, 40.0
"""Stiffness, 1/s², and damping, 1/s, with which it then holds the pair there."""

RANK = 1e-6
"""Directions of the switched rows that are weaker than this part of the strongest are left out."""


class Wanted(NamedTuple):
    """What the law wants in one tick, and what is known of the robot.

    Attributes:
        U: (n, n) factor of the inertia, M = U Uᵀ.
        W: (n, n) metric of the tasks in x = Uᵀ q̈, see `opspace.law.task_metric`.
        balance: (n,) torque that is no task's, N·m.
        acceleration: (n,) that the law wants, rad/s².
        q: (n,) rad.
        v: (n,) rad/s.
        room: (n,) what the motors give, N·m; inf where they are not asked.
        G: (k, n) by how much joint accelerations let each distance shrink faster.
        most: (k,) bounds of G q̈ that the library keeps, m/s².
        D: (k,) distances beyond the margin, m.
        rate: (k,) how fast they grow, m/s.
        drift: (k,) their second derivative at q̈ = 0, m/s².
    """

    U: np.ndarray
    W: np.ndarray
    balance: np.ndarray
    acceleration: np.ndarray
    q: np.ndarray
    v: np.ndarray
    room: np.ndarray
    G: np.ndarray
    most: np.ndarray
    D: np.ndarray
    rate: np.ndarray
    drift: np.ndarray

    def nearest(
        self, W: np.ndarray, lower: np.ndarray, upper: np.ndarray, most: np.ndarray
    ) -> np.ndarray:
        """Project what is wanted on bounds of joints, motors and distances in a metric."""
        return nearest_acceleration(
            self.U,
            W,
            self.acceleration,
            lower,
            upper,
            -self.room - self.balance,
            self.room - self.balance,
            self.G,
            most,
        ).acceleration


class AnotherProjection(Controller):
    """The library's law, with another way to what can be done of it; for hinges and slides."""

    def step(
        self, t: float, q: ArrayLike, v: ArrayLike, *, wrenches: Wrenches | None = None
    ) -> Command:
        """See `opspace.Controller.step`.

        Raises:
            InputError: See there; or the robot or the stack has no compiled tick.
        """
        if self.robot.floating_base:
            raise InputError(
                f"{type(self).__name__} knows no contacts and cannot drive a robot that floats"
            )
        command = super().step(t, q, v, wrenches=wrenches)
        if self._plan is None:
            raise InputError(
                f"{type(self).__name__} needs a robot and a stack with a compiled tick"
            )
        if Status.FAULT in command.status:
            return command
        wish = self._wish(self._plan, command)
        tau = wish.U @ (wish.U.T @ self.realised(wish)) + wish.balance
        middle = np.array(self._plan.tick.torque_middle)
        return command._replace(tau=np.clip(tau, -wish.room, wish.room) + middle)

    def realised(self, wish: Wanted) -> np.ndarray:
        """Choose an acceleration, (n,) rad/s²."""
        return wish.acceleration

    def _wish(self, plan: Plan, command: Command) -> Wanted:
        tick, limits = plan.tick, self.stack.limits
        U, balance = np.array(tick.inertia.L)[:, : tick.v.size].T, np.array(tick.balance)
        keeps = bool(tick.option[KEEP_TORQUE] != 0.0)
        # A tick that has nothing to keep does not say what it wanted: it did it.
        kept = keeps or len(tick.distance) > 0 or (limits is not None and limits.law.bound)
        wanted = np.array(tick.wanted_tau) if kept else command.tau - np.array(tick.torque_middle)
        n = balance.size
        return Wanted(
            U,
            _metric(plan, command, n),
            balance,
            np.linalg.solve(U @ U.T, wanted - balance),
            np.array(tick.q),
            np.array(tick.v),
            np.array(tick.torque_limit) if keeps else np.full(n, np.inf),
            np.array(tick.distances.G).reshape(-1, n),
            np.array(tick.distances.most),
            *_distances(tick, self.collisions),
        )


class Unkept(AnotherProjection):
    """Nothing is kept apart; motors and joints are, as ever."""

    def realised(self, wish: Wanted) -> np.ndarray:
        """See `AnotherProjection.realised`."""
        joints = self._bounds()
        return wish.nearest(wish.W, *joints, np.full(wish.most.size, np.inf))

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        assert self._plan is not None
        bounds = self._plan.tick.bounds
        return np.array(bounds.lower), np.array(bounds.upper)


class NearestInInertia(Unkept):
    """The same bounds, the nearest acceleration in the inertia instead of what the tasks see."""

    def realised(self, wish: Wanted) -> np.ndarray:
        """See `AnotherProjection.realised`."""
        return wish.nearest(np.eye(wish.v.size), *self._bounds(), wish.most)


class SwitchedDistances(Unkept):
    """Pairs nearer than 5 cm become a task of their own at the top, from one tick to the next."""

    def realised(self, wish: Wanted) -> np.ndarray:
        """See `AnotherProjection.realised`."""
        near = wish.D < SWITCHED
        free = super().realised(wish)
        if not np.any(near):
            return free
        G = wish.G[near]
        away = SWITCH_KP * (SWITCHED - wish.D[near]) - SWITCH_KV * wish.rate[near]
        wanted = wish.drift[near] - away
        white = np.linalg.solve(wish.U, G.T).T
        change = np.linalg.pinv(white, rcond=RANK) @ (wanted - G @ free)
        return free + np.linalg.solve(wish.U.T, change)


class BarrierProgram(AnotherProjection):
    """A quadratic program with barriers of second order for distances, joints and speeds.

    ḧ ≥ −2α ḣ − α² h for distances and joint ranges, ḣ ≥ −α h for speeds; the cost is that of the
    library's projection.
    """

    def realised(self, wish: Wanted) -> np.ndarray:
        """See `AnotherProjection.realised`."""
        lower, upper = np.full(wish.v.size, -np.inf), np.full(wish.v.size, np.inf)
        limits = self.stack.limits
        for side in limits.sides if limits is not None else ():
            towards, h = (
                side.sign * wish.v[side.index],
                side.sign * (side.limit - wish.q[side.index]),
            )
            most = ALPHA * ALPHA * h - 2.0 * ALPHA * towards
            most = min(most, ALPHA * (side.speed - towards))
            if side.sign > 0.0:
                upper[side.index] = most
            else:
                lower[side.index] = -most
        barrier = wish.drift + 2.0 * ALPHA * wish.rate + ALPHA * ALPHA * wish.D
        return wish.nearest(wish.W, lower, upper, barrier)


def _metric(plan: Plan, command: Command, n: int) -> np.ndarray:
    """W of `opspace.law.task_metric` from the rows that the tick has whitened."""
    tick, W, below = plan.tick, np.eye(n), 0.0
    shares = {name: dict(task.levels) for name, task in command.tasks.items()}
    for number in reversed(plan.levels):
        absent = 1.0
        for (level, i, _), (_, first, rows) in zip(plan.places, tick.slots.tolist(), strict=True):
            if level == number:
                h = shares[plan.members[i].task.name].get(level, 0.0)
                J = np.array(tick.Jw[first : first + rows, :n])
                W += level_weight(below) * h * J.T @ J
                absent *= 1.0 - h
        below += 1.0 - absent
    return W


def _distances(
    tick: Record, guard: CollisionAvoidance | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """D, how fast it grows and how that changes at q̈ = 0, from what the tick has measured."""
    d = tick.distances
    if guard is None or not len(tick.distance):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    balls, sets = d.row.T
    ball, axes, motion = d.ball_motion[balls], d.set_axes[sets], d.set_motion[sets]
    R = axes[:, :9].reshape(-1, 3, 3)  # the axes as rows
    local = np.einsum("kij,kj->ki", R, ball[:, :3] - axes[:, 9:])
    meshes = Meshes(d.mesh[sets], d.face.reshape(-1, 4, 3))
    _, n = set_distance(local, d.extent[sets, :3], d.extent[sets, 3:6], meshes)
    n = np.einsum("kij,ki->kj", R, n)
    v = ball[:, 3:6] - motion[:, :3] - np.cross(motion[:, 3:6], ball[:, :3])
    D, rate = np.array(tick.distance) - guard.kept, np.einsum("ki,ki->k", n, v)
    share = d.share[sets]
    own = np.where(share > 0.0, np.einsum("ki,ki->k", n, ball[:, 3:6]), rate)
    return D, rate, np.array(d.most) - closing(guard, D, rate, own, share)[0]
