"""Worst-case time of the controller over many ticks: what the machine, the collector and we add.

Run it alone on a quiet machine: ``python docs/evidence/latency.py --ticks 1000000 [--paced]``.
"""

import argparse
import gc
import json
import os
import resource
import time

import numpy as np

from opspace import JointTask
from opspace.bench import SCENES

PERIOD = 1e-3


def measure(ticks, *, paced, collector):
    """Time every tick of the Panda scene, µs; the collector on, frozen or off."""
    scene = SCENES["panda"]
    controller = scene.controller()
    q, v = scene.states(controller.robot)
    states = list(zip(q, v, strict=True))
    for k in range(2000):
        controller.step(0.0, *states[k % len(states)])
    gc.collect()
    if collector == "frozen":
        gc.freeze()
    elif collector == "off":
        gc.disable()
    found = np.zeros(ticks)
    collections = gc.get_stats()[0]["collections"]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    due = time.perf_counter()
    for k in range(ticks):
        state = states[k % len(states)]
        if paced:
            due += PERIOD
            time.sleep(max(0.0, due - time.perf_counter()))
        start = time.perf_counter_ns()
        controller.step(0.0, *state)
        found[k] = time.perf_counter_ns() - start
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    gc.unfreeze()
    gc.enable()
    p50, p99, p999 = np.percentile(found * 1e-3, (50, 99, 99.9))
    return {
        "ticks": ticks,
        "paced": paced,
        "collector": collector,
        "p50": round(float(p50), 2),
        "p99": round(float(p99), 2),
        "p99.9": round(float(p999), 2),
        "max": round(float(found.max()) * 1e-3, 1),
        "above_200": int(np.sum(found > 200e3)),
        "collections": gc.get_stats()[0]["collections"] - collections,
        "resident_MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "grown_kB": grown,
    }


def changes(count):
    """Time the ticks at which a transition begins or ends, µs: they lay out the stack anew."""
    scene = SCENES["panda"]
    controller = scene.controller()
    q, v = scene.states(controller.robot)
    guest = JointTask("panda_joint4", name="guest")
    controller.stack.prepare(guest)
    found = []
    for k in range(100 * count):
        if k % 100 == 0:
            present = guest in list(controller.stack)
            ask = controller.stack.remove if present else controller.stack.insert
            ask(guest, **({} if present else {"level": 0.5}), duration=0.05)
        start = time.perf_counter_ns()
        controller.step(1e-3 * k, q[k % len(q)], v[k % len(q)])
        if k > 100 and k % 50 < 2:
            found.append(time.perf_counter_ns() - start)
    begun = np.array(found) * 1e-3
    laid_out = begun[begun > 100.0]
    p50, p99 = np.percentile(laid_out, (50, 99))
    return {
        "transitions": count,
        "laid_out": len(laid_out),
        "p50": round(float(p50)),
        "p99": round(float(p99)),
        "max": round(float(begun.max())),
    }


def main():
    """Measure with the collector on, frozen and off; then the ticks at which something changes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=1_000_000)
    parser.add_argument("--paced", action="store_true", help="one tick a millisecond")
    parser.add_argument("--core", type=int, default=0)
    options = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {options.core})
    for collector in ("on", "frozen", "off"):
        print(json.dumps(measure(options.ticks, paced=options.paced, collector=collector)))
    print(json.dumps(changes(min(options.ticks, 500))))


if __name__ == "__main__":
    main()
