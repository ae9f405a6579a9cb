"""Have everything compiled before the first tick, and say so where it was not yet."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from opspace.kernels.columns import OPTION_SIZE
from opspace.kernels.many_states import ticks
from opspace.kernels.spectrum import spectrum
from opspace.kernels.tick import tick
from opspace.machine.compile_apart import Calls, compile_apart
from opspace.machine.field_table import Record
from opspace.machine.kept_code import can_be_kept, is_kept
from opspace.machine.record import Handle
from opspace.plan.memory import Sizes, make_tick
from opspace.plan.records import REMEMBERED
from opspace.robots.bodies import RIGID_BODIES, make_dynamics
from opspace.robots.joint_kinds import ALIGNED
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.payload import Masses
from opspace.robots.rigid_model import RigidModel

log = logging.getLogger("opspace")

ESTIMATE = "one to three minutes"
"""How long it takes, measured on a shared core: 90 s alone, 170 s beside others."""


def compiled_tick() -> float:
    """Compile the tick or read it from the disk; immediate when that has happened already.

    Returns:
        How long it took, s.
    """
    return 0.0 if tick.signatures else ready("the control tick", first_tick)


def tick_entry() -> Callable[[float, Handle], int]:
    """Return the compiled tick, to be called with the types that it was compiled for.

    Numba looks at the types of all arguments first, which takes as long as a tenth of a tick.
    """
    (compiled,) = tick.overloads.values()
    return compiled.entry_point


def compiled_batch() -> float:
    """Compile the tick for many states or read it from the disk; immediate when that has happened.

    Returns:
        How long it took, s.
    """
    return 0.0 if ticks.signatures else ready("the control tick for many states", first_batch)


def first_tick() -> list[tuple[Any, tuple[Any, ...]]]:
    """Return what is called to have the tick and its report compiled."""
    return [
        (tick, (0.0, _smallest(_axes()))),
        (spectrum, (np.ones((1, 1)), np.zeros(OPTION_SIZE))),
    ]


def first_batch() -> list[tuple[Any, tuple[Any, ...]]]:
    """Return what is called to have the tick for many states compiled."""
    bodies = _one_body()
    state = np.zeros((1, 1))
    axes = RigidModel(bodies, {}, Masses((), {})).motion_axes(
        make_dynamics(bodies), np.zeros(1), np.zeros(1)
    )
    before = REMEMBERED.make({"variables": 0, "tasks": 0}).handle()
    smallest = _smallest(axes)
    return [(ticks, (0.0, smallest, before, state, state, np.ones((1, 0)), 0, 1, state.copy()))]


def ready(what: str, calls: Calls) -> float:
    """Call compiled functions for the first time, and say so when they must be compiled.

    Args:
        what: What they are together, for the announcement.
        calls: Gives them with their arguments; can be imported by its name.

    Returns:
        How long it took, s.
    """
    start = time.perf_counter()
    found = calls()
    new = not _all_kept(found)
    if new and all(can_be_kept(compiled) for compiled, _ in found):
        log.warning("compiling %s, once after each installation: %s", what, ESTIMATE)
        compile_apart(calls)
    elif new:
        log.warning(
            "compiling %s, as every start will: no directory for it can be written, and "
            "NUMBA_CACHE_DIR may name one; %s",
            what,
            ESTIMATE,
        )
    for compiled, arguments in found:
        compiled(*arguments)
    seconds = time.perf_counter() - start
    if new:
        after = "; it is kept for the next start" if _all_kept(found) else ""
        log.warning("compiled %s in %.0f s%s", what, seconds, after)
    return seconds


def _all_kept(calls: list[tuple[Any, tuple[Any, ...]]]) -> bool:
    return all(is_kept(compiled, arguments) for compiled, arguments in calls)


def _axes() -> MotionAxes:
    """Make the arrays of a robot with one joint."""
    return MotionAxes(
        q=np.zeros(1),
        v=np.zeros(1),
        M=np.ones((1, 1)),
        bias=np.zeros(1),
        axes=np.zeros((1, 6)),
        placement=np.zeros((1, 12)),
        parent=np.array([-1]),
        frames={},
        masses=Masses((), {}),
    )


def _one_body() -> Record:
    """Make a body of one kilogram behind one hinge."""
    bodies = RIGID_BODIES.make({"bodies": 2, "n": 1})
    bodies.kind[:] = ALIGNED
    bodies.place[:, [0, 4, 8]] = 1.0
    bodies.axis[:, 2] = 1.0
    bodies.along[:] = 2
    bodies.width[1] = 1
    bodies.mass[:] = 1.0
    bodies.tensor[:] = 1.0
    bodies.before[:] = -1
    return bodies


def _smallest(axes: MotionAxes) -> Handle:
    """Make the arrays of a tick for one joint and no task."""
    size = Sizes(
        n=1, tasks=0, rows=0, slot_rows=0, slots=0, levels=0, variables=0, limits=0, corners=1
    )
    return make_tick(size, axes, np.ones(1), np.zeros(OPTION_SIZE))[0].handle()
