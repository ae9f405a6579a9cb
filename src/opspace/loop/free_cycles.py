"""Cycles that need no interpreter, for as long as nothing asks for it."""

from __future__ import annotations

import time
from dataclasses import fields
from typing import NamedTuple, Protocol, cast, runtime_checkable

import numpy as np

from opspace.controller import Controller, ReferenceController
from opspace.controller.free_ticks import Letters, check_free, free_plan
from opspace.controller.watchdog import JUMP, MISSED
from opspace.errors import InputError
from opspace.kernels import cycle_columns as c
from opspace.loop.driver import DriverFacts, RobotState
from opspace.loop.history import History
from opspace.loop.loop_report import Counts
from opspace.machine.field_table import Record
from opspace.plan.cycle_records import CYCLES
from opspace.plan.entries import KERNELS
from opspace.plan.plan import Plan


class SharedWords(NamedTuple):
    """Memory that driver and robot share, as compiled cycles see it.

    Attributes:
        wanted: (1,) what they want of each other.
        state: (2 + 1 + nq + 2n,) a number that is odd while somebody writes; the words of t, q, v and
            the accepted torque; their sum.
        command: (2 + n,) the same with the words of a command.
        fault: What a robot that has braked writes into ``wanted``.
        nap: For how long a wait sleeps between two looks, ns; 0 looks all the time.
    """

    wanted: np.ndarray
    state: np.ndarray
    command: np.ndarray
    fault: int
    nap: int


@runtime_checkable
class SharedDriver(Protocol):
    """A driver whose robot shares memory with it."""

    @property
    def seen(self) -> int:
        """First word of the last state that was read."""
        ...

    @seen.setter
    def seen(self, value: int) -> None: ...

    def shared(self) -> SharedWords:
        """Return the memory, after `Driver.start`."""
        ...


