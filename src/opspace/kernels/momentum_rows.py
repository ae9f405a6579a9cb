"""How much a robot as a whole turns: rows of its angular momentum about its centre of mass."""

from __future__ import annotations

from opspace.kernels.columns import BODY, FIRST_ROW
from opspace.kernels.dynamics import MASS, MOMENT
from opspace.kernels.stance_columns import BASE_SIZE
from opspace.machine.jit import jit


@jit
def momentum_task(work, i):
    """Fill the rows of task i: J = R M[3:6] − [c − p]× M[:3], and its drift from the bias.

    Gravity turns nothing about the centre of mass, but weight that is carried for the robot does.
    See `opspace.tasks.AngularMomentumTask`.
    """
    bodies, dynamics, n = work.bodies, work.dynamics, work.v.shape[0]
    first, base = work.kind[i, FIRST_ROW], work.kind[i, BODY]
    x, whole = work.placement[base], dynamics.inertia[base]
    c0, c1, c2 = (
        whole[MOMENT] / whole[MASS],
        whole[MOMENT + 1] / whole[MASS],
        whole[MOMENT + 2] / whole[MASS],
    )
    for a in range(n + 1):
        # The column of the bias comes last.
        m0, m1, m2 = _entry(work, 0, a), _entry(work, 1, a), _entry(work, 2, a)
        e0, e1, e2 = c0 - x[9], c1 - x[10], c2 - x[11]
        r0, r1, r2 = e1 * m2 - e2 * m1, e2 * m0 - e0 * m2, e0 * m1 - e1 * m0
        for row in range(3):
            turned = -(r0 if row == 0 else r1 if row == 1 else r2)
            for c in range(3):
                turned += x[3 * c + row] * _entry(work, 3 + c, a)
            if a < n:
                work.J[first + row, a] = turned
            else:
                work.drift[first + row] = turned
    for j in range(1, bodies.kind.shape[0]):
        if bodies.carried[j] != 0.0:
            _leave_out(work, first, j, c0, c1, c2)
    for row in range(first, first + BASE_SIZE // 2):
        rate = 0.0
        for a in range(n):
            rate += work.J[row, a] * work.v[a]
        work.error[row] = 0.0
        work.wanted[row] = -work.kv[row] * rate


@jit
def _entry(work, row, a):
    """Entry of the base's rows of the inertia, or of the bias where the column is beyond it."""
    return work.M[row, a] if a < work.v.shape[0] else work.bias[row]


@jit
def _leave_out(work, first, j, c0, c1, c2):
    """Take the moment of the weight that is carried on body j about the centre of mass off the drift."""
    x, at, g = work.placement[j], work.bodies.carried_at[j], work.bodies.gravity
    mass = work.bodies.carried[j]
    e0 = x[9] + x[0] * at[0] + x[3] * at[1] + x[6] * at[2] - c0
    e1 = x[10] + x[1] * at[0] + x[4] * at[1] + x[7] * at[2] - c1
    e2 = x[11] + x[2] * at[0] + x[5] * at[1] + x[8] * at[2] - c2
    work.drift[first] -= mass * (e1 * g[2] - e2 * g[1])
    work.drift[first + 1] -= mass * (e2 * g[0] - e0 * g[2])
    work.drift[first + 2] -= mass * (e0 * g[1] - e1 * g[0])
