"""A strict hierarchy of quadratic programs: one level after the other, every limit hard in each."""

# daqp has no type stubs, and is not a dependency. C and A are rows, Z is a basis.
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
# ruff: noqa: PLC0415 - an optional peer

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from opspace.compare.laws import presences
from opspace.controller import ReferenceController
from opspace.controller.contact_stages import GROUND
from opspace.controller.limit_task_sets import TOP
from opspace.controller.stages import Question, sum_of_hard_torques
from opspace.errors import InputError, missing_extra
from opspace.law import LawInfo
from opspace.law.contact_forces import ForceSet, Realised, Room, Wish
from opspace.law.hierarchy import RANK_TOLERANCE, levels_of, stack_rows, whiten

FOUND = 1
"""What daqp answers when it has the minimum."""
ACTS = 1e-6
"""A limit acts where less than this is left of it, N, N·m or rad/s²."""


def daqp_installed() -> bool:
    """Tell whether the solver can be found."""
    return importlib.util.find_spec("daqp") is not None


class Rows(NamedTuple):
    """Rows C, (k, z), and bounds d, (k,), of C z <= d."""

    C: np.ndarray
    d: np.ndarray

    def bounded(self) -> Rows:
        """Leave out what is not bounded."""
        there = np.isfinite(self.d)
        return Rows(self.C[there], self.d[there])

    def with_rows(self, other: Rows) -> Rows:
        """Put other rows below these."""
        return Rows(np.concatenate([self.C, other.C]), np.concatenate([self.d, other.d]))


class Decided(NamedTuple):
    """What the levels so far have come to.

    Attributes:
        z: (z,) the unknowns.
        free: (z, r) orthonormal basis of what may be added without changing any of these levels.
    """

    z: np.ndarray
    free: np.ndarray


def level_below(above: Decided, A: np.ndarray, b: np.ndarray, kept: Rows) -> Decided:
    """Solve min ‖A z − b‖² among what the levels above leave open, with C z <= d.

    Args:
        above: What they decided, which keeps the rows.
        A: (m, z).
        b: (m,).
        kept: C and d.

    Returns:
        What is decided now.

    Raises:
        InputError: daqp found no minimum.
    """
    z, free = above
    U, s, Vt = np.linalg.svd(A @ free)
    seen = int(np.sum(s > RANK_TOLERANCE * np.linalg.norm(A, 2))) if A.size and s.size else 0
    if not seen:
        return above
    # In y the level is a distance over the first coordinates, and as large as the solver's tolerances
    # take it to be.
    turned = free @ Vt.T
    turned[:, :seen] *= s[0] / s[:seen]
    wanted = np.zeros(turned.shape[1])
    wanted[:seen] = U[:, :seen].T @ (b - A @ z) / s[0]
    # The levels above kept the rows; what rounding took of that is not asked for again.
    left = Rows(kept.C @ turned, np.maximum(kept.d - kept.C @ z, 0.0))
    y = wanted if np.all(left.C @ wanted <= left.d) else _program(seen, wanted, left)
    return Decided(z + turned @ y, turned[:, seen:])


def _program(seen: int, wanted: np.ndarray, kept: Rows) -> np.ndarray:
    """Minimise the distance in the first coordinates, with C y <= d."""
    import daqp

    H = np.diag((np.arange(wanted.size) < seen).astype(float))
    y, _, flag, _ = daqp.solve(H, -wanted, np.ascontiguousarray(kept.C), kept.d)
    if flag != FOUND:
        raise InputError(f"daqp found no minimum: it answers {flag}")
    return y


def give_way(above: Decided, kept: Rows, asked: Rows) -> tuple[Decided, Rows]:
    """Find the least excess over some bounds, min ‖s‖² with C z <= d + s, where they cannot be kept.

    Args:
        above: What was decided before.
        kept: Rows that hold whatever happens.
        asked: C and d.

    Returns:
        A decision that is as far inside as it can be, and C with d + s.
    """
    z, free = above
    excess = np.maximum(asked.C @ z - asked.d, 0.0)
    if not np.any(excess):
        return above, asked
    k, r = excess.size, free.shape[1]
    # Unknown are (y, s): y = 0 with the excess that there is keeps every row.
    begin = Decided(np.concatenate([np.zeros(r), excess]), np.eye(r + k))
    rows = Rows(np.hstack([kept.C @ free, np.zeros((kept.d.size, k))]), kept.d - kept.C @ z)
    rows = rows.with_rows(Rows(np.hstack([asked.C @ free, -np.eye(k)]), asked.d - asked.C @ z))
    rows = rows.with_rows(Rows(np.hstack([np.zeros((k, r)), -np.eye(k)]), np.zeros(k)))
    least = level_below(begin, np.hstack([np.zeros((k, r)), np.eye(k)]), np.zeros(k), rows)
    inside = z + free @ least.z[:r]
    return Decided(inside, free), Rows(asked.C, np.maximum(asked.d, asked.C @ inside))