class FreeCycles:
    """Runs cycles in compiled code, with the interpreter's lock released.

    One thread runs them; another one `tends` them: it sends on what users change, and asks for Python
    where a change needs it. What that takes is laid out by the second one, so that the first need not.

    Args:
        controller: The controller.
        driver: The robot.
        history: Where cycles are remembered.
        facts: What the robot does by itself.
        patience: How long a silent robot is waited for, s.
        stop_on: Statuses that end the loop, as a number.
        step: (n,) the most by which a command may differ from the one accepted, N·m; inf for any.

    Raises:
        InputError: Ticks of this controller need Python, or the robot shares no memory.
    """

    def __init__(
        self,
        controller: ReferenceController,
        driver: object,
        history: History,
        facts: DriverFacts,
        patience: float,
        stop_on: int,
        step: np.ndarray,
    ) -> None:
        check_free(controller)
        if not isinstance(driver, SharedDriver):
            raise InputError(
                "cycles without Python need a robot behind shared memory; "
                f"{type(driver).__name__} is none"
            )
        self._controller = cast(Controller, controller)
        self._driver, self._history, self._facts = driver, history, facts
        self._patience, self._stop_on, self._step = patience, stop_on, step
        self._ready: tuple[Plan, Letters, Record, int] | None = None
        self._count = np.zeros(c.COUNTS, np.int64)
        self._runs = False

    @property
    def counts(self) -> Counts:
        """What the cycles that go on now have counted."""
        return Counts(*self._count.tolist())

    @property
    def last(self) -> float | None:
        """Time of the last state while cycles go on, s."""
        return self._ready[2].number[c.LAST].item() if self._runs and self._ready else None

    def ready(self) -> bool:
        """Whether the next cycle can be without Python."""
        return self._ready is not None and self._ready[0] is free_plan(self._controller)

    def ask(self) -> None:
        """Have the cycles end after the present one; from any thread."""
        ready = self._ready
        if ready is not None:
            ready[2].asked[0] = 1

    def tend(self) -> None:
        """Lay out what is needed next, send on what has changed; for a thread that is not the loop's."""
        ready = self._ready
        if not self._runs:
            plan = free_plan(self._controller)
            if plan is not None and (ready is None or ready[0] is not plan):
                self._lay_out(plan)
            return
        assert ready is not None
        plan, letters, record, _ = ready
        stack = self._controller.stack
        if not stack.settled or stack.waiting:
            record.asked[0] = 1
        elif letters.changed and record.mail[0] == record.mail[1]:
            number = record.mail[0].item() + 1
            if not letters.write(number):
                record.asked[0] = 1
                return
            for name, array in letters.arrays().items():
                getattr(record, name)[:] = array
            time.sleep(0.0)  # what was written is seen before this word is
            record.mail[0] = number

    def run(self, last: RobotState, heard: float, sent: np.ndarray, ends: float) -> int:
        """Run cycles until something needs Python; for the loop's thread.

        Args:
            last: The last state.
            heard: When it came, s of `time.perf_counter`.
            sent: (n,) the last command, N·m.
            ends: Time of the states at which to end, s.

        Returns:
            Why it has ended, see `opspace.kernels.cycle_columns`.
        """
        assert self._ready is not None
        plan, letters, record, address = self._ready
        record.whole[c.SEEN] = self._driver.seen
        record.whole[[c.FROZEN_FOR, c.STATUSES]] = 0
        record.number[[c.LAST, c.HEARD, c.ENDS]] = last.t, heard, ends
        record.before[:] = sent
        record.asked[0] = 0
        record.mail[1] = record.mail[0]  # what has not been taken by now Python has taken up
        letters.begin(record.mail[0].item())
        self._runs = True
        try:
            return KERNELS["cycles"](plan.handle.address, address)
        finally:
            self._runs = False
            letters.hand_back(record.mail[1].item())
            self._driver.seen = int(record.whole[c.SEEN])
            # The tick of Python that comes next is none of those before.
            if self._controller._timing is not None:
                self._controller._timing.forget()

    def gather(self, counts: Counts) -> tuple[RobotState, float, np.ndarray, int]:
        """Add what was counted, and start anew.

        Returns:
            The last state, when it came, the last command (n,), and every status there was.
        """
        assert self._ready is not None
        record = self._ready[2]
        for field, more in zip(fields(counts), self._count.tolist(), strict=True):
            setattr(counts, field.name, getattr(counts, field.name) + more)
        self._count[:] = 0
        t, heard = record.number[[c.LAST, c.HEARD]].tolist()
        robot = self._controller.robot
        state = RobotState(t, np.array(robot.q), np.array(robot.v))
        return state, heard, record.before.copy(), int(record.whole[c.STATUSES])

    def _lay_out(self, plan: Plan) -> None:
        memory, n = self._driver.shared(), plan.n
        read, tau = np.zeros(memory.state.size - 2), np.zeros(n)
        moment = np.zeros(4, np.int64)
        sizes = {"n": n, "nq": plan.tick.q.size, "tasks": plan.size.tasks, "rows": plan.size.rows}
        sizes |= {"told": read.size, "ring": len(self._history.rows)}
        sizes |= {"led": plan.size.led, "led_rows": plan.size.led_rows}
        given = {
            "wanted": memory.wanted,
            "state": memory.state,
            "command": memory.command,
            "read": read,
            "read_words": read.view(np.int64),
            "tau": tau,
            "tau_words": tau.view(np.int64),
            "step": self._step,
            "count": self._count,
            "time": moment,
            "ring": self._history.rows,
            "whole": self._history.whole,
        }
        record = CYCLES.make(sizes, given)
        start = moment.__array_interface__["data"][0]
        record.address[:] = start, start + moment[:2].nbytes
        whole = {c.CLOCK: time.CLOCK_MONOTONIC, c.NAP: memory.nap, c.FAULT: memory.fault}
        whole |= {c.ADDS: int(self._facts.gravity == "robot"), c.STOP_ON: self._stop_on}
        for place, value in whole.items():
            record.whole[place] = value
        period = self._facts.period
        numbers = {c.PERIOD: period, c.PATIENCE: self._patience}
        numbers |= {c.LATE_AFTER: MISSED * period, c.JUMP_AFTER: JUMP * period}
        for place, value in numbers.items():
            record.number[place] = value
        handle = record.handle()
        letters = Letters(self._controller, plan)
        self._handle = handle  # whoever reads the address keeps the words
        self._ready = plan, letters, record, handle.address
