"""How long a robot waits for its command, beside threads that keep the interpreter busy.

``python docs/evidence/loop_latency.py [SECONDS]`` prints the table of docs/performance.md. A process
stands for the robot: every millisecond it shows a state in shared memory and looks at when the answer
is there. The loop runs in this process, beside a thread that does nothing, computes, or holds the
interpreter's lock for 300 ms again and again.
"""

from __future__ import annotations

import ctypes
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import opspace as osc
from opspace.drivers.shared_memory import SharedMemoryDriver, SharedRobotSide
from opspace.loop.wake_up import wake_ups

ROBOT = "panda"
PERIOD = 1e-3
BEGINNING = 1.0
HOLD = 0.3


def robot(path: str) -> None:
    """Show states until nobody drives any more, then print how long each answer took, s."""
    model = osc.load_robot(ROBOT)
    side = SharedRobotSide(path, model.nq, model.nv)
    osc.RealTime(quiet_collector=False).take()
    print("there", flush=True)
    waited, k, due = [], 0, time.perf_counter()
    accepted = np.full(model.nv, np.nan)
    driven = False
    while (side.braked and not driven) or not side.braked:
        driven |= not side.braked
        k += 1
        begun = time.perf_counter()
        side.tell(osc.RobotState(k * PERIOD, model.q_reference, np.zeros(model.nv), accepted))
        answer = None
        while driven and answer is None and not side.braked and time.perf_counter() < begun + 2.0:
            time.sleep(5e-6)
            answer = side.commands()
        if answer is not None:
            waited.append(time.perf_counter() - begun)
            accepted = answer
        due = max(due + PERIOD, time.perf_counter())
        time.sleep(max(due - time.perf_counter(), 0.0))
    side.close()
    print(json.dumps(waited))


def nothing(over: threading.Event) -> None:
    """Let the loop alone."""
    over.wait()


def compute(over: threading.Event) -> None:
    """Compute in Python without an end."""
    while not over.is_set():
        sum(range(1000))


def hold(over: threading.Event) -> None:
    """Hold the interpreter's lock, as an extension does that never lets it go."""
    usleep = ctypes.PyDLL(None).usleep
    while not over.wait(0.02):
        usleep(round(1e6 * HOLD))


def controller() -> osc.Controller:
    """Make what is ticked."""
    model = osc.load_robot(ROBOT)
    tasks = [osc.OrientationTask(), osc.PositionTask(), osc.PostureTask()]
    stack = osc.Stack(tasks, limits=osc.JointLimits())
    return osc.Controller(
        model, stack, gravity="robot", torque_limits="priority", period=PERIOD, on_time_jump="hold"
    )


def waited_for(
    compiled: bool, beside: Callable[[threading.Event], None], seconds: float
) -> np.ndarray:
    """Run a loop; give how long each answer took once it was under way, µs."""
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        path = Path(folder) / "robot"
        words = [sys.executable, __file__, "--robot", str(path)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            process.stdout.readline()
            facts = osc.DriverFacts(PERIOD, gravity="robot")
            made = controller()
            driver = SharedMemoryDriver(path, nq=made.robot.nq, n=made.robot.nv, facts=facts)
            real_time = osc.RealTime()
            loop = osc.Loop(
                made,
                driver,
                patience=5000,
                handover=0.1,
                stop_on=osc.Status.FAULT,
                real_time=real_time,
                compiled=compiled,
            )
            over = threading.Event()
            with loop:
                loop.wait(BEGINNING)
                first = loop.report.counts.cycles
                thread = threading.Thread(target=beside, args=(over,))
                thread.start()
                loop.wait(seconds)
                last = loop.report.counts.cycles
                over.set()
                thread.join()
            waited = json.loads(process.stdout.read())
    return 1e6 * np.array(waited[first:last])


def main(seconds: float) -> None:
    """Print the table."""
    bare = wake_ups(seconds, PERIOD, osc.RealTime())
    late = [bare.percentile(part) for part in (50.0, 99.0, 99.9, 100.0)]
    print(f"| a timer alone | – | {' | '.join(f'{x:.0f}' for x in late)} |", flush=True)
    for beside in (nothing, compute, hold):
        for compiled in (False, True):
            found = waited_for(compiled, beside, seconds)
            told = " | ".join(f"{np.percentile(found, p):.0f}" for p in (50.0, 99.0, 99.9, 100.0))
            kind = "compiled" if compiled else "Python"
            print(f"| {kind} | {beside.__name__} | {told} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--robot"]:
        robot(sys.argv[2])
    else:
        main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
