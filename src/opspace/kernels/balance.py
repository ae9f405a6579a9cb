"""What the torque balances before any task acts: the bias, and the reactions that tasks expect."""

from __future__ import annotations

from opspace.kernels.columns import CARRIES, KEEP_TORQUE, TASK_BIAS
from opspace.kernels.compiled_scalars import room_for
from opspace.machine.jit import jit


@jit
def balance(work):
    """Count s Σ h_k g_k as bias, b + g + s Σ h_k g_k (`opspace.controller.stages.balance`).

    The middle of what the motors give is taken from it, and is in the torque again at the end of the
    tick. Reads bias (n,), torque (tasks, n) and h; writes reaction and balance (n,), N·m, and
    reaction_part (1,).
    """
    n = work.v.shape[0]
    work.reaction_part[0] = 1.0
    carries = False
    for a in range(n):
        work.balance[a], work.reaction[a] = work.bias[a] - work.torque_middle[a], 0.0
    for i in range(work.kind.shape[0]):
        if work.kind[i, CARRIES] != 0:
            carries = True
            for a in range(n):
                work.reaction[a] += work.h[i] * work.torque[i, a]
    if not carries:
        return
    if work.option[KEEP_TORQUE] != 0.0 and work.option[TASK_BIAS] == 0.0:
        start = work.space.start
        for a in range(n):
            start[a] = min(max(work.balance[a], -work.torque_limit[a]), work.torque_limit[a])
        work.reaction_part[0] = room_for(work.reaction, start, work.torque_limit)
    for a in range(n):
        work.reaction[a] *= work.reaction_part[0]
        work.balance[a] += work.reaction[a]
