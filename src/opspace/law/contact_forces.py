"""Floating bases and contacts: who carries what, and the nearest motion with forces that exist.

The equations of motion are A q̈ + b = (0; τ) + Σ_c J_cᵀ λ_c, with no motor at the first rows, those of
the base. The law says what q̈ should be; `share` says which forces would give the base its part of it;
`realise` replaces both by the nearest ones that forces, motors and joints allow.
"""

# L, J, G, W, Z and E are matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from opspace.law.blending import Weighted
from opspace.law.nearest import nearest_within
from opspace.law.scalars import (
    BROKEN,
    HARD,
    LEAST_REGULAR,
    MOTOR_SOFT,
    NEARNESS,
    RANK_TOLERANCE,
    REFINEMENTS,
    SOFT,
    UNMOVED,
)

NORMAL = 2
"""Component of a contact's force that points out of the surface."""


class ForceSet(NamedTuple):
    """One contact as a force.

    Attributes:
        J: (m, n) Jacobian of the contact in its own axes.
        cone: (k, m) rows C of C λ <= 0.
        metric: (m,) diagonal of R, in which forces are near to each other.
        activation: h_f, 0 to 1: how much of its force may be there.
        most: Largest normal force with h_f = 1, N.
        reference: (m,) force that is wanted of it.
    """

    J: Float[np.ndarray, "m n"]
    cone: Float[np.ndarray, "k m"]
    metric: Float[np.ndarray, " m"]
    activation: float
    most: float
    reference: Float[np.ndarray, " m"]

    def rows(self) -> tuple[Float[np.ndarray, "k m"], Float[np.ndarray, " k"]]:
        """Give rows and bounds of h_f K: the cone, cut off at the largest force."""
        cut = np.zeros((1, self.metric.size))
        cut[0, NORMAL] = 1.0
        bounds = np.zeros(self.cone.shape[0] + 1)
        bounds[-1] = self.activation * self.most
        return np.concatenate([self.cone, cut]), bounds


class Wish(NamedTuple):
    """What the law wants of a robot.

    Attributes:
        L: (n, n) Cholesky factor of the inertia.
        bias: (n,) Coriolis, centrifugal and gravity torque, N·m.
        acceleration: (n,) q̈*, rad/s².
        forces: λ* of every force set, N and N·m.
        W: (n, n) metric in x = Lᵀ q̈, see `opspace.law.task_metric`.
        free: (n, r) orthonormal basis in x of the motions that no closed contact holds.
        base: Number of the first coordinates, those without a motor.
    """

    L: Float[np.ndarray, "n n"]
    bias: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    forces: Sequence[Float[np.ndarray, " m"]]
    W: Float[np.ndarray, "n n"]
    free: Float[np.ndarray, "n r"]
    base: int


class Room(NamedTuple):
    """What joints and motors may do.

    Attributes:
        lower: (n,) least accelerations, -inf where there is none, rad/s².
        upper: (n,) largest accelerations, rad/s².
        torque: (n,) what the motors give, inf where they are not asked, N·m.
        combined: (k, n) combinations of accelerations that are bounded, as those with which distances
            shrink.
        most: (k,) their bounds.
        give_way: (k,) their softness, see `opspace.law.nearest.softness_of_rows`.
    """

    lower: Float[np.ndarray, " n"]
    upper: Float[np.ndarray, " n"]
    torque: Float[np.ndarray, " n"]
    combined: Float[np.ndarray, "k n"]
    most: Float[np.ndarray, " k"]
    give_way: Float[np.ndarray, " k"]


