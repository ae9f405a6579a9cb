"""Distances of one tick, and how fast each may shrink, compiled; see `opspace.law.convex`."""

from __future__ import annotations

import math

from opspace.kernels.compiled_scalars import (
    asked_for,
    closing_command,
    last_closing_command,
    yielding,
)
from opspace.kernels.inertia import acceleration_of, whiten
from opspace.kernels.mesh_distance import from_mesh
from opspace.kernels.motion import cross_add, move_joints
from opspace.law.scalars import LOST, NO_DISTANCE, ROUNDED, SOFT_APART
from opspace.machine.jit import jit

MARGIN, K1, K2, BRAKE = range(4)
"""Entries of Distances.limits."""


@jit
def measure_distances(work):
    """Evaluate all distances and the bounds G q̈ <= most that keep them.

    Writes distance (distances,) m, and of work.distances G (distances, n) and most (distances,) m/s².
    """
    d = work.distances
    if d.row.shape[0] == 0:
        return
    move_joints(work)
    for i in range(d.ball.shape[0]):
        _place_ball(work, d, i)
    for i in range(d.set_place.shape[0]):
        _place_set(work, d, i)
    for i in range(d.row.shape[0]):
        _bound(work, d, i, d.ball_motion[d.row[i, 0]], d.row[i, 1])


@jit
def _place_ball(work, d, i):
    """Position, velocity and drift of the centre of a ball, in world axes."""
    x, centre = d.ball_motion[i], d.ball[i]
    body, joint = d.ball_place[i, 0], d.ball_place[i, 1]
    for row in range(3):
        total = centre[row]
        if body >= 0:
            total = work.placement[body, 9 + row]
            for c in range(3):
                total += work.placement[body, 3 * c + row] * centre[c]
        x[row], x[3 + row], x[6 + row] = total, 0.0, 0.0
    if joint < 0:
        return
    V, A = work.velocity[joint], work.acceleration[joint]
    for c in range(3):
        x[3 + c], x[6 + c] = V[c], A[c]
    cross_add(x, 3, V[3], V[4], V[5], x[0], x[1], x[2])
    cross_add(x, 6, A[3], A[4], A[5], x[0], x[1], x[2])
    cross_add(x, 6, V[3], V[4], V[5], x[3], x[4], x[5])


@jit
def _place_set(work, d, i):
    """Axes of a set, and the motion of what carries it."""
    x, local, m = d.set_axes[i], d.set_local[i], d.set_motion[i]
    body, joint = d.set_place[i, 0], d.set_place[i, 1]
    for column in range(4):
        for row in range(3):
            total = local[3 * column + row]
            if body >= 0:
                total = work.placement[body, 9 + row] if column == 3 else 0.0
                for c in range(3):
                    total += work.placement[body, 3 * c + row] * local[3 * column + c]
            x[3 * column + row] = total
    for c in range(12):
        m[c] = 0.0
    if joint >= 0:
        for c in range(6):
            m[c], m[6 + c] = work.velocity[joint, c], work.acceleration[joint, c]
    elif body < 0:
        # It goes on as it moves: its origin does not accelerate, nor does its turn.
        V = d.twist[i]
        for c in range(6):
            m[c] = V[c]
        cross_add(m, 0, x[9], x[10], x[11], V[3], V[4], V[5])
        cross_add(m, 6, V[0], V[1], V[2], V[3], V[4], V[5])


@jit
def _bound(work, d, i, ball, of):
    """One row: ρ with its direction, its rate, and what bounds its second derivative."""
    x, m, extent = d.set_axes[of], d.set_motion[of], d.extent[of]
    faces = d.mesh[of, 1]
    if faces > 0:
        rho, nx, ny, nz = from_mesh(x, d.face, d.mesh[of, 0], faces, ball)
    else:
        rho, nx, ny, nz = _from_box(x, extent, ball)
    px, py, pz = ball[0], ball[1], ball[2]
    wx, wy, wz = m[3], m[4], m[5]
    bx, by, bz = m[0] + wy * pz - wz * py, m[1] + wz * px - wx * pz, m[2] + wx * py - wy * px
    vx, vy, vz = ball[3] - bx, ball[4] - by, ball[5] - bz
    # a_B(p) + 2 ω × v_rel, with a_B = a_O + α × p + ω × v_B.
    ux, uy, uz = bx + 2.0 * vx, by + 2.0 * vy, bz + 2.0 * vz
    ax = ball[6] - m[6] - (m[10] * pz - m[11] * py) - (wy * uz - wz * uy)
    ay = ball[7] - m[7] - (m[11] * px - m[9] * pz) - (wz * ux - wx * uz)
    az = ball[8] - m[8] - (m[9] * py - m[10] * px) - (wx * uy - wy * ux)
    rate, drift = nx * vx + ny * vy + nz * vz, nx * ax + ny * ay + nz * az
    curved = 0.0
    if faces == 0:
        curved = _curved(x, extent, rho, nx, ny, nz, vx - rate * nx, vy - rate * ny, vz - rate * nz)
    work.distance[i] = rho - d.ball[d.row[i, 0], 3] - extent[6]
    share, own = d.share[of], rate
    if share > 0.0:
        own = nx * ball[3] + ny * ball[4] + nz * ball[5]
        drift = nx * ball[6] + ny * ball[7] + nz * ball[8]
        drift += min(_turning(m, rho, nx, ny, nz, vx, vy, vz) + curved, 0.0)
    else:
        share = 1.0
        drift += curved
    D = work.distance[i] - d.limits[MARGIN]
    brake, k1, k2 = d.limits[BRAKE], d.limits[K1], d.limits[K2]
    command = closing_command(D, -rate, -own, share, brake, k1, k2)
    d.most[i] = drift + command
    d.asked[i] = asked_for(math.sqrt(vx * vx + vy * vy + vz * vz), brake)
    d.last[i] = drift + last_closing_command(D, -rate, -own, share, brake, k1, command)
    _row(work, d, i, of, nx, ny, nz)


