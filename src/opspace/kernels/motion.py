"""Motion of frames from the joints' motion axes: placement, velocity, Jacobian and drift."""

from __future__ import annotations

from opspace.kernels.columns import (
    BASE,
    BODY,
    CENTRE_OF_MASS,
    JOINT,
    LOCAL,
    OFFSET,
    OTHER_BODY,
    OTHER_JOINT,
    OTHER_LOCAL,
    RELATIVE,
    SOURCE,
    TOOL_AXES,
)
from opspace.kernels.stance_columns import BASE_SIZE
from opspace.kernels.whole_vectors import add, fill, put_products, whole
from opspace.machine.jit import jit

# Columns of Tick.motion: rotation by rows, position, velocity, drift.
R, P, V, A = 0, 9, 12, 18


@jit
def cross_add(out, i, ax, ay, az, bx, by, bz):
    """Add a × b to out[i:i + 3]."""
    out[i] += ay * bz - az * by
    out[i + 1] += az * bx - ax * bz
    out[i + 2] += ax * by - ay * bx


@jit
def move_joints(work):
    """Velocity and drift (n, 6) of every body, seen at the origin of the world, where its last joint is.

    The axes of the joints go by components into across (6, n).
    """
    if work.bodies.kind.shape[0] > 0:
        _take_motion(work)
    else:
        _compute_motion(work)
    for j in range(work.v.shape[0]):
        for i in range(6):
            work.across[i, j] = work.axes[j, i]


@jit
def _take_motion(work):
    """The dynamics know both: gravity, which they count as an acceleration, is taken off again."""
    bodies, velocity, acceleration = work.bodies, work.velocity, work.acceleration
    for i in range(1, bodies.kind.shape[0]):
        j = bodies.first_v[i] + bodies.width[i] - 1
        for c in range(6):
            velocity[j, c] = work.dynamics.velocity[i, c]
            acceleration[j, c] = work.dynamics.acceleration[i, c]
        for c in range(3):
            acceleration[j, c] += bodies.gravity[c]


@jit
def _compute_motion(work):
    """V_j = V_parent + s_j v_j,  A_j = A_parent + (V_j × s_j) v_j: an axis s_j moves with its body.

    The three axes about which a floating base turns all move with the base.
    """
    axes, velocity, acceleration = work.axes, work.velocity, work.acceleration
    for j in range(work.v.shape[0]):
        p = work.parent[j]
        rate = work.v[j]
        for i in range(6):
            velocity[j, i] = axes[j, i] * rate
            acceleration[j, i] = 0.0
            if p >= 0:
                velocity[j, i] += velocity[p, i]
        vx, vy, vz = velocity[j, 0] * rate, velocity[j, 1] * rate, velocity[j, 2] * rate
        wx, wy, wz = velocity[j, 3] * rate, velocity[j, 4] * rate, velocity[j, 5] * rate
        lx, ly, lz = axes[j, 0], axes[j, 1], axes[j, 2]
        rx, ry, rz = axes[j, 3], axes[j, 4], axes[j, 5]
        a = acceleration[j]
        cross_add(a, 0, wx, wy, wz, lx, ly, lz)
        cross_add(a, 0, vx, vy, vz, rx, ry, rz)
        cross_add(a, 3, wx, wy, wz, rx, ry, rz)
        if p >= 0:
            for i in range(6):
                a[i] += acceleration[p, i]
        if j == BASE_SIZE - 1 and work.option[BASE] != 0.0:
            _move_base(work)


@jit
def _move_base(work):
    """Drift of a floating base: the point of it at the origin of the world moves and turns, v × ω."""
    A, V = work.acceleration[BASE_SIZE - 1], work.velocity[BASE_SIZE - 1]
    before = work.velocity[2]
    for i in range(6):
        A[i] = 0.0
    cross_add(A, 0, before[0], before[1], before[2], V[3], V[4], V[5])


@jit
def place_frame(work, i, m, body, joint, local, offset):
    """Motion of a frame of task i into row m of ``motion`` (3, 24): x, ẋ = J v, J̇ v in world axes."""
    place_point(work, work.numbers[i], m, body, joint, local, offset)


@jit
def place_point(work, number, m, body, joint, local, offset):
    """Motion of a point that some numbers describe, as those of a task do."""
    x = work.motion[m]
    for row in range(3):
        for column in range(3):
            total = number[local + 3 * column + row]
            if body >= 0:
                total = 0.0
                for c in range(3):
                    total += work.placement[body, 3 * c + row] * number[local + 3 * column + c]
            x[R + 3 * row + column] = total
        total = number[local + 9 + row]
        if body >= 0:
            total = work.placement[body, 9 + row]
            for c in range(3):
                total += work.placement[body, 3 * c + row] * number[local + 9 + c]
        x[P + row] = total
    if offset:
        for row in range(3):
            for c in range(3):
                x[P + row] += x[R + 3 * row + c] * number[OFFSET + c]
    _rates(work, m, joint, x)
    _jacobian(work, m, joint, x)


@jit
def _rates(work, m, joint, x):
    """Velocity v_O + ω × p, and drift a_O + α × p + ω × velocity, of the point p of a body."""
    for i in range(6):
        x[V + i] = work.velocity[joint, i] if joint >= 0 else 0.0
        x[A + i] = work.acceleration[joint, i] if joint >= 0 else 0.0
    px, py, pz = x[P], x[P + 1], x[P + 2]
    wx, wy, wz = x[V + 3], x[V + 4], x[V + 5]
    cross_add(x, V, wx, wy, wz, px, py, pz)
    cross_add(x, A, x[A + 3], x[A + 4], x[A + 5], px, py, pz)
    cross_add(x, A, wx, wy, wz, x[V], x[V + 1], x[V + 2])