class Realised(NamedTuple):
    """A motion with forces that exist, and what was given up for it.

    Attributes:
        tau: (n,) torque, N·m, zero at the base.
        acceleration: (n,) q̈, rad/s².
        forces: λ of every force set, N and N·m.
        given_up: Wrench on the base that the law wanted and does not get, (base,) N and N·m.
        upper: (n,) by how much each upper bound acts on its joint, 0 where it does not.
        lower: (n,) the same of the lower bounds.
        motors: Whether a bound on a torque acts.
        rows: (k,) by how much each bound on a combination of accelerations lowers it.
        projected: Whether anything had to be given up or kept at all.
    """

    tau: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    forces: list[Float[np.ndarray, " m"]]
    given_up: Float[np.ndarray, " base"]
    upper: Float[np.ndarray, " n"]
    lower: Float[np.ndarray, " n"]
    motors: bool
    rows: Float[np.ndarray, " k"]
    projected: bool


def share(
    sets: Sequence[ForceSet],
    wrench: Float[np.ndarray, " base"],
    corners: Sequence[Weighted],
) -> list[Float[np.ndarray, " m"]]:
    """Divide a wrench on the base among contacts that come and go.

        λ* = Σ_T w_T λ(T),   λ(T) = λ_ref + R⁻¹ Gᵀ (G R⁻¹ Gᵀ)⁻¹ (w − G λ_ref),   G = J[:, base]ᵀ

    λ(T) is nearest to what is wanted of the contacts among all forces that give the wrench, those not
    in T carrying nothing. Where no force gives it, it is the least-squares one.

    Args:
        sets: Every contact.
        wrench: (base,) w, N and N·m.
        corners: Which contacts carry, as indices, with weights that sum to 1.

    Returns:
        λ* of every contact.
    """
    total = [np.zeros(one.metric.size) for one in sets]
    for weight, present in corners:
        order = sorted(present)
        if not order:
            continue
        G = np.concatenate([sets[c].J[:, : wrench.size].T for c in order], axis=1)
        R = np.concatenate([sets[c].metric for c in order])
        wanted = np.concatenate([sets[c].reference for c in order])
        found = wanted + _least(G, R, wrench - G @ wanted)
        ends = np.cumsum([sets[c].metric.size for c in order])[:-1]
        for c, part in zip(order, np.split(found, ends), strict=True):
            total[c] += weight * part
    return total


def _least(
    G: Float[np.ndarray, "b m"], R: Float[np.ndarray, " m"], w: Float[np.ndarray, " b"]
) -> Float[np.ndarray, " m"]:
    """Find the least force in the metric R with G λ = w, without deciding on a rank."""
    S = (G / R) @ G.T
    S[np.diag_indices_from(S)] += LEAST_REGULAR * np.trace(S)
    found = np.zeros(R.size)
    for _ in range(1 + REFINEMENTS):
        found += (G.T @ np.linalg.solve(S, w - G @ found)) / R
    return found


def free_motions(held: Float[np.ndarray, "m n"], L: Float[np.ndarray, "n n"]) -> np.ndarray:
    """Give an orthonormal basis in x = Lᵀ q̈ of the motions that leave some rows alone.

    Args:
        held: (m, n) rows J of J q̈ that must stay.
        L: (n, n) Cholesky factor of the inertia.

    Returns:
        (n, r).
    """
    n = L.shape[0]
    if not held.shape[0]:
        return np.eye(n)
    _, s, Vt = np.linalg.svd(np.linalg.solve(L, held.T).T)
    return Vt[int(np.sum(s > RANK_TOLERANCE * s[0])) :].T