@jit
def _curved(x, extent, rho, nx, ny, nz, ux, uy, uz):
    """What the set curves away from a ball that moves along it at u, as far as it does not step."""
    total = 0.0
    for c in range(3):
        a, b, e = x[3 * c], x[3 * c + 1], x[3 * c + 2]
        part = 1.0
        if extent[c] != extent[3 + c]:
            part = min(abs(a * nx + b * ny + e * nz) / ROUNDED, 1.0)
        along = a * ux + b * uy + e * uz
        total += part * along * along
    return total / max(rho, NO_DISTANCE)


@jit
def _turning(m, rho, nx, ny, nz, vx, vy, vz):
    """What a set that turns adds beside the acceleration of its nearest point."""
    wx, wy, wz = m[3], m[4], m[5]
    cx, cy, cz = wy * nz - wz * ny, wz * nx - wx * nz, wx * ny - wy * nx
    # n · (ω × v) = −v · (ω × n).
    aside = vx * cx + vy * cy + vz * cz
    return max(rho, 0.0) * (cx * cx + cy * cy + cz * cz) + 2.0 * aside


@jit
def _row(work, d, i, of, nx, ny, nz):
    """By how much accelerations of the joints let the distance shrink faster."""
    ball, G = d.ball_motion[d.row[i, 0]], d.G[i]
    px, py, pz = ball[0], ball[1], ball[2]
    for a in range(G.shape[0]):
        G[a] = 0.0
    cx, cy, cz = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    for side in range(2):
        sign = -1.0 if side == 0 else 1.0
        a = d.ball_place[d.row[i, 0], 1] if side == 0 else d.set_place[of, 1]
        while a >= 0:
            s = work.axes[a]
            along = s[0] * nx + s[1] * ny + s[2] * nz + s[3] * cx + s[4] * cy + s[5] * cz
            G[a] += sign * along
            a = work.parent[a]


@jit
def _from_box(x, extent, ball):
    """Signed distance of a centre to a box that is not grown, m, and its gradient in world axes."""
    rx, ry, rz = ball[0] - x[9], ball[1] - x[10], ball[2] - x[11]
    square, nx, ny, nz = 0.0, 0.0, 0.0, 0.0
    depth, face, out = math.inf, 0, 1.0
    for c in range(3):
        local = x[3 * c] * rx + x[3 * c + 1] * ry + x[3 * c + 2] * rz
        apart = local - min(max(local, extent[c]), extent[3 + c])
        square += apart * apart
        nx += apart * x[3 * c]
        ny += apart * x[3 * c + 1]
        nz += apart * x[3 * c + 2]
        if local - extent[c] < depth:
            depth, face, out = local - extent[c], c, -1.0
    if square > 0.0:
        rho = math.sqrt(square)
        return rho, nx / rho, ny / rho, nz / rho
    for c in range(3):
        local = x[3 * c] * rx + x[3 * c + 1] * ry + x[3 * c + 2] * rz
        if extent[3 + c] - local < depth:
            depth, face, out = extent[3 + c] - local, c, 1.0
    return -depth, out * x[3 * face], out * x[3 * face + 1], out * x[3 * face + 2]


@jit
def approach(work):
    """By how much distances shrink faster than they may, see `opspace.law.excess_of_rows`."""
    d, x = work.distances, work.joint_acceleration
    most = -math.inf
    for i in range(d.most.shape[0]):
        most = max(most, (faster(d, i, x) - d.most[i]) / max(1.0, abs(d.most[i])))
    return most


@jit
def will_close(work):
    """Whether a distance shrinks so much faster that it will soon close faster than it may."""
    d, x = work.distances, work.joint_acceleration
    for i in range(d.last.shape[0]):
        if faster(d, i, x) - d.last[i] > LOST * max(1.0, abs(d.last[i])):
            return True
    return False


@jit
def faster(d, i, x):
    """How fast the speed of approach of row i grows at accelerations x (n,), m/s², its drift apart."""
    total = 0.0
    for a in range(x.shape[0]):
        total += d.G[i, a] * x[a]
    return total


@jit
def row_softness(inertia, d, i):
    """How soft the bound of row i is; see `opspace.law.nearest.softness_of_rows`."""
    way = d.way
    for a in range(way.shape[0]):
        way[a] = d.G[i, a]
    whiten(inertia, way)
    acceleration_of(inertia, way)
    square = 0.0
    for a in range(way.shape[0]):
        if way[a] != 0.0:
            square += (way[a] * d.motors[a]) ** 2
    return SOFT_APART + yielding(d.most[i], math.sqrt(square), d.asked[i])