@jit
def _jacobian(work, m, joint, x):
    """Jacobian of the point p of a body: ω × p + v of each axis that carries it."""
    J, across, end = work.motion_J[m], work.across, whole(work.v.shape[0])
    if joint < 0:
        for i in range(6):
            fill(0.0, J[i], 0, end)
        return
    for i in range(6):
        put_products(work.carried_by[joint], across[i], J[i], 0, end)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        add(x[P + k], J[3 + j], J[i], 0, end)
        add(-x[P + j], J[3 + k], J[i], 0, end)


@jit
def measure(work, i):
    """Motion that task i controls, into row 0 of ``motion``, with its Jacobian ``motion_J[0]`` (6, n).

    `opspace.tasks.motions` has the readable form.
    """
    kind = work.kind[i]
    if kind[SOURCE] == CENTRE_OF_MASS:
        _centre_of_mass(work)
        return
    if kind[SOURCE] != RELATIVE:
        place_frame(work, i, 0, kind[BODY], kind[JOINT], LOCAL, True)
        return
    place_frame(work, i, 1, kind[BODY], kind[JOINT], LOCAL, False)
    place_frame(work, i, 2, kind[OTHER_BODY], kind[OTHER_JOINT], OTHER_LOCAL, False)
    _relative(work)


@jit
def selected(work, i, row, c):
    """Entry c of what a row of task i selects of a motion: S, or S Rᵀ for axes of the tool."""
    if work.kind[i, TOOL_AXES] == 0:
        return work.select[row, c]
    x, base, factor = work.motion[0], 3 * (c // 3), 0.0
    for axis in range(3):
        factor += work.select[row, base + axis] * x[R + 3 * (c - base) + axis]
    return factor


@jit
def _relative(work):
    """Row 1 seen from row 2, in the axes of row 2: see `opspace.tasks.motions.RelativeFrame`."""
    out, f, r = work.motion[0], work.motion[1], work.motion[2]
    dx, dy, dz = f[P] - r[P], f[P + 1] - r[P + 1], f[P + 2] - r[P + 2]
    wx, wy, wz = r[V + 3], r[V + 4], r[V + 5]
    for i in range(6):
        out[V + i] = f[V + i] - r[V + i]
        out[A + i] = f[A + i] - r[A + i]
    ux, uy, uz = out[V], out[V + 1], out[V + 2]
    cross_add(out, V, -wx, -wy, -wz, dx, dy, dz)
    cross_add(out, A, -r[A + 3], -r[A + 4], -r[A + 5], dx, dy, dz)
    cross_add(out, A, -wx, -wy, -wz, ux + out[V], uy + out[V + 1], uz + out[V + 2])
    cross_add(out, A + 3, -wx, -wy, -wz, f[V + 3], f[V + 4], f[V + 5])
    J, Jf, Jr = work.motion_J[0], work.motion_J[1], work.motion_J[2]
    for a in range(work.v.shape[0]):
        for i in range(6):
            J[i, a] = Jf[i, a] - Jr[i, a]
        J[0, a] -= Jr[4, a] * dz - Jr[5, a] * dy
        J[1, a] -= Jr[5, a] * dx - Jr[3, a] * dz
        J[2, a] -= Jr[3, a] * dy - Jr[4, a] * dx
        _turn_back(r, J[:, a], 0)
        _turn_back(r, J[:, a], 3)
    out[P], out[P + 1], out[P + 2] = dx, dy, dz
    for block in (P, V, V + 3, A, A + 3):
        _turn_back(r, out, block)
    for row in range(3):
        for column in range(3):
            total = 0.0
            for c in range(3):
                total += r[R + 3 * c + row] * f[R + 3 * c + column]
            out[R + 3 * row + column] = total


@jit
def _turn_back(r, x, i):
    """x[i:i + 3] ← Rᵀ x[i:i + 3] with R in ``r``."""
    a, b, c = x[i], x[i + 1], x[i + 2]
    for row in range(3):
        x[i + row] = r[R + row] * a + r[R + 3 + row] * b + r[R + 6 + row] * c


@jit
def _centre_of_mass(work):
    """X = Σ mᵢ cᵢ / Σ mᵢ and its rates, linear rows only."""
    out, J, part = work.motion[0], work.motion_J[0], work.motion[1]
    n = work.v.shape[0]
    for i in range(out.shape[0]):
        out[i] = 0.0
    for i in range(3):
        out[R + 4 * i] = 1.0
        for a in range(n):
            J[i, a] = 0.0
    total = 0.0
    for link in range(work.mass.shape[0]):
        total += work.mass[link, 0]
    for link in range(work.mass.shape[0]):
        body, joint = work.mass_place[link, 0], work.mass_place[link, 1]
        weight = work.mass[link, 0] / total
        for row in range(3):
            part[P + row] = work.placement[body, 9 + row]
            for c in range(3):
                part[P + row] += work.placement[body, 3 * c + row] * work.mass[link, 1 + c]
        _rates(work, 1, joint, part)
        _jacobian(work, 1, joint, part)
        for i in range(3):
            out[P + i] += weight * part[P + i]
            out[V + i] += weight * part[V + i]
            out[A + i] += weight * part[A + i]
            for a in range(n):
                J[i, a] += weight * work.motion_J[1, i, a]
