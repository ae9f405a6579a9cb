"""Rigid-body dynamics in plain loops for compiled code: inertia, bias and motion axes of a tree.

Everything is seen from the origin of the world and in its axes (Featherstone 2008, chapters 5 and 6):
a motion is the velocity of the point of the body that passes the origin, then the angular velocity.
"""

from __future__ import annotations

import math

from opspace.kernels.whole_vectors import turn
from opspace.machine.jit import jit
from opspace.robots.joint_kinds import ALIGNED, HINGE, SLIDE, TRANSLATION

# Columns of Dynamics.inertia, about the origin of the world: mass, mass times centre, tensor.
MASS, MOMENT, TENSOR = 0, 1, 4


@jit
def evaluate(bodies, q, v, dynamics):
    """Compute inertia, bias, motion axes and placements at one state.

        M = Σᵢ Jᵢᵀ Iᵢ Jᵢ + armature      b + g = Σᵢ Jᵢᵀ (Iᵢ (J̇ᵢ v − g) + Vᵢ ×* Iᵢ Vᵢ),  Vᵢ = Jᵢ v

    by the composite-rigid-body and the recursive Newton-Euler algorithm. Springs at the joints and
    weight that is carried for the robot count as parts of g.

    Args:
        bodies: `RIGID_BODIES`.
        q: (nq,) configuration, rad or m; quaternions wxyz, of any length but zero.
        v: (n,) velocity, rad/s or m/s; that of a ball joint is the angular velocity in the axes of
            its body.
        dynamics: `DYNAMICS`, overwritten: M (n, n) kg·m², bias (n,) N·m, axes, placement.
    """
    # Rows of arrays are passed on: a record of arrays would be copied at every call.
    for i in range(3):
        dynamics.acceleration[0, i] = -bodies.gravity[i]
    turn(q, dynamics.cosine, dynamics.sine, q.shape[0])
    for i in range(1, bodies.kind.shape[0]):
        p, a, k = bodies.parent[i], bodies.first_v[i], bodies.first_q[i]
        x = dynamics.placement[i]
        _place(dynamics.placement[p], bodies.place[i], x)
        if bodies.kind[i] == ALIGNED:
            _turn_aligned(
                x, bodies.along[i], dynamics.cosine[k], dynamics.sine[k], dynamics.axes[a]
            )
            for c in range(6):
                dynamics.step[i, c] = dynamics.axes[a, c] * v[a]
        else:
            _turn_or_shift(
                bodies.kind[i], bodies.axis[i], q[k:], v[a:], x, dynamics.axes[a:], dynamics.step[i]
            )
        _move(
            dynamics.velocity[p],
            dynamics.acceleration[p],
            dynamics.step[i],
            dynamics.velocity[i],
            dynamics.acceleration[i],
        )
        _weigh(x, bodies.mass[i], bodies.centre[i], bodies.tensor[i], dynamics.inertia[i])
        _push(
            dynamics.inertia[i], dynamics.velocity[i], dynamics.acceleration[i], dynamics.force[i]
        )
        if bodies.carried[i] != 0.0:
            _carry(x, bodies.carried[i], bodies.carried_at[i], bodies.gravity, dynamics.force[i])
    for i in range(bodies.kind.shape[0] - 1, 0, -1):
        for a in range(bodies.first_v[i], bodies.first_v[i] + bodies.width[i]):
            dynamics.bias[a] = _dot(dynamics.axes[a], dynamics.force[i])
            if bodies.stiffness[a] != 0.0:
                stretched = q[bodies.first_q[i] + a - bodies.first_v[i]] - bodies.relaxed[a]
                dynamics.bias[a] += bodies.stiffness[a] * stretched
            _row(a, dynamics.inertia[i], dynamics.axes, bodies.before, dynamics.M)
            dynamics.M[a, a] += bodies.armature[a]
        p = bodies.parent[i]
        if p == 0:
            continue
        for c in range(6):
            dynamics.force[p, c] += dynamics.force[i, c]
        for c in range(10):
            dynamics.inertia[p, c] += dynamics.inertia[i, c]


@jit
def _place(p, place, x):
    """Placement x (12,) of a joint on the body at p (12,), before it turns, m."""
    for row in range(3):
        u, w, z = p[row], p[3 + row], p[6 + row]
        for c in range(0, 9, 3):
            x[c + row] = u * place[c] + w * place[c + 1] + z * place[c + 2]
        x[9 + row] = p[9 + row] + u * place[9] + w * place[10] + z * place[11]


