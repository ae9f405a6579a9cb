"""A black box: what it keeps, when it writes, and that a failure shows itself again."""

import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from tests.scenario.short import short

import opspace as osc
from opspace import Status
from opspace.cli import main
from opspace.errors import InputError, RecordingError
from opspace.record.black_box import MOST
from opspace.runs.replay_run import replay
from opspace.scenario.build import build

ROBOT = osc.load_robot("puma560")
REST = np.zeros(6)
TOO_FAST = np.full(6, 1e200)
EVENTS = [{"at": 0.02, "swap": ["orientation", "position"], "duration": 0.1}]


def arm():
    tool = osc.PositionTask(target=[0.7, 0.3, 0.4])
    return osc.Controller(ROBOT, osc.Stack([tool, osc.PostureTask()]))


def drive(box, ticks, start=0):
    for i in range(start, start + ticks):
        box.step(0.001 * i, ROBOT.q_reference + 0.001 * np.sin(i), REST + 0.01 * np.cos(i))


def only(box):
    box.wait()
    (path,) = box.written
    return osc.load(path)


def break_off(built, box, ticks, wrong):
    """Run a scenario whose last tick brings a velocity that cannot be."""
    plant = built.plant
    for i in range(ticks):
        plant.advance(box.step(i * plant.dt, *plant.measure()).tau)
    return box.step(ticks * plant.dt, plant.q, wrong)


def test_it_answers_what_the_controller_answers(tmp_path):
    one, other = osc.BlackBox(arm(), tmp_path, ticks=10), arm()
    for i in range(25):
        state = 0.001 * i, ROBOT.q_reference + 0.01 * i, REST + 0.1
        ours, theirs = one.step(*state), other.step(*state)
        assert np.array_equal(ours.tau, theirs.tau)
        assert ours.status == theirs.status
    assert one.written == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("before", [0, 3, 7, 8, 29])
def test_the_last_ticks_are_written_the_failing_one_last(tmp_path, before):
    box = osc.BlackBox(arm(), tmp_path, ticks=8)
    drive(box, before)
    command = box.step(1.0, ROBOT.q_reference, TOO_FAST)
    assert command.status == Status.FAULT
    found = only(box)
    kept = min(before, 7)
    assert len(found) == kept + 1
    times = [*(0.001 * np.arange(before - kept, before)), 1.0]
    assert found.t.tolist() == pytest.approx(times, abs=0.0)
    for i in range(before - kept, before):
        row = i - (before - kept)
        assert np.array_equal(found.group("q")[row], ROBOT.q_reference + 0.001 * np.sin(i))
        assert np.array_equal(found.group("v")[row], REST + 0.01 * np.cos(i))
    assert np.array_equal(found.group("v")[-1], TOO_FAST)
    assert np.array_equal(found.group("tau")[-1], command.tau)
    assert found["status"][-1] == Status.FAULT
    assert (found.ended.how, found.ended.reason) == ("stopped", "FAULT")
    if before:
        assert found.header["tasks"]["position"]["activation"] == 1.0


def test_a_tick_that_raises_raises_and_is_written(tmp_path):
    box = osc.BlackBox(arm(), tmp_path)
    drive(box, 5)
    with pytest.raises(InputError, match="joint2"):
        box.step(0.005, ROBOT.q_reference, np.array([0.0, np.nan, 0, 0, 0, 0]))
    found = only(box)
    assert len(found) == 6
    assert np.isnan(found["v/joint2"][-1])
    assert np.isnan(found.group("tau")[-1]).all()
    assert found.ended.how == "crashed"
    assert found.ended.reason.startswith("InputError: velocity of joint 'joint2'")
    again = osc.replay(found, arm())
    assert again.gap == 0.0
    assert again.repeated


def test_a_state_of_another_size_is_written_as_far_as_it_fits(tmp_path):
    box = osc.BlackBox(arm(), tmp_path)
    with pytest.raises(InputError):
        box.step(0.0, ROBOT.q_reference[:4], REST)
    found = only(box)
    assert np.isnan(found.group("q")).all()
    assert np.array_equal(found.group("v")[0], REST)


def test_a_failure_that_lasts_is_written_once_per_filling(tmp_path):
    box = osc.BlackBox(arm(), tmp_path, ticks=10)
    for i in range(25):
        box.step(0.001 * i, ROBOT.q_reference, TOO_FAST)
    box.wait()
    rows = [osc.load(path) for path in box.written]
    assert [len(row) for row in rows] == [1, 10, 10]
    assert np.concatenate([row.t for row in rows]).tolist() == [0.001 * i for i in range(21)]


