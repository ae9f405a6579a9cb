"""Distances of points to convex sets that move, and bounds on how they change.

A point, a segment, a box and a half-space are boxes whose sides have no length or no end; grown by a
radius the first two are a ball and a capsule. So one projection serves all but meshes, see
`opspace.law.polyhedra`.
"""

# jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingTypeStubs=false
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from opspace.law.polyhedra import Meshes, mesh_distance
from opspace.law.scalars import NO_DISTANCE, ROUNDED


class Points(NamedTuple):
    """Points of moving bodies, one per row.

    Attributes:
        position: (k, 3) m.
        velocity: (k, 3) m/s.
        acceleration: (k, 3) at q̈ = 0, m/s².
        J: (k, 3, n) velocity = J q̇.
    """

    position: Float[np.ndarray, "k 3"]
    velocity: Float[np.ndarray, "k 3"]
    acceleration: Float[np.ndarray, "k 3"]
    J: Float[np.ndarray, "k 3 n"]


class Bodies(NamedTuple):
    """Bodies that carry convex sets, one per row; all in world axes at the body's origin.

    Attributes:
        rotation: (k, 3, 3) from the body's axes to those of the world.
        position: (k, 3) m.
        velocity: (k, 6) linear then angular, m/s and rad/s.
        acceleration: (k, 6) at q̈ = 0, m/s² and rad/s².
        J: (k, 6, n) velocity = J q̇.
    """

    rotation: Float[np.ndarray, "k 3 3"]
    position: Float[np.ndarray, "k 3"]
    velocity: Float[np.ndarray, "k 6"]
    acceleration: Float[np.ndarray, "k 6"]
    J: Float[np.ndarray, "k 6 n"]


class DistanceRows(NamedTuple):
    """Distances ρ and what is known of their rates: ρ̇ = G q̇ + what moves by itself, ρ̈ ≥ G q̈ + drift.

    Attributes:
        distance: (k,) ρ, below 0 inside, m.
        rate: (k,) ρ̇, m/s.
        passing: (k,) speed |v_rel| at which the point moves past the set, m/s.
        G: (k, n) by how much an acceleration of the joints changes it, 1 or m.
        drift: (k,) m/s².
        own_rate: (k,) the part of ρ̇ that the point has, n · v_p, m/s.
        own_drift: (k,) what is left of ``drift`` where what the set accelerates by is counted on its
            side, m/s².
    """

    distance: Float[np.ndarray, " k"]
    rate: Float[np.ndarray, " k"]
    passing: Float[np.ndarray, " k"]
    G: Float[np.ndarray, "k n"]
    drift: Float[np.ndarray, " k"]
    own_rate: Float[np.ndarray, " k"]
    own_drift: Float[np.ndarray, " k"]


def box_distance(
    point: Float[np.ndarray, "k 3"],
    lower: Float[np.ndarray, "k 3"],
    upper: Float[np.ndarray, "k 3"],
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, "k 3"]]:
    """Signed distance of points to boxes, and where it grows.

    Args:
        point: (k, 3) in the axes of the box, m.
        lower: (k, 3) where the box begins, m; -inf where it does not.
        upper: (k, 3) where it ends, m; inf where it does not.

    Returns:
        (k,) the distance, below zero inside, and (k, 3) its gradient, of unit length.
    """
    apart = point - np.clip(point, lower, upper)
    distance = np.linalg.norm(apart, axis=1)
    normal = apart / np.where(distance > 0.0, distance, 1.0)[:, None]
    for i in np.flatnonzero(distance == 0.0):
        depth = np.concatenate([point[i] - lower[i], upper[i] - point[i]])
        face = int(np.argmin(depth))
        distance[i], normal[i, face % 3] = -depth[face], -1.0 if face < 3 else 1.0
    return distance, normal