@jit
def _turn_aligned(x, along, c, sine, s):
    """R ← R Rot(e, angle) about one of its own axes, and the motion axis s (6,)."""
    one, two = 3 * ((along + 1) % 3), 3 * ((along + 2) % 3)
    for row in range(3):
        u, w = x[one + row], x[two + row]
        x[one + row] = c * u + sine * w
        x[two + row] = c * w - sine * u
    _turning_axis(s, x, x[3 * along], x[3 * along + 1], x[3 * along + 2])


@jit
def _turn_or_shift(kind, axis, q, v, x, axes, step):
    """Placement of the body behind any other joint, its axes, and its own motion S v (6,)."""
    count = 1
    if kind == HINGE:
        sine = math.sin(0.5 * q[0])
        _turn(x, math.cos(0.5 * q[0]), sine * axis[0], sine * axis[1], sine * axis[2])
        u, w, z = _rotated(x, axis)
        _turning_axis(axes[0], x, u, w, z)
    elif kind == SLIDE:
        u, w, z = _rotated(x, axis)
        _shift(axes[0], x, u, w, z, q[0])
    elif kind == TRANSLATION:
        count = 3
        for c in range(3):
            _shift(axes[c], x, x[3 * c], x[3 * c + 1], x[3 * c + 2], q[c])
    else:
        count = 3
        scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        _turn(x, scale * q[0], scale * q[1], scale * q[2], scale * q[3])
        for c in range(3):
            _turning_axis(axes[c], x, x[3 * c], x[3 * c + 1], x[3 * c + 2])
    for i in range(6):
        step[i] = 0.0
        for a in range(count):
            step[i] += axes[a, i] * v[a]


@jit
def _rotated(x, axis):
    """R a with R in the placement ``x``."""
    return (
        x[0] * axis[0] + x[3] * axis[1] + x[6] * axis[2],
        x[1] * axis[0] + x[4] * axis[1] + x[7] * axis[2],
        x[2] * axis[0] + x[5] * axis[1] + x[8] * axis[2],
    )


@jit
def _turn(x, w, a, b, c):
    """R ← R Rot(w, a, b, c), a unit quaternion."""
    for row in range(3):
        u, v, z = x[row], x[3 + row], x[6 + row]
        x[row] = (
            u * (1.0 - 2.0 * (b * b + c * c))
            + v * (2.0 * (a * b + w * c))
            + z * (2.0 * (a * c - w * b))
        )
        x[3 + row] = (
            u * (2.0 * (a * b - w * c))
            + v * (1.0 - 2.0 * (a * a + c * c))
            + z * (2.0 * (b * c + w * a))
        )
        x[6 + row] = (
            u * (2.0 * (a * c + w * b))
            + v * (2.0 * (b * c - w * a))
            + z * (1.0 - 2.0 * (a * a + b * b))
        )


@jit
def _turning_axis(s, x, u, w, z):
    """Motion of a turn about the axis (u, w, z) through the origin of the placement ``x``."""
    s[0], s[1], s[2] = x[10] * z - x[11] * w, x[11] * u - x[9] * z, x[9] * w - x[10] * u
    s[3], s[4], s[5] = u, w, z


@jit
def _shift(s, x, u, w, z, way):
    """Motion along (u, w, z), after going ``way`` along it."""
    s[0], s[1], s[2] = u, w, z
    s[3], s[4], s[5] = 0.0, 0.0, 0.0
    x[9] += way * u
    x[10] += way * w
    x[11] += way * z


@jit
def _move(V, A, step, own, ahead):
    """Vᵢ = V_p + S v (6,), and its rate V_p × S v + A_p: the axes S move with the body."""
    v0, v1, v2, w0, w1, w2 = V[0], V[1], V[2], V[3], V[4], V[5]
    x0, x1, x2, r0, r1, r2 = step[0], step[1], step[2], step[3], step[4], step[5]
    own[0], own[1], own[2] = v0 + x0, v1 + x1, v2 + x2
    own[3], own[4], own[5] = w0 + r0, w1 + r1, w2 + r2
    ahead[0] = A[0] + w1 * x2 - w2 * x1 + v1 * r2 - v2 * r1
    ahead[1] = A[1] + w2 * x0 - w0 * x2 + v2 * r0 - v0 * r2
    ahead[2] = A[2] + w0 * x1 - w1 * x0 + v0 * r1 - v1 * r0
    ahead[3] = A[3] + w1 * r2 - w2 * r1
    ahead[4] = A[4] + w2 * r0 - w0 * r2
    ahead[5] = A[5] + w0 * r1 - w1 * r0


