"""A quiet tick with a plan as one call, from the state to the command."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from opspace.command import Command, Status
from opspace.kernels.columns import SOLVE
from opspace.machine.answer_call import SPARE, AnswerParts, flags_of
from opspace.machine.record import Handle, address_of
from opspace.plan.entries import KERNELS
from opspace.plan.plan import Plan
from opspace.plan.read_report import CompiledReport


class QuietCall:
    """Everything that such a call needs, kept as long as this is.

    Attributes:
        tick: A function (t, q, v, address) that returns the command, or None where Python is to look
            first what there is.
        address: Its last argument.

    Args:
        plan: The plan.
        quiet: A `opspace.plan.quiet_records.QUIET`.
        statuses: What happened, by its number.
    """

    __slots__ = ("_addresses", "_answer", "_handles", "_spare", "address", "tick")

    def __init__(self, plan: Plan, quiet: Handle, statuses: Mapping[int, Status]) -> None:
        self._handles = quiet, plan.handle
        self._spare = [plan.tick.tau.copy() for _ in range(SPARE)]
        self._addresses = (ctypes.c_void_p * SPARE)(*map(id, self._spare))
        self._answer = AnswerParts(
            base=SOLVE,
            block=address_of(plan.memory),
            size=plan.memory.nbytes,
            copy=plan.tick.tau.copy,
            spare=ctypes.addressof(self._addresses),
            source=address_of(plan.tick.tau),
            length=plan.tick.tau.size,
            flags=flags_of(self._spare[0]),
            names=statuses,
            usual=statuses[0],
            kind=Command,
            report=CompiledReport,
            made_with=plan,
            rest=(),
            array=np.ndarray,
            number=float,
            double=np.dtype(float),
            first=quiet.address,
            second=plan.handle.address,
        )
        self.tick: Callable[..., Any] = KERNELS["quiet_tick"]
        self.address = ctypes.addressof(self._answer)
