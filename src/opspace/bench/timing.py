"""Time functions side by side."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from time import perf_counter_ns
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from opspace.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from opspace.bench.subjects import Tick


class TimesItself(NamedTuple):
    """A subject that times its ticks itself, outside of Python.

    Attributes:
        block: Takes (states, n) configurations and velocities, and fills (count,) durations, µs.
    """

    block: Callable[[np.ndarray, np.ndarray, np.ndarray], None]


BLOCK = 500
"""Ticks of one subject before the next one has its turn: clocks change, and all must feel it."""


@contextmanager
def pinned(core: int | None) -> Iterator[None]:
    """Run on one core, where the system lets us.

    Raises:
        InputError: There is no such core.
    """
    if core is None or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    if core not in before:
        raise InputError(f"there is no core {core} to use (valid: {sorted(before)})")
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def interleaved(
    ticks: Mapping[str, Tick | TimesItself],
    q: np.ndarray,
    v: np.ndarray,
    count: int,
) -> dict[str, np.ndarray]:
    """Time every subject tick by tick, in turns of `BLOCK`.

    Args:
        ticks: Subjects by name.
        q: (states, n) configurations that are gone through.
        v: (states, n) velocities.
        count: Ticks of each.

    Returns:
        By name (count,) durations, µs.
    """
    q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
    states = list(zip(q, v, strict=True))

    def block(tick: Tick | TimesItself, into: np.ndarray) -> None:
        if isinstance(tick, TimesItself):
            tick.block(q, v, into)
        else:
            _block(tick, states, into)

    found = {name: np.zeros(count) for name in ticks}
    for tick in ticks.values():
        block(tick, np.zeros(BLOCK))
    gc.collect()
    for start in range(0, count, BLOCK):
        end = min(start + BLOCK, count)
        for name, tick in ticks.items():
            block(tick, found[name][start:end])
    return found


def slowest_state(times: np.ndarray, states: int) -> float:
    """Give the quickest tick of the state whose quickest tick is the slowest, µs.

    Args:
        times: (count,) durations of one subject, as `interleaved` gives them.
        states: Number of states.
    """
    state = np.arange(times.size) % BLOCK % states
    return max(float(times[state == k].min()) for k in np.unique(state))


def _block(tick: Tick, states: list[tuple[np.ndarray, np.ndarray]], into: np.ndarray) -> None:
    many = len(states)
    durations = [0] * into.size
    for i in range(into.size):
        q, v = states[i % many]
        start = perf_counter_ns()
        tick(q, v)
        durations[i] = perf_counter_ns() - start
    into[:] = np.array(durations) * 1e-3