class Body:
    """The unknowns z = (x, λ), x = Lᵀ q̈ and λ the forces of the contacts, and what limits them."""

    def __init__(self, wish: Wish, sets: Sequence[ForceSet], room: Room) -> None:
        self.n, self.base = wish.bias.size, wish.base
        self.wish, self.room, self.sets = wish, room, sets
        self.sizes = [one.metric.size for one in sets]
        self.m = sum(self.sizes)
        J = np.concatenate([np.zeros((0, self.n)), *(one.J for one in sets)])
        self.torque = np.hstack([wish.L, -J.T])
        self.acceleration = np.hstack([np.linalg.inv(wish.L).T, np.zeros((self.n, self.m))])

    def start(self) -> Decided:
        """Fall freely, which keeps the equations of the base, every cone and every motor."""
        E = self.torque[: self.base]
        z = np.concatenate([np.linalg.solve(self.wish.L, -self.wish.bias), np.zeros(self.m)])
        _, _, Vt = np.linalg.svd(E)
        return Decided(z, Vt[self.base :].T)

    def kept(self) -> Rows:
        """Cones and motors."""
        cones, column = Rows(np.zeros((0, self.n + self.m)), np.zeros(0)), self.n
        for one in self.sets:
            C, d = one.rows()
            wide = np.zeros((d.size, self.n + self.m))
            wide[:, column : column + one.metric.size] = C
            cones, column = cones.with_rows(Rows(wide, d)), column + one.metric.size
        tau, bias = self.torque[self.base :], self.wish.bias[self.base :]
        most = self.room.torque[self.base :]
        return cones.with_rows(
            Rows(np.concatenate([tau, -tau]), np.concatenate([most - bias, most + bias]))
        ).bounded()

    def joints(self) -> Rows:
        """Bounds of accelerations, and of how fast distances shrink."""
        a, room = self.acceleration, self.room
        rows = np.concatenate([a, -a, room.combined @ a])
        return Rows(rows, np.concatenate([room.upper, -room.lower, room.most])).bounded()

    def motion(self, A: np.ndarray) -> np.ndarray:
        """Let rows of x be rows of z."""
        return np.hstack([A, np.zeros((A.shape[0], self.m))])

    def forces(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and values of λ = λ_ref in the metric R."""
        size = np.sqrt(np.concatenate([np.zeros(0), *(one.metric for one in self.sets)]))
        wanted = np.concatenate([np.zeros(0), *(one.reference for one in self.sets)])
        return np.hstack([np.zeros((self.m, self.n)), np.diag(size)]), size * wanted

    def answer(self, z: np.ndarray) -> Realised:
        """Tell what was found, and what of it is less than was wanted."""
        wish, room, base = self.wish, self.room, self.base
        acceleration = self.acceleration @ z
        missing = wish.acceleration - acceleration
        tau = self.torque @ z + wish.bias
        tau[:base] = 0.0
        room_left = room.torque[base:] - np.abs(tau[base:])
        towards = room.combined @ acceleration
        return Realised(
            np.clip(tau, -room.torque, room.torque),
            acceleration,
            np.split(z[self.n :], np.cumsum(self.sizes)[:-1]) if self.sets else [],
            -(wish.L @ (wish.L.T @ missing))[:base],
            np.where(acceleration > room.upper - ACTS, np.maximum(missing, 0.0), 0.0),
            np.where(acceleration < room.lower + ACTS, np.maximum(-missing, 0.0), 0.0),
            bool(np.any(room_left < ACTS)),
            np.where(towards > room.most - ACTS, np.maximum(room.combined @ missing, 0.0), 0.0),
            bool(np.max(np.abs(missing), initial=0.0) > ACTS),
        )


class StrictProgram:
    """Motion and forces of a robot on contacts, level by level.

    The equations of the base, cones and motors hold in every level. Then come, each leaving to those
    before it what they have reached,

        contacts   min ‖J q̈ − γ‖²
        joints     min ‖excess over their accelerations‖², which is all they get from there on
        a level    min Σ_k ‖Ĵ_k x − f_k‖² over its tasks with h_k > 0
        forces     min Σ_c ‖λ_c − λ_ref,c‖²_R

    What can be ramped is the largest force of a contact. A task is there or not: to weigh its rows by
    h_k makes no difference to a task that nothing in its level contradicts, before h_k is 0.
    """

    def __init__(self) -> None:
        self._asked: Question | None = None

    def law(self, asked: Question) -> tuple[np.ndarray, LawInfo]:
        """Remember what is asked; answer what would be done if nothing were limited."""
        self._asked = asked
        return sum_of_hard_torques(asked)

    def realise(self, wish: Wish, sets: Sequence[ForceSet], room: Room) -> Realised:
        """See `opspace.law.contact_forces.realise`.

        Raises:
            InputError: daqp found no minimum.
        """
        assert self._asked is not None
        body = Body(wish, sets, room)
        kept, joints, found = body.kept(), body.joints(), body.start()
        levels = list(_levels(self._asked, body, limited=bool(joints.d.size)))
        for _, A, b in (level for level in levels if level[0] <= GROUND):
            found = level_below(found, A, b, kept)
        found, joints = give_way(found, kept, joints)
        kept = kept.with_rows(joints)
        for _, A, b in (level for level in levels if level[0] > GROUND):
            found = level_below(found, A, b, kept)
        return body.answer(level_below(found, *body.forces(), kept).z)


def _levels(
    asked: Question, body: Body, *, limited: bool
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Priority, rows and values of every level, but for joint limits that are bounds."""
    h = presences(asked.corners, len(asked.task_sets))
    white = whiten(asked.task_sets, asked.L)
    for level in levels_of(asked.task_sets):
        there = [k for k in level.members if h[k] > 0.0]
        if there and not (limited and level.priority == TOP):
            J, f = stack_rows(white, there)
            yield level.priority, body.motion(J), f


class StrictProgramController(ReferenceController):
    """The tasks, gains, contacts and limits of the library under a strict hierarchy of programs.

    Raises:
        InputError: The robot does not stand on contacts.
        MissingExtraError: daqp is not installed.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        if not daqp_installed():
            raise missing_extra("daqp", "compare")
        super().__init__(*args, **options)
        if not self.robot.floating_base:
            raise InputError(
                f"robot {self.robot.name!r} is bolted down; this program is for robots on contacts"
            )
        program = StrictProgram()
        self._rules = replace(self._rules, law=program.law, realise=program.realise)
