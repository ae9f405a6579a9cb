"""How many states a second `Controller.torque_batch` gets through."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from opspace.bench.scenes import Scene
from opspace.controller import Controller
from opspace.controller.batch import cores

TURNS = 7
"""Turns of each number of threads; the median counts."""


def states_per_second(scene: Scene, count: int) -> dict[str, float]:
    """Time batches of a scene on one core and on all of them, in turns.

    Args:
        scene: The scene.
        count: States of a batch.

    Returns:
        States per second by the number of threads.
    """
    controller = scene.controller()
    assert isinstance(controller, Controller)
    Q, V = (np.resize(x, (count, x.shape[1])) for x in scene.states(controller.robot))
    # What has no target holds where it is.
    controller.step(scene.time, Q[0], V[0], wrenches=scene.wrenches)
    numbers = sorted({1, cores()})
    times = {threads: np.zeros(TURNS) for threads in numbers}
    for turn in range(-1, TURNS):  # one before the first builds what there is to build
        for threads in numbers:
            start = perf_counter()
            controller.torque_batch(Q, V, scene.time, threads=threads)
            if turn >= 0:
                times[threads][turn] = perf_counter() - start
    return {str(threads): count / float(np.median(x)) for threads, x in times.items()}
