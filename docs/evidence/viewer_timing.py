"""Does a page disturb the loop? Times of a tick without a page, with one, and while it is hammered."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from subprocess import PIPE
from threading import Thread

import numpy as np
from playwright.sync_api import sync_playwright

import opspace as osc
from opspace.loop.requests import FILE, Changes, RequestPlayer, RunRequest

SECONDS = 12.0
WATCHED = "results/timing/watched"
PHASES = (
    "page, no browser",
    "browser opens and shows",
    "100 clicks",
    "tab closed",
    "100 requests at the same moment",
)
BUSY = "import numpy as np\nx = np.zeros(4_000_000)\nwhile True: x += 1.0"
FLAGS = ("--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
CLICKS = """async () => { const buttons = [...document.querySelectorAll('button')];
const wanted = buttons.filter(b => ['Insert', 'Remove'].includes(b.innerText.trim()));
for (let i = 0; i < 100; i++) {
  wanted[i % wanted.length].click(); await new Promise(done => setTimeout(done, 0)); }
return wanted.length; }"""


class Clock:
    """Times every tick, sleeping left out, and tells how late the ticks are."""

    def __init__(self, controller):
        self.controller, self.robot = controller, controller.robot
        self.ticks, self.begun = [], 0.0

    def step(self, t, q, v):
        """See `opspace.Controller.step`."""
        self.begun = time.perf_counter()
        return self.controller.step(t, q, v)


class Timed(osc.Viewer):
    """A viewer that notes when it begins to wait."""

    clock = None

    def observe(self, q, v, command):
        """See `opspace.Observer.observe`."""
        self._recorder.observe(q, v, command)
        self._desk.observe(q, v, command)
        self.clock.ticks.append((time.perf_counter(), time.perf_counter() - self.clock.begun))
        self._pacing.observe(q, v, command)


class Alone:
    """The same without a page."""

    def __init__(self, controller, directory, clock, player=None):
        self._recorder = osc.TickRecorder(directory, controller, {}, overwrite=True)
        self._clock, self._player = clock, player

    def observe(self, q, v, command):
        """See `opspace.Observer.observe`."""
        self._recorder.observe(q, v, command)
        if self._player is not None:
            self._player.observe(q, v, command)
        self._clock.ticks.append((time.perf_counter(), time.perf_counter() - self._clock.begun))
        time.sleep(max(0.0, self._clock.begun + 1e-3 - time.perf_counter()))


def objects():
    """Make a controller, a plant and a clock."""
    robot = osc.load_robot("puma560")
    tasks = [osc.OrientationTask(), osc.PositionTask(max_speed=0.5), osc.PostureTask()]
    controller = osc.Controller(robot, osc.Stack(tasks))
    controller.warm_up()
    return controller, osc.Plant(robot, robot.q_reference), Clock(controller)


def elbow():
    """Make the task that the page may insert."""
    return osc.JointTask("joint3", name="elbow")


def alone(ticks, requests=None):
    """Run without a page; with requests, ask for what was asked for on one at the same ticks."""
    controller, plant, clock = objects()
    player = None
    if requests is not None:
        player = RequestPlayer(Changes(controller, [*controller.stack, elbow()]), requests)
    watching = Alone(controller, "results/timing/alone", clock, player)
    osc.simulate(plant, clock, 1e-3 * ticks, [watching])
    return np.array([duration for _, duration in clock.ticks])


def visit(address):
    """Come with a browser, ask for a hundred things at once, leave; print when, s."""
    marks = []
    time.sleep(4.0)
    with sync_playwright() as playwright:
        marks.append(time.perf_counter())
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        page = browser.new_page()
        page.set_default_timeout(120_000)
        page.goto(address)
        page.wait_for_selector("[data-opspace-task]")
        time.sleep(3.0)
        marks.append(time.perf_counter())
        assert page.evaluate(CLICKS) == 2
        time.sleep(4.0)
        marks.append(time.perf_counter())
        page.close()
        browser.close()
    time.sleep(4.0)
    print(json.dumps([*marks, time.perf_counter()]), flush=True)


def watched():
    """Run with a page until the visitor has gone; times of the ticks, and where phases begin."""
    controller, plant, clock = objects()
    viewer = Timed(controller, WATCHED, tasks=[elbow()], overwrite=True, port=18800)
    viewer.clock = clock
    for thread in os.listdir(f"/proc/{viewer._page._process.pid}/task"):
        os.sched_setaffinity(int(thread), {1})
    marks = []

    def wait():
        command = ["taskset", "-c", "1", sys.executable, __file__, viewer._page.address]
        marks.extend(json.loads(subprocess.run(command, stdout=PIPE, check=True).stdout))
        for k in range(100):
            kind = ("insert", "remove")[k % 2]
            level = 1.0 if kind == "insert" else None
            viewer.ask(RunRequest(kind, tasks=("elbow",), level=level, duration=0.1))
        time.sleep(1.0)
        marks.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    Thread(target=wait, daemon=True).start()
    try:
        with viewer:
            osc.simulate(plant, clock, 600.0, [viewer])
    except KeyboardInterrupt:
        pass
    times = np.array(clock.ticks)
    return times[:, 1], [0, *np.searchsorted(times[:, 0], marks).tolist()]


def main() -> None:
    """Print a table in Markdown."""
    os.sched_setaffinity(0, {0})
    phases = {"no page": alone(int(1e3 * SECONDS))}
    times, edges = watched()
    phases |= {name: times[a:b] for name, (a, b) in zip(PHASES, pairwise(edges), strict=True)}
    during = slice(*edges[2:4])
    phases["the same clicks, no page"] = alone(len(times), Path(WATCHED) / FILE)[during]
    with subprocess.Popen(["taskset", "-c", "1", sys.executable, "-c", BUSY]) as busy:
        found = alone(len(times), Path(WATCHED) / FILE)[during]
        busy.kill()
    phases["the same clicks, no page, the other core busy"] = found
    print("| phase | ticks | p50 [µs] | p99 [µs] | max [µs] |\n| --- | ---: | ---: | ---: | ---: |")
    for name, found in phases.items():
        micro = 1e6 * found
        p50, p99 = np.percentile(micro, [50, 99])
        print(f"| {name} | {len(found)} | {p50:.0f} | {p99:.0f} | {micro.max():.0f} |")


if __name__ == "__main__":
    visit(sys.argv[1]) if len(sys.argv) > 1 else main()