@jit
def _weigh(x, m, centre, t, Y):
    """Inertia Y (10,) of a body: R I Rᵀ + m (c·c 1 − c cᵀ), with c its centre of mass."""
    c0, c1, c2 = _rotated(x, centre)
    c0, c1, c2 = c0 + x[9], c1 + x[10], c2 + x[11]
    Y[MASS] = m
    Y[MOMENT], Y[MOMENT + 1], Y[MOMENT + 2] = m * c0, m * c1, m * c2
    # Columns of I Rᵀ, one per axis of the world.
    ax, ay, az = _tensor_times(t, x[0], x[3], x[6])
    bx, by, bz = _tensor_times(t, x[1], x[4], x[7])
    cx, cy, cz = _tensor_times(t, x[2], x[5], x[8])
    Y[TENSOR] = x[0] * ax + x[3] * ay + x[6] * az + m * (c1 * c1 + c2 * c2)
    Y[TENSOR + 1] = x[1] * ax + x[4] * ay + x[7] * az - m * c0 * c1
    Y[TENSOR + 2] = x[1] * bx + x[4] * by + x[7] * bz + m * (c0 * c0 + c2 * c2)
    Y[TENSOR + 3] = x[2] * ax + x[5] * ay + x[8] * az - m * c0 * c2
    Y[TENSOR + 4] = x[2] * bx + x[5] * by + x[8] * bz - m * c1 * c2
    Y[TENSOR + 5] = x[2] * cx + x[5] * cy + x[8] * cz + m * (c0 * c0 + c1 * c1)


@jit
def _tensor_times(t, x, y, z):
    """A symmetric matrix (xx, xy, yy, xz, yz, zz) times a vector."""
    return (
        t[0] * x + t[1] * y + t[3] * z,
        t[1] * x + t[2] * y + t[4] * z,
        t[3] * x + t[4] * y + t[5] * z,
    )


@jit
def _momentum(Y, s):
    """I s: m v + ω × h, and tensor ω + h × v, with h = m c."""
    m, h0, h1, h2 = Y[MASS], Y[MOMENT], Y[MOMENT + 1], Y[MOMENT + 2]
    v0, v1, v2, w0, w1, w2 = s[0], s[1], s[2], s[3], s[4], s[5]
    l0, l1, l2 = _tensor_times(Y[TENSOR:], w0, w1, w2)
    return (
        m * v0 + w1 * h2 - w2 * h1,
        m * v1 + w2 * h0 - w0 * h2,
        m * v2 + w0 * h1 - w1 * h0,
        l0 + h1 * v2 - h2 * v1,
        l1 + h2 * v0 - h0 * v2,
        l2 + h0 * v1 - h1 * v0,
    )


@jit
def _push(Y, V, A, f):
    """Force f (6,) that moves a body, N and N·m: I A + V ×* I V."""
    p0, p1, p2, l0, l1, l2 = _momentum(Y, V)
    f0, f1, f2, n0, n1, n2 = _momentum(Y, A)
    v0, v1, v2, w0, w1, w2 = V[0], V[1], V[2], V[3], V[4], V[5]
    f[0] = f0 + w1 * p2 - w2 * p1
    f[1] = f1 + w2 * p0 - w0 * p2
    f[2] = f2 + w0 * p1 - w1 * p0
    f[3] = n0 + w1 * l2 - w2 * l1 + v1 * p2 - v2 * p1
    f[4] = n1 + w2 * l0 - w0 * l2 + v2 * p0 - v0 * p2
    f[5] = n2 + w0 * l1 - w1 * l0 + v0 * p1 - v1 * p0


@jit
def _carry(x, m, at, g, f):
    """Take the weight of a mass m [kg] at its centre on the body off the force f (6,), N and N·m."""
    c0, c1, c2 = _rotated(x, at)
    c0, c1, c2 = c0 + x[9], c1 + x[10], c2 + x[11]
    w0, w1, w2 = m * g[0], m * g[1], m * g[2]
    f[0] += w0
    f[1] += w1
    f[2] += w2
    f[3] += c1 * w2 - c2 * w1
    f[4] += c2 * w0 - c0 * w2
    f[5] += c0 * w1 - c1 * w0


@jit
def _row(a, Y, axes, before, M):
    """Row a of the inertia, up to the diagonal: sᵦᵀ Y s_a for every b on the way to the base."""
    f0, f1, f2, n0, n1, n2 = _momentum(Y, axes[a])
    b = a
    while b >= 0:
        s = axes[b]
        total = s[0] * f0 + s[1] * f1 + s[2] * f2 + s[3] * n0 + s[4] * n1 + s[5] * n2
        M[a, b] = M[b, a] = total
        b = before[b]


@jit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