def test_it_does_not_fill_the_disk(tmp_path):
    box = osc.BlackBox(arm(), tmp_path, ticks=1)
    for i in range(MOST + 5):
        box.step(0.001 * i, ROBOT.q_reference, TOO_FAST)
    box.wait()
    assert len(list(tmp_path.iterdir())) == len(box.written) == MOST


def test_any_status_can_be_a_failure(tmp_path):
    weak = osc.JointLimits(joints={"joint1": (-0.1, 0.1)})
    stack = osc.Stack([osc.PostureTask(ROBOT.q_reference + 1.0)], limits=weak)
    box = osc.BlackBox(osc.Controller(ROBOT, stack), tmp_path, on=Status.JOINT_LIMIT)
    box.step(0.0, np.r_[0.099, ROBOT.q_reference[1:]], REST)
    assert only(box).ended.reason == "JOINT_LIMIT"


def test_the_memory_does_not_grow(tmp_path):
    box = osc.BlackBox(arm(), tmp_path, ticks=500)
    tracemalloc.start()
    try:
        drive(box, 600)
        before = tracemalloc.get_traced_memory()[0]
        drive(box, 400, 600)
        assert tracemalloc.get_traced_memory()[0] - before < 2000
    finally:
        tracemalloc.stop()


def test_the_fault_of_a_scenario_run_is_replayed_at_its_tick(tmp_path, capsys):
    built = build(short(events=EVENTS, duration=0.3))
    box = osc.BlackBox(built.controller, tmp_path, header=built.header)
    assert break_off(built, box, 137, TOO_FAST).status == Status.FAULT
    found = replay(only(box).directory)
    assert (found.ticks, found.gap) == (138, 0.0)
    assert found.first["FAULT"] == pytest.approx(0.137)
    assert (found.last, found.repeated) == ("FAULT", True)
    with pytest.raises(SystemExit) as done:
        main(["replay", str(box.written[0])])
    assert done.value.code == 0
    assert "last tick: FAULT, as recorded" in capsys.readouterr().out
    with pytest.raises(SystemExit) as done:
        main(["plot", str(box.written[0]), "--out", str(tmp_path / "plot.png")])
    assert done.value.code == 0


def test_a_box_that_remembers_less_than_the_run_replays_too(tmp_path):
    """The transition began before what it remembers; targets are held where the run began."""
    built = build(short(events=EVENTS, duration=0.3))
    box = osc.BlackBox(built.controller, tmp_path, ticks=60, header=built.header)
    break_off(built, box, 100, TOO_FAST)
    found = replay(only(box).directory)
    assert found.ticks == 60
    assert found.gap < 1e-9
    assert found.repeated


def test_another_controller_does_not_repeat_it(tmp_path):
    box = osc.BlackBox(arm(), tmp_path)
    drive(box, 5)
    box.step(0.005, ROBOT.q_reference, TOO_FAST)
    found = only(box)
    assert osc.replay(found, arm()).gap == 0.0
    other = osc.Controller(ROBOT, osc.Stack([osc.PostureTask(ROBOT.q_reference + 0.1)]))
    assert osc.replay(found, other).gap > 1.0
    with pytest.raises(RecordingError, match="names no scenario"):
        replay(found.directory)
    panda = osc.load_robot("panda")
    with pytest.raises(RecordingError, match="not of a robot like 'panda'"):
        osc.replay(found, osc.Controller(panda, osc.Stack([osc.PostureTask()])))


def test_a_program_that_dies_of_it_has_written_it(tmp_path):
    script = """
import sys
import numpy as np
import opspace as osc
robot = osc.load_robot("puma560")
box = osc.BlackBox(osc.Controller(robot, osc.Stack([osc.PostureTask()])), sys.argv[1])
for i in range(50):
    box.step(0.001 * i, robot.q_reference, np.zeros(6))
box.step(0.05, robot.q_reference * np.nan, np.zeros(6))
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert "InputError" in done.stderr
    (path,) = tmp_path.iterdir()
    assert len(osc.load(path)) == 51


def test_a_box_that_cannot_be_written_says_so(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="file"):
        osc.BlackBox(arm(), tmp_path / "file")
    with pytest.raises(InputError, match="at least one tick"):
        osc.BlackBox(arm(), tmp_path, ticks=0)
    box = osc.BlackBox(arm(), tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    (tmp_path / "gone").touch()
    said = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warnings.warn", lambda message, **_: said.append(message))
        box.step(0.0, ROBOT.q_reference, TOO_FAST)
        box.wait()
    assert "the black box could not be written" in said[0]
