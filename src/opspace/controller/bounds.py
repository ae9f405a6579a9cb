"""The last line behind joint limits: no joint accelerates more than it may."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from opspace.command import Status
from opspace.controller.limit_task_sets import LimitTerms
from opspace.law import BROKEN, LOST, excess, nearest_acceleration


def nearest_torque(
    terms: Sequence[LimitTerms],
    M: np.ndarray,
    bias: np.ndarray,
    tau: np.ndarray,
    torque_limit: np.ndarray | None,
) -> tuple[np.ndarray, Status]:
    """Replace a torque by the nearest one with which no joint accelerates more than it may.

    The limits' task sets see to that already, unless several push each other or the motors give
    too little; here all of them are met at once, by `opspace.law.nearest_acceleration`.

    Args:
        terms: The limits of this tick, mode ``admissible``.
        M: (n, n) inertia.
        bias: (n,) Coriolis, centrifugal and gravity torque, N·m.
        tau: (n,) torque, N·m.
        torque_limit: (n,) what the motors give, N·m; None where they are not asked.

    Returns:
        The torque, and what happened.
    """
    lower, upper = np.full(tau.size, -np.inf), np.full(tau.size, np.inf)
    for term in terms:
        if term.side.sign > 0.0:
            upper[term.side.index] = term.command
        else:
            lower[term.side.index] = -term.command
    acceleration = np.linalg.solve(M, tau - bias)
    if not excess(acceleration, lower, upper) > BROKEN:
        return tau, Status.OK
    room = np.full(tau.size, np.inf) if torque_limit is None else torque_limit
    L = np.linalg.cholesky(M)
    nearest = nearest_acceleration(L, acceleration, lower, upper, -room - bias, room - bias)
    tau = np.clip(M @ nearest + bias, -room, room)
    lost = excess(nearest, lower, upper) > LOST
    return tau, Status.FILTERED | (Status.LIMIT_LOST if lost else Status.OK)
