"""The kernels that Python calls; any other is called by these."""

from __future__ import annotations

import numpy as np

from opspace.machine.answer_call import AnswerParts
from opspace.machine.kernel_entry import KernelEntry
from opspace.machine.library import Library
from opspace.plan.integral_records import INTEGRALS
from opspace.plan.quiet_records import QUIET
from opspace.plan.records import CYCLES, SPECTRUM, STATES, TICK

ENTRIES = (
    KernelEntry("opspace.kernels.tick", "tick", (float, TICK), gives=int),
    KernelEntry(
        "opspace.kernels.quiet_tick",
        "quiet_tick",
        (float, np.ndarray, np.ndarray, QUIET, TICK),
        gives=AnswerParts,
    ),
    KernelEntry(
        "opspace.kernels.many_states", "ticks", (float, TICK, STATES, int, int), releases=True
    ),
    KernelEntry("opspace.kernels.cycles", "cycles", (TICK, CYCLES), gives=int, releases=True),
    KernelEntry("opspace.kernels.spectrum", "spectrum", (SPECTRUM,)),
    KernelEntry("opspace.kernels.gravity", "gravity", (TICK,)),
    KernelEntry("opspace.kernels.integrals", "learn", (TICK, INTEGRALS, int)),
)

KERNELS = Library(__name__, ENTRIES)
