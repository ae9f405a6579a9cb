"""Dynamics that others have computed, in the language of kernels: what takes the place of our own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from opspace.kernels.dynamics import evaluate
from opspace.kernels.motion import A, P, R, V, measure, move_joints


def leave_dynamics(bodies, q, v, dynamics):
    """Compute nothing: inertia and bias have been given."""


def leave_joints(work):
    """Compute nothing: what tasks control has been given."""


def given_motion(work, i):
    """Motion that task i controls as it was given, where `opspace.kernels.motion.measure` puts it."""
    pose, x, J = work.robot.pose[i], work.motion[0], work.motion_J[0]
    for c in range(3):
        x[P + c] = pose[c]
    w, a, b, c = pose[3], pose[4], pose[5], pose[6]
    scale = 1.0 / math.sqrt(w * w + a * a + b * b + c * c)
    w, a, b, c = scale * w, scale * a, scale * b, scale * c
    x[R], x[R + 4], x[R + 8] = (
        1.0 - 2.0 * (b * b + c * c),
        1.0 - 2.0 * (a * a + c * c),
        1.0 - 2.0 * (a * a + b * b),
    )
    x[R + 1], x[R + 3] = 2.0 * (a * b - w * c), 2.0 * (a * b + w * c)
    x[R + 2], x[R + 6] = 2.0 * (a * c + w * b), 2.0 * (a * c - w * b)
    x[R + 5], x[R + 7] = 2.0 * (b * c - w * a), 2.0 * (b * c + w * a)
    for row in range(6):
        x[A + row] = work.robot.drift[i, row]
        rate = 0.0
        for k in range(work.v.shape[0]):
            J[row, k] = work.robot.jacobian[i, row, k]
            rate += J[row, k] * work.v[k]
        x[V + row] = rate


INSTEAD: Mapping[Callable[..., Any], Callable[..., Any]] = {
    evaluate: leave_dynamics,
    move_joints: leave_joints,
    measure: given_motion,
}
"""What is called where dynamics are given, by what is called otherwise."""