def set_distance(
    point: Float[np.ndarray, "k 3"],
    lower: Float[np.ndarray, "k 3"],
    upper: Float[np.ndarray, "k 3"],
    meshes: Meshes | None,
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, "k 3"]]:
    """Signed distance of points to boxes and meshes, as `box_distance` gives it.

    Args:
        point: (k, 3) in the axes of the set, m.
        lower: (k, 3) where a box begins, m.
        upper: (k, 3) where it ends, m.
        meshes: Which sets are meshes; None for none.
    """
    distance, normal = box_distance(point, lower, upper)
    if meshes is None:
        return distance, normal
    for i, (first, count) in enumerate(meshes.place.tolist()):
        if count:
            distance[i], normal[i] = mesh_distance(point[i], meshes.face[first : first + count])
    return distance, normal


def distance_rows(
    points: Points,
    bodies: Bodies,
    lower: Float[np.ndarray, "k 3"],
    upper: Float[np.ndarray, "k 3"],
    meshes: Meshes | None = None,
) -> DistanceRows:
    """Bound from below how distances of points to convex sets accelerate.

        ρ̇ = n · v_rel                v_rel = v_p − v_B(p)
        ρ̈ ≥ n · a_rel                a_rel = a_p − a_B(p) − 2 ω_B × v_rel

    n is the direction from the nearest point of the set to p. Seen from the body the set is fixed, and
    the distance to a convex set is a convex function: what the inequality leaves out is not negative,
    and zero where the set is flat. Of a set that is a point it is known, |v_t|²/ρ, and counted; of a
    mesh, whose edges a point passes one after another, nothing is counted.

    Where two bodies keep away from each other, each counts what its own points accelerate by. The
    acceleration of B at p is that of its nearest point, a_P, and what B's turning adds:

        ρ̈ ≥ n · a_p − n · a_P + ρ |ω_B × n|² − 2 n · (ω_B × v_rel)

    The last two terms are for p where they are negative, and nobody's where they help.

    Args:
        points: The points p.
        bodies: The bodies B that the sets are fixed to.
        lower: (k, 3) where each set begins in the axes of its body, see `box_distance`, m.
        upper: (k, 3) where it ends, m.
        meshes: Which of the sets are meshes; None for none.

    Returns:
        One row per point.
    """
    way = points.position - bodies.position
    local = np.einsum("kji,kj->ki", bodies.rotation, way)
    distance, n = set_distance(local, lower, upper, meshes)
    n = np.einsum("kij,kj->ki", bodies.rotation, n)
    linear, spin = bodies.velocity[:, :3], bodies.velocity[:, 3:]
    v = points.velocity - linear - np.cross(spin, way)
    carried = bodies.acceleration[:, :3] + np.cross(bodies.acceleration[:, 3:], way)
    a = points.acceleration - carried - np.cross(spin, np.cross(spin, way) + 2.0 * v)
    rate, drift = np.einsum("ki,ki->k", n, v), np.einsum("ki,ki->k", n, a)
    seen = np.stack([n, v - rate[:, None] * n])
    n_axes, tangent = np.einsum("kji,skj->ski", bodies.rotation, seen)
    round_ = np.where(lower == upper, 1.0, np.minimum(np.abs(n_axes) / ROUNDED, 1.0))
    if meshes is not None:
        round_[meshes.place[:, 1] > 0] = 0.0
    curved = np.sum(round_ * tangent**2, axis=1) / np.maximum(distance, NO_DISTANCE)
    drift = drift + curved
    across = np.sum(np.cross(spin, n) ** 2, axis=1)
    turning = np.maximum(distance, 0.0) * across - 2.0 * np.einsum("ki,ki->k", n, np.cross(spin, v))
    own_drift = np.einsum("ki,ki->k", n, points.acceleration) + np.minimum(turning + curved, 0.0)
    own_rate = np.einsum("ki,ki->k", n, points.velocity)
    straight = np.einsum("ki,kij->kj", n, points.J - bodies.J[:, :3])
    G = straight - np.einsum("ki,kij->kj", np.cross(way, n), bodies.J[:, 3:])
    passing = np.linalg.norm(v, axis=1)
    return DistanceRows(distance, rate, passing, G, drift, own_rate, own_drift)
