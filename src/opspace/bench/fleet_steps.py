"""How many robots a second `Fleet.step` gets through."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from opspace.bench.scenes import SCENES
from opspace.errors import MissingExtraError
from opspace.fleet import Fleet
from opspace.stack import Stack
from opspace.tasks import JointLimits

FLEET_HEADS = ("scene", "device", "numbers", "robots", "ticks/s", "µs a robot")
COUNTS = (1, 64, 4096)
TURNS = 5
"""Turns of each number of robots; the median counts."""


def fleet_steps(
    counts: Sequence[int] = COUNTS, dtypes: Sequence[str] = ("float64", "float32")
) -> list[tuple[str, ...]]:
    """Time fleets on the processor, one core.

    Args:
        counts: Numbers of robots.
        dtypes: Types of numbers.

    Returns:
        Rows for `FLEET_HEADS`.

    Raises:
        MissingExtraError: Warp is not installed.
    """
    name = "panda"
    try:
        robot = SCENES[name].robot()
    except MissingExtraError:
        name = "puma"
        robot = SCENES[name].robot()
    scene, rows = SCENES[name], []
    Q, V = scene.states(robot)
    for dtype in dtypes:
        for count in counts:
            stack = Stack([list(level) for level in scene.levels()], limits=JointLimits())
            fleet = Fleet(scene.robot(), stack, count, device="cpu", dtype=dtype)
            q, v = (np.resize(x, (count, x.shape[1])).astype(dtype) for x in (Q, V))
            fleet.step(0.0, q, v)  # compiles, and holds what it finds
            seconds = []
            for k in range(TURNS):
                start = perf_counter()
                fleet.step(1e-3 * (k + 1), q, v)
                seconds.append(perf_counter() - start)
            rate = count / float(np.median(seconds))
            rows.append((name, "cpu", dtype, str(count), f"{rate:,.0f}", f"{1e6 / rate:.3g}"))
    return rows
