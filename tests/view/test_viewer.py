"""A run that is watched is the same run, and outlives its page."""

import os
import signal
import subprocess
import sys
import time
import urllib.request
from threading import Event, Thread

import numpy as np
import pytest

from opspace.record import load
from opspace.scenario.build import build
from opspace.scenario.replay import replay
from opspace.scenario.run import SCENARIO, begin, late_tasks_of, recorded_levels, run_scenario
from opspace.scenario.watch import next_directory
from opspace.sim import simulate
from opspace.sim.requests import FILE, RunRequest
from opspace.view import Viewer
from tests.scenario.short import HOLD, short

pytestmark = pytest.mark.xdist_group("viewer")

DURATION = 0.6
GUEST = {"type": "joint", "joint": "joint3", "level": 1, "present": False}


def scenario():
    return short(duration=DURATION, tasks={**HOLD["tasks"], "guest": GUEST})


def watch(out, during=lambda viewer, address: None, **options):
    """Run the scenario with a page; ``during`` happens in another thread once it is open."""
    built = build(scenario())
    opened, address = Event(), []

    def tell(found):
        address.append(found)
        opened.set()

    viewer = Viewer(
        built.controller,
        out,
        {"dt": 0.001},
        tasks=late_tasks_of(built),
        levels=recorded_levels(built, everywhere=True),
        port=18080,
        opened=tell,
        **options,
    )

    def act():
        opened.wait()
        during(viewer, address[0])

    thread = Thread(target=act)
    thread.start()
    with viewer:
        begin(out, built.scenario)
        outcome = simulate(built.plant, built.controller, DURATION, [viewer])
        thread.join()
    return outcome


def test_a_watched_run_and_a_headless_one_give_the_same_recording(tmp_path):
    asked = [
        RunRequest("insert", ("guest",), level=0.5, duration=0.05),
        RunRequest("swap", ("orientation", "position"), duration=0.1),
        RunRequest("lead", ("position",), position=(0.4, 0.1, 0.5)),
        RunRequest("gain", ("posture",), kp=60.0, duration=0.1),
    ]

    def ask(viewer, address):
        for request in asked:
            viewer.ask(request)
            time.sleep(0.06)

    outcome = watch(tmp_path / "watched", ask)
    assert outcome.completed
    seen = load(tmp_path / "watched")
    assert len((tmp_path / "watched" / FILE).read_text().splitlines()) == len(asked)
    run_scenario(scenario(), tmp_path / "headless", requests=tmp_path / "watched" / FILE)
    found = load(tmp_path / "headless")
    assert found.names == seen.names
    np.testing.assert_array_equal(found.data, seen.data)
    # Without what was asked for it is another run.
    run_scenario(scenario(), tmp_path / "plain")
    assert np.abs(load(tmp_path / "plain").group("tau") - seen.group("tau")).max() > 0.1
    # And a fresh controller gives the same torques for the recorded states.
    again = replay(tmp_path / "headless")
    assert again.ticks == len(seen)
    assert again.gap == 0.0


def test_the_page_is_there_while_the_run_goes_on(tmp_path):
    found = {}

    def look(viewer, address):
        with urllib.request.urlopen(address, timeout=20.0) as answer:
            found["text"] = answer.read().decode()
        found["address"] = address

    watch(tmp_path / "run", look)
    assert found["address"].startswith("http://localhost:")
    assert "<html" in found["text"]


def test_a_run_does_not_mind_that_its_page_dies(tmp_path):
    def kill(viewer, address):
        os.kill(viewer._page._process.pid, signal.SIGKILL)

    assert watch(tmp_path / "run", kill).completed
    assert load(tmp_path / "run").ended.how == "completed"
    assert len(load(tmp_path / "run")) == round(DURATION / 0.001)


def command(*words, **options):
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    code = "from opspace.cli import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        **options,
    )


def lines_until(process, word):
    lines = []
    for line in process.stdout:
        lines.append(line)
        if word in line:
            return lines
    raise AssertionError("".join(lines) + process.stderr.read())


def test_the_command_says_where_the_page_is_and_leaves_a_recording(tmp_path):
    (tmp_path / "s.yaml").write_text(
        "robot: puma560\nduration: 0.1\ntasks:\n  position: {type: position, level: 0}\n"
        "  posture: {type: posture, level: 1}\n"
    )
    out = tmp_path / "run"
    words = ["view", str(tmp_path / "s.yaml"), "--start", "--duration", "0.3", "--port", "18180"]
    live = command(*words, "--out", str(out))
    lines = lines_until(live, "Ctrl-C closes")
    assert "http://localhost:18" in lines[0]
    assert any(str(out) in line for line in lines)
    live.send_signal(signal.SIGINT)
    _, problems = live.communicate(timeout=30.0)
    assert live.returncode == 0, problems
    assert len(load(out)) == 300
    assert "duration: 0.3" in (out / SCENARIO).read_text()

    recorded = command("view", str(out), "--port", "18280")
    assert "http://localhost:18" in lines_until(recorded, "open")[0]
    recorded.send_signal(signal.SIGINT)
    recorded.communicate(timeout=30.0)
    assert recorded.returncode == 0


def test_a_run_gets_a_directory_of_its_own(tmp_path):
    first = next_directory(tmp_path, "a")
    first.mkdir()
    assert [first.name, next_directory(tmp_path, "a").name] == ["a-1", "a-2"]
