"""Have everything compiled before the first tick, and say so when it takes long."""

from __future__ import annotations

import logging
import time
from threading import Timer

import numpy as np

from opspace.controller.compiled.layout import OPTION_SIZE, Tick, tick_handle
from opspace.controller.compiled.memory import Sizes, make_tick
from opspace.controller.compiled.report import spectrum
from opspace.controller.compiled.tick import tick
from opspace.law.compiled.space import space_handle
from opspace.robots.motion_axes import MotionAxes

log = logging.getLogger("opspace")

PATIENCE = 2.0
"""Reading compiled code from the disk takes less than this, s."""


def compiled_tick() -> float:
    """Compile the tick or read it from the disk; immediate when that has happened already.

    Returns:
        How long it took, s.
    """
    if tick.signatures:
        return 0.0
    start = time.perf_counter()
    announcement = Timer(PATIENCE, _announce)
    announcement.daemon = True
    announcement.start()
    try:
        tick(0.0, tick_handle(*_smallest()))
        spectrum(np.ones((1, 1)), np.zeros(1, np.int64), np.ones((1, 1)), 1, np.zeros(OPTION_SIZE))
    finally:
        announcement.cancel()
    seconds = time.perf_counter() - start
    if sum(tick.stats.cache_misses.values()):
        log.warning("compiled the control tick in %.0f s; it is kept for the next start", seconds)
    return seconds


def _announce() -> None:
    log.warning("compiling the control tick, once after each installation: about half a minute")


def _smallest() -> tuple[Tick, object]:
    """Make the arrays of a robot with one joint and no task."""
    axes = MotionAxes(
        q=np.zeros(1),
        v=np.zeros(1),
        M=np.ones((1, 1)),
        bias=np.zeros(1),
        axes=np.zeros((1, 6)),
        placement=np.zeros((1, 12)),
        parent=np.array([-1]),
        frames={},
        masses=(),
    )
    size = Sizes(n=1, tasks=0, rows=0, slots=0, levels=0, variables=0, limits=0, corners=1)
    memory, space, _ = make_tick(size, axes, np.ones(1), np.zeros(OPTION_SIZE))
    return memory, space_handle(space)