def realise(wish: Wish, sets: Sequence[ForceSet], room: Room) -> Realised:
    """Find the motion and forces nearest to what is wanted that forces, motors and joints allow.

        min ‖Lᵀ(q̈ − q̈*)‖²_W + e Σ ‖λ_c − λ*_c‖²_R + Σ excess²/softness
        J_held q̈ = J_held q̈*,   (A q̈ + b)[base] = Σ (J_cᵀ λ_c)[base],   λ_c ∈ h_c K_c
        lower <= q̈ <= upper,   combined q̈ <= most,   |τ| <= room,   τ = (A q̈ + b − Σ J_cᵀ λ_c)[joints]

    Where what is wanted keeps everything it is the answer, to the last bit.

    Args:
        wish: What is wanted.
        sets: The contacts, in the order of ``wish.forces``.
        room: What joints and motors may do.

    Returns:
        The answer.
    """
    n, base = wish.bias.size, wish.base
    J = np.concatenate([np.zeros((0, n)), *(one.J for one in sets)])
    forces = np.concatenate([np.zeros(0), *wish.forces])
    pull = wish.L @ (wish.L.T @ wish.acceleration)
    tau = pull + wish.bias - J.T @ forces
    here = _State(wish.acceleration, forces, tau)
    limits = _limits(sets, room, base)
    none, nothing = np.zeros(n), np.zeros(room.most.size)
    if _balanced(tau[:base], pull + wish.bias) and limits.kept(here):
        tau[:base] = 0.0
        unchanged = list(wish.forces)
        return Realised(
            tau, wish.acceleration, unchanged, none[:base], none, none, False, nothing, False
        )
    change = _changes(wish, sets, J)
    start, basis = _solutions(change.tau[:base], -tau[:base])
    rows, bounds, softness = limits.along(change, here)
    inside = rows @ basis
    # A bound that nothing can move is not kept by moving.
    dead = np.linalg.norm(inside, axis=1) <= UNMOVED * np.linalg.norm(rows, axis=1)
    left = np.where(dead, np.inf, bounds - rows @ start)
    z, taken = nearest_within(np.zeros(basis.shape[1]), inside, left, softness)
    y = start + basis @ z
    acceleration = here.acceleration + change.acceleration @ y
    forces = forces + change.forces @ y
    tau = pull + wish.L @ (wish.L.T @ (change.acceleration @ y)) + wish.bias - J.T @ forces
    tau = np.concatenate([np.zeros(base), np.clip(tau, -room.torque, room.torque)[base:]])
    ends = np.cumsum([one.metric.size for one in sets])[:-1]
    cones = taken.size - 4 * n - room.most.size
    upper, lower, motors, apart = np.split(taken[cones:], [n, 2 * n, 4 * n])
    given_up = (wish.L @ (wish.L.T @ (acceleration - wish.acceleration)))[:base]
    return Realised(
        tau,
        acceleration,
        np.split(forces, ends) if sets else [],
        given_up,
        upper,
        lower,
        bool(np.any(motors)),
        apart,
        True,
    )


class _State(NamedTuple):
    """A motion with its forces and torque, or how each of them changes with some coordinates."""

    acceleration: Float[np.ndarray, "n ..."]
    forces: Float[np.ndarray, "m ..."]
    tau: Float[np.ndarray, "n ..."]


class _Limits(NamedTuple):
    """Everything that must be kept: rows of forces, and bounds on accelerations and torques."""

    cones: Float[np.ndarray, "k m"]
    bounds: Float[np.ndarray, " k"]
    room: Room

    def values(self, at: _State) -> Float[np.ndarray, "j ..."]:
        """Give what is bounded, of a state or of its changes."""
        apart = self.room.combined @ at.acceleration
        return np.concatenate(
            [self.cones @ at.forces, at.acceleration, -at.acceleration, at.tau, -at.tau, apart]
        )

    def most(self) -> Float[np.ndarray, " j"]:
        room = self.room
        motors = room.torque, room.torque
        return np.concatenate([self.bounds, room.upper, -room.lower, *motors, room.most])

    def kept(self, at: _State) -> bool:
        """Tell whether a state keeps everything, forces in parts of what is pressed."""
        most = self.most()
        size = np.maximum(1.0, np.abs(np.where(most < np.inf, most, 1.0)))
        return bool(np.all(self.values(at) <= most + BROKEN * size))

    def along(
        self, change: _State, at: _State
    ) -> tuple[Float[np.ndarray, "j y"], Float[np.ndarray, " j"], Float[np.ndarray, " j"]]:
        """Give rows, bounds and softness for changes of a state."""
        n = at.tau.size
        soft = [HARD] * self.bounds.size + [SOFT] * (2 * n) + [MOTOR_SOFT] * (2 * n)
        softness = np.concatenate([soft, self.room.give_way])
        return self.values(change), self.most() - self.values(at), softness


