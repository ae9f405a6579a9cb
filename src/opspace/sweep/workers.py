"""Processes that run rows; one that dies or hangs is replaced, and its run says so."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from opspace.errors import InputError
from opspace.plan.entries import KERNELS
from opspace.sweep.row import empty_row, run_row
from opspace.sweep.sweep_plan import SweepPlan

STARTING = 300.0
"""What a process may take until it begins with its first run, on a machine that is busy, s."""
POLL = 0.5
"""How often hanging processes are looked for, s."""
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass
class _Worker:
    process: BaseProcess
    pipe: Any
    index: int | None = None
    since: float = 0.0
    started: bool = False


def run_here(
    plan: SweepPlan, indices: Sequence[int], jobs: int, timeout: float
) -> Iterator[dict[str, Any]]:
    """Run rows in processes on this machine.

    Args:
        plan: The sweep.
        indices: Numbers of the runs.
        jobs: How many at a time.
        timeout: Time allowed to one run, s; it begins when its process is ready for it.

    Yields:
        Rows, in the order in which they are finished.

    Raises:
        InputError: A process ended before any could begin with its first run, as every one does that a
            script starts outside ``if __name__ == "__main__":``.
    """
    waiting = list(reversed(indices))
    workers = [_start(plan) for _ in range(min(jobs, len(waiting)))]
    begun = False
    try:
        for worker in workers:
            _assign(worker, waiting)
        while busy := [worker for worker in workers if worker.index is not None]:
            ready = wait([worker.pipe for worker in busy], POLL)
            for worker in busy:
                assert worker.index is not None
                if worker.pipe in ready:
                    row = _received(worker, plan)
                    if row is None:
                        worker.started, worker.since = True, time.monotonic()
                        begun = True
                        continue
                    if row["ended"] == "died" and not begun:
                        raise InputError(
                            f"a process of the sweep ended before its first run ({row['reason']}), see "
                            'above; a script runs a sweep below if __name__ == "__main__":'
                        )
                elif time.monotonic() - worker.since > timeout:
                    row = _lost(plan, worker.index, "timed out", f"after {timeout:g} s")
                    worker.process.kill()
                else:
                    continue
                yield row
                if row["ended"] in {"died", "timed out"}:
                    _stop(worker)
                    fresh = _start(plan)
                    worker.process, worker.pipe, worker.started = fresh.process, fresh.pipe, False
                _assign(worker, waiting)
    finally:
        for worker in workers:
            _stop(worker)


def _start(plan: SweepPlan) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(plan, there), daemon=True)
    process.start()
    there.close()
    return _Worker(process, here)


def _assign(worker: _Worker, waiting: list[int]) -> None:
    worker.index = waiting.pop() if waiting else None
    worker.since = time.monotonic() + (0.0 if worker.started else STARTING)
    if worker.index is not None:
        worker.pipe.send(worker.index)


def _received(worker: _Worker, plan: SweepPlan) -> dict[str, Any] | None:
    """Take a row from a process; None is its word that it is ready."""
    assert worker.index is not None
    try:
        return worker.pipe.recv()
    except (EOFError, ConnectionResetError):
        worker.process.join()
        code = worker.process.exitcode or 0
        how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return _lost(plan, worker.index, "died", how)


def _lost(plan: SweepPlan, index: int, ended: str, reason: str) -> dict[str, Any]:
    return {**empty_row(plan, index), "ended": ended, "reason": reason}


def _stop(worker: _Worker) -> None:
    worker.pipe.close()
    worker.process.join(POLL if worker.index is None else 0.0)
    worker.process.kill()
    worker.process.join()


def _serve(plan: SweepPlan, pipe: Connection) -> None:
    """Run the numbers that come until no more come."""
    # Ctrl-C is the parent's to handle; one core each.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in THREADS:
        os.environ[name] = "1"
    KERNELS.load()
    pipe.send(None)
    while True:
        try:
            index = pipe.recv()
        except EOFError:
            return
        row = run_row(plan, index)
        try:
            pipe.send(row)
        except BrokenPipeError:
            return
