"""How late this machine wakes a thread up that waits for its next cycle, and what would change that."""

from __future__ import annotations

import os
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from opspace.loop.real_time import RealTime
from opspace.tasks.validation import positive

PARTS = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}
"""What is told of latencies, by name."""


@dataclass(frozen=True)
class WakeUps:
    """How late a thread woke up.

    Attributes:
        late: (k,) s, from when it was to be woken to when it ran.
        refused: What the system did not permit.
    """

    late: np.ndarray
    refused: tuple[str, ...]

    def percentile(self, part: float) -> float:
        """Lateness that so many percent stay below, µs."""
        return float(1e6 * np.percentile(self.late, part))


def wake_ups(seconds: float, period: float, real_time: RealTime | None) -> WakeUps:
    """Wait for the next period again and again, in a thread of its own.

    Args:
        seconds: How long, s.
        period: s.
        real_time: What the system is asked for; None for nothing.

    Raises:
        InputError: A time that is none, or shorter than a period.
    """
    count = max(round(positive(seconds, "seconds") / positive(period, "the period")), 1)
    late, refused = np.zeros(count), []

    def wait() -> None:
        denied, give_back = ([], lambda: None) if real_time is None else real_time.take()
        refused.extend(denied)
        begun = time.perf_counter()
        for k in range(count):
            due = begun + (k + 1) * period
            time.sleep(max(due - time.perf_counter(), 0.0))
            late[k] = time.perf_counter() - due
            if late[k] > period:  # what was missed is not caught up
                begun = time.perf_counter() - (k + 1) * period
        give_back()

    thread = threading.Thread(target=wait, name="opspace doctor")
    thread.start()
    thread.join()
    return WakeUps(np.maximum(late, 0.0), tuple(refused))


def advice(root: Path = Path("/")) -> list[str]:
    """Tell what of this machine's settings makes threads wake up late, a sentence each.

    Args:
        root: Where the files of the system are.
    """
    found: list[str] = []
    if _content(root / "sys/kernel/realtime") != "1":
        found.append(
            "the kernel is not a real-time one (PREEMPT_RT); a driver in it may hold a core"
        )
    if not _content(root / "sys/devices/system/cpu/isolated"):
        found.append(
            "no core is isolated: isolcpus=3 on the kernel's command line keeps others off it"
        )
    governors = sorted((root / "sys/devices/system/cpu").glob("cpu*/cpufreq/scaling_governor"))
    if slow := {_content(path) for path in governors} - {"performance"}:
        found.append(
            f"cores save power (governor {', '.join(sorted(slow))}): set the governor performance"
        )
    runtime = _content(root / "proc/sys/kernel/sched_rt_runtime_us")
    if runtime not in ("", "-1"):
        found.append(
            f"real-time threads may run for {runtime} µs of each second in all: a loop that spins on "
            "its core is stopped then; sysctl kernel.sched_rt_runtime_us=-1"
        )
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        if os.environ.get(variable) != "1":
            found.append(f"{variable} is not 1: libraries start threads beside the loop")
    return found


def _content(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        return ""
