"""Torque against gravity alone, for robots that add it themselves."""

from __future__ import annotations

from opspace.kernels.dynamics import evaluate
from opspace.machine.jit import jit


@jit
def gravity(work):
    """The bias at rest, g, without the springs at the joints.

    Args:
        work: `opspace.plan.records.TICK`; reads q and bodies, writes gravity (n,) N·m.
    """
    bodies, later = work.bodies, work.later
    for a in range(work.later_v.shape[0]):
        work.later_v[a] = 0.0
    evaluate(bodies, work.q, work.later_v, later)
    for i in range(1, bodies.kind.shape[0]):
        for a in range(bodies.first_v[i], bodies.first_v[i] + bodies.width[i]):
            work.gravity[a] = later.bias[a]
            if bodies.stiffness[a] != 0.0:
                stretched = work.q[bodies.first_q[i] + a - bodies.first_v[i]] - bodies.relaxed[a]
                work.gravity[a] -= bodies.stiffness[a] * stretched