def _limits(sets: Sequence[ForceSet], room: Room, base: int) -> _Limits:
    """Collect cones and bounds; the base has no motor, whatever is said of it."""
    pairs = [one.rows() for one in sets]
    torque = np.concatenate([np.full(base, np.inf), room.torque[base:]])
    cones = np.zeros((sum(rows.shape[0] for rows, _ in pairs), sum(o.metric.size for o in sets)))
    row = column = 0
    for rows, _ in pairs:
        k, m = rows.shape
        cones[row : row + k, column : column + m] = rows
        row, column = row + k, column + m
    bounds = np.concatenate([np.zeros(0), *(bound for _, bound in pairs)])
    return _Limits(cones, bounds, room._replace(torque=torque))


def _balanced(left: Float[np.ndarray, " b"], wanted: Float[np.ndarray, " n"]) -> bool:
    """Tell whether forces give the base what it needs."""
    return bool(np.all(np.abs(left) <= BROKEN * (1.0 + np.max(np.abs(wanted)))))


def _changes(wish: Wish, sets: Sequence[ForceSet], J: Float[np.ndarray, "m n"]) -> _State:
    """Give how everything changes with y = (s, √(e R) d), whose length is what is made small.

    s is the change of the motion, unit in its metric W, and d that of the forces.
    """
    Z, m = wish.free, J.shape[0]
    C = np.linalg.cholesky(Z.T @ wish.W @ Z)
    moves = np.linalg.solve(C, Z.T).T
    metric = np.concatenate([np.zeros(0), *(one.metric for one in sets)])
    force = np.diag(1.0 / np.sqrt(_nearness(wish, sets, moves) * metric))
    still = np.zeros((m, moves.shape[1]))
    return _State(
        np.concatenate([np.linalg.solve(wish.L.T, moves), np.zeros((wish.bias.size, m))], axis=1),
        np.concatenate([still, force], axis=1),
        np.concatenate([wish.L @ moves, -J.T @ force], axis=1),
    )


def _nearness(wish: Wish, sets: Sequence[ForceSet], moves: Float[np.ndarray, "n r"]) -> float:
    """Weigh the nearness of forces against that of the motion which they cause.

        e = ε Σ h tr(Gᵀ A⁻¹ G) / Σ h tr R,   A = E W⁻¹ Eᵀ, E the base's part of L

    weighed with h, so that it does not step where a contact comes or goes.
    """
    E = (wish.L @ moves)[: wish.base]
    A = E @ E.T
    A[np.diag_indices_from(A)] += LEAST_REGULAR * np.trace(A)
    cause = resist = 0.0
    for one in sets:
        G = one.J[:, : wish.base].T
        cause += one.activation * float(np.trace(G.T @ np.linalg.solve(A, G)))
        resist += one.activation * float(np.sum(one.metric))
    return NEARNESS * cause / resist if resist > 0.0 else 1.0


def _solutions(
    E: Float[np.ndarray, "b y"], right: Float[np.ndarray, " b"]
) -> tuple[Float[np.ndarray, " y"], Float[np.ndarray, "y z"]]:
    """Give the shortest solution of E y = right and a basis of what may be added to it."""
    if not E.shape[0]:
        return np.zeros(E.shape[1]), np.eye(E.shape[1])
    U, s, Vt = np.linalg.svd(E)
    rank = int(np.sum(s > RANK_TOLERANCE * s[0]))
    return Vt[:rank].T @ ((U[:, :rank].T @ right) / s[:rank]), Vt[rank:].T
