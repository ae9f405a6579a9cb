"""Does a page disturb the loop? Times of a tick without a page, with one, and while it is hammered."""

import os
import shutil
import signal
import time
from threading import Thread

import numpy as np
from playwright.sync_api import sync_playwright

import opspace as osc

SECONDS = 12.0
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

    def __init__(self, controller, directory, clock):
        self._recorder = osc.TickRecorder(directory, controller, {}, overwrite=True)
        self._clock = clock

    def observe(self, q, v, command):
        """See `opspace.Observer.observe`."""
        self._recorder.observe(q, v, command)
        self._clock.ticks.append((time.perf_counter(), time.perf_counter() - self._clock.begun))
        time.sleep(max(0.0, self._clock.begun + 1e-3 - time.perf_counter()))


def objects():
    """Make a controller, a plant and a clock."""
    robot = osc.load_robot("puma560")
    tasks = [osc.OrientationTask(), osc.PositionTask(max_speed=0.5), osc.PostureTask()]
    controller = osc.Controller(robot, osc.Stack(tasks))
    return controller, osc.Plant(robot, robot.q_reference), Clock(controller)


def alone():
    """Run without a page."""
    controller, plant, clock = objects()
    osc.simulate(plant, clock, SECONDS, [Alone(controller, "results/timing/alone", clock)])
    return [duration for _, duration in clock.ticks]


def watched():
    """Run with a page; a browser comes, asks for a hundred things at once, and is killed."""
    controller, plant, clock = objects()
    elbow, marks = osc.JointTask("joint3", name="elbow"), {}
    viewer = Timed(controller, "results/timing/watched", tasks=[elbow], overwrite=True, port=18800)
    viewer.clock = clock
    process = viewer._page._process
    os.sched_setaffinity(process.pid, {1})

    def visit():
        os.sched_setaffinity(0, {1})  # this thread, and the browser that it starts
        time.sleep(4.0)
        with sync_playwright() as playwright:
            marks["browser"] = time.perf_counter()
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=list(FLAGS)
            )
            page = browser.new_page()
            page.set_default_timeout(120_000)
            page.goto(viewer._page.address)
            page.wait_for_selector("[data-opspace-task]")
            time.sleep(3.0)
            marks["requests"] = time.perf_counter()
            assert page.evaluate(CLICKS) == 2
            time.sleep(4.0)
            marks["closed"] = time.perf_counter()
            page.close()
            browser.close()
        time.sleep(4.0)
        marks["end"] = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)

    os.sched_setaffinity(0, {0})
    Thread(target=visit, daemon=True).start()
    try:
        with viewer:
            osc.simulate(plant, clock, 600.0, [viewer])
    except KeyboardInterrupt:
        pass
    times = np.array(clock.ticks)
    edges = [times[0, 0], *(marks[key] for key in ("browser", "requests", "closed", "end"))]
    names = ("page, no browser", "browser opens and shows", "100 requests at once", "tab closed")
    return {
        name: times[(times[:, 0] >= a) & (times[:, 0] < b), 1]
        for name, a, b in zip(names, edges, edges[1:], strict=False)
    }


def main() -> None:
    """Print a table in Markdown."""
    os.sched_setaffinity(0, {0})
    phases = {"no page": np.array(alone()), **watched()}
    print("| phase | ticks | p50 [µs] | p99 [µs] | max [µs] |\n| --- | ---: | ---: | ---: | ---: |")
    for name, found in phases.items():
        micro = 1e6 * found
        p50, p99 = np.percentile(micro, [50, 99])
        print(f"| {name} | {len(found)} | {p50:.0f} | {p99:.0f} | {micro.max():.0f} |")


if __name__ == "__main__":
    main()
