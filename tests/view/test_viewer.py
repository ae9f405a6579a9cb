"""A run that is watched is the same run, and outlives its page."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from opspace.cli import main
from opspace.errors import OpspaceError
from opspace.loop import simulate
from opspace.loop.requests import FILE, RunRequest
from opspace.record import Column, Recorder, load
from opspace.runs.replay_run import replay
from opspace.runs.run import SCENARIO, begin, late_tasks_of, recorded_levels, run_scenario
from opspace.runs.watch import next_directory
from opspace.scenario.build import build
from opspace.view import Viewer
from tests.scenario.short import HOLD, short
from tests.view.command import started

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


def test_a_run_that_was_paused_goes_on_when_its_page_dies(tmp_path):
    def pause_and_kill(viewer, address):
        viewer._pacing.pause()
        time.sleep(0.1)
        os.kill(viewer._page._process.pid, signal.SIGKILL)

    assert watch(tmp_path / "run", pause_and_kill).completed


def test_a_page_that_does_not_read_delays_nothing(tmp_path):
    def stop(viewer, address):
        os.kill(viewer._page._process.pid, signal.SIGSTOP)
        for _ in range(3000):
            viewer.ask(RunRequest("remove", ("nobody",)))

    assert watch(tmp_path / "run", stop).completed


ODD = [
    {},
    {"control": "speed", "value": "fast"},
    {"control": "speed", "value": 1e-300},
    {"control": "dance"},
    {"request": 5},
    {"request": None},
    {"request": {"kind": "lead", "tasks": [["position"]], "position": [1e300, 0.0, 0.0]}},
]


def test_nothing_that_a_page_says_hurts(tmp_path):
    def say(viewer, address):
        for message in ODD:
            viewer._page._take(json.dumps(message))
        viewer._page._take('{"half')
        viewer._page._take(json.dumps({"request": {"kind": "remove", "tasks": ["posture"]}}))

    assert watch(tmp_path / "run", say).completed
    # The last one was heard: whoever listens is still there.
    assert len((tmp_path / "run" / FILE).read_text().splitlines()) == 1


def test_a_page_leaves_with_a_run_that_is_killed(tmp_path):
    """Also before the first tick, when there is nothing to show yet."""
    program = (
        "import os, signal, opspace as osc\n"
        "robot = osc.load_robot('puma560')\n"
        "controller = osc.Controller(robot, osc.Stack([osc.PostureTask()]))\n"
        f"viewer = osc.Viewer(controller, {str(tmp_path / 'run')!r}, port=18380)\n"
        "print(viewer._page._process.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=False, stdout=subprocess.PIPE, text=True
    )
    page = int(done.stdout.split()[-1])
    end = time.monotonic() + 30.0
    while (
        Path(f"/proc/{page}/stat").exists() and " Z " not in Path(f"/proc/{page}/stat").read_text()
    ):
        assert time.monotonic() < end, "an orphan"
        time.sleep(0.1)


def test_a_page_that_cannot_be_shown_says_why(tmp_path):
    with pytest.raises(OpspaceError, match=r"cannot be shown: \w*Error: ."):
        watch(tmp_path / "run", host="300.1.1.1")
    assert load(tmp_path / "run").ended.how == "crashed"


def test_a_recording_without_a_tick_is_refused(tmp_path, capsys):
    with Recorder(tmp_path / "run", [Column("t", "s")], {}):
        pass
    with pytest.raises(SystemExit) as end:
        main(["view", str(tmp_path / "run")])
    assert end.value.code == 2
    assert "without a tick" in capsys.readouterr().err


def command(*words):
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return started(*words, stderr=subprocess.PIPE, env=environment)


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
