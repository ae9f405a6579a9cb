"""A loop is written down by another process, whoever of the two is killed."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import opspace as osc
from opspace.errors import RecordingError
from opspace.loop.shared_history import HistoryFollower
from opspace.runs import loop_recorder
from tests.drivers.test_robot_apart import N, arm, driver_of, robot_apart


def recorded(folder, where, *, compiled, cycles=500):
    """Drive a robot for a while, with a process that records; give the loop and the recording."""
    controller, _ = arm()
    *_, posture = controller.stack
    posture.target = controller.robot.q_reference
    history = osc.SharedHistory(folder / "cycles", controller.robot, rows=5000)
    loop = osc.Loop(
        controller,
        driver_of("memory", where),
        history=history,
        patience=5000,
        handover=0.1,
        compiled=compiled,
    )
    with osc.LoopRecorder(history, controller, folder / "run"), loop:
        begun = loop.report.counts.cycles
        while loop.report.counts.cycles < begun + cycles:
            assert loop.wait(0.01)
    return loop, osc.load(folder / "run")


@pytest.mark.parametrize("compiled", [False, True])
def test_every_cycle_is_written_down(compiled, tmp_path):
    with robot_apart("memory", tmp_path) as (where, _):
        loop, recording = recorded(tmp_path, where, compiled=compiled)
    cycles = loop.history
    assert recording.ended.how == "completed"
    np.testing.assert_array_equal(recording.t, cycles.t)
    for name in ("q", "v", "tau"):
        np.testing.assert_array_equal(recording.group(name), getattr(cycles, name))
    np.testing.assert_array_equal(recording["answered"], cycles.answered)
    np.testing.assert_array_equal(recording["status"], cycles.status)
    assert recording.header["robot"]["name"] == "puma560"


def followed(folder, rows):
    robot = osc.load_robot("puma560")
    history = osc.SharedHistory(folder / "cycles", robot, rows=rows)
    return history, HistoryFollower(folder / "cycles")


def add(history, k):
    history.add(float(k), np.full(N, k), np.full(N, k), np.full(N, k), k, 0.5)


def test_what_is_overwritten_before_it_is_read_is_counted(tmp_path):
    history, follower = followed(tmp_path, 8)
    for k in range(3):
        add(history, k)
    assert follower.more(ended=False).rows[:, 0].tolist() == [0.0, 1.0]
    for k in range(3, 30):
        add(history, k)
    found = follower.more(ended=False)
    assert found.rows[:, 0].tolist() == list(range(23, 29))  # 22 may be on its way to be 30
    assert found.lost == 21
    assert follower.more(ended=True).rows[:, 0].tolist() == [29.0]
    for k in range(30, 38):
        add(history, k)
    found = follower.more(ended=True)  # nobody writes any more: the oldest is whole, too
    assert (found.rows[:, 0].tolist(), found.lost) == (list(range(30, 38)), 0)
    assert follower.end is None
    history.end("stopped", "größer als erlaubt")
    assert follower.end == ("stopped", "größer als erlaubt")


def test_a_file_of_somebody_else_is_refused(tmp_path):
    robot = osc.load_robot("puma560")
    other = tmp_path / "letter"
    other.write_text("a letter of mine " * 100)
    with pytest.raises(osc.InputError, match="is not the history"):
        osc.SharedHistory(other, robot)
    with pytest.raises(osc.InputError, match="is not the history"):
        HistoryFollower(other)
    assert other.read_text().startswith("a letter")
    history = osc.SharedHistory(tmp_path / "cycles", robot)
    add(history, 0)
    controller, _ = arm()
    with pytest.raises(osc.InputError, match="loop before this one"):
        osc.Loop(controller, driver_of("memory", "nowhere"), history=history)
    (tmp_path / "run").mkdir()
    osc.LoopRecorder(history, controller, tmp_path / "run").close()
    with pytest.raises(RecordingError, match="already holds a recording"):
        osc.LoopRecorder(history, controller, tmp_path / "run")
    assert osc.load(tmp_path / "run").ended.reason == "nobody wanted more of it"
    history.close()


def test_a_history_is_closed_once_and_a_broken_one_is_refused(tmp_path):
    history, follower = followed(tmp_path, 8)
    add(history, 0)
    history.close()
    with (tmp_path / "cycles").open("w+b") as another:  # which may have the number of its file
        history.close()
        another.write(b"OSC_HIST" + bytes(8 * 70))
        another.flush()
        with pytest.raises(osc.InputError, match="is not the history"):
            HistoryFollower(tmp_path / "cycles")
    assert follower.more(ended=True).rows[:, 0].tolist() == [0.0]
    with pytest.raises(FileNotFoundError):
        osc.SharedHistory(tmp_path / "nowhere" / "cycles", osc.load_robot("puma560"))


def test_cycles_that_are_lost_are_warned_of(tmp_path, caplog):
    history, _ = followed(tmp_path, 8)
    for k in range(30):
        add(history, k)
    history.end("completed", "")
    recorder = osc.LoopRecorder(history, arm()[0], tmp_path / "run")
    recorder.close()
    recorder.close()
    recording = osc.load(tmp_path / "run")
    assert recording.t.tolist() == list(range(22, 30))
    assert recording.ended.reason == "22 cycles were overwritten before they were read"
    assert recording.ended.reason in caplog.text
    history.close()


def test_a_process_that_records_and_does_not_begin_or_end_is_told_by_name(tmp_path, monkeypatch):
    history, _ = followed(tmp_path, 8)
    controller = arm()[0]
    with pytest.raises(osc.InputError, match="header cannot be written down"):
        osc.LoopRecorder(history, controller, tmp_path / "run", {"robot": object()})
    with monkeypatch.context() as patch:
        patch.setattr(loop_recorder, "STARTING", 0.0)
        with pytest.raises(RecordingError, match="did not begin within 0 s"):
            osc.LoopRecorder(history, controller, tmp_path / "run")
    recorder = osc.LoopRecorder(history, controller, tmp_path / "other")
    os.kill(recorder.pid, signal.SIGSTOP)
    with monkeypatch.context() as patch:
        patch.setattr(loop_recorder, "ENDING", 0.1)
        with pytest.raises(RecordingError, match="still writes after"):
            recorder.close()
    os.kill(recorder.pid, signal.SIGCONT)
    recorder.close()
    assert osc.load(tmp_path / "other").ended.how == "stopped"
    history.close()


def test_a_history_that_goes_on_is_not_taken_from_its_process(tmp_path):
    program = (
        "import sys, opspace as osc; robot = osc.load_robot('puma560'); "
        f"history = osc.SharedHistory({str(tmp_path / 'cycles')!r}, robot); "
        "print('there', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program]
    robot = osc.load_robot("puma560")
    with subprocess.Popen(command, stdin=-1, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "there\n"
        with pytest.raises(osc.InputError, match="goes on"):
            osc.SharedHistory(tmp_path / "cycles", robot)
        follower = HistoryFollower(tmp_path / "cycles")
        assert follower.end is None
        other.kill()
        other.wait()
        assert follower.end == ("crashed", "the process of the loop is gone")
    osc.SharedHistory(tmp_path / "cycles", robot).close()


KILLED = """
import sys
from pathlib import Path
from tests.drivers.test_robot_apart import arm, driver_of
import opspace as osc
folder, where, compiled = Path(sys.argv[1]), sys.argv[2], sys.argv[3] == "True"
controller, _ = arm()
*_, posture = controller.stack
posture.target = controller.robot.q_reference
history = osc.SharedHistory(folder / "cycles", controller.robot)
loop = osc.Loop(
    controller, driver_of("memory", where), history=history, patience=5000, handover=0.1,
    compiled=compiled,
)
recorder = osc.LoopRecorder(history, controller, folder / "run")
with loop:
    while loop.report.counts.cycles < 600:
        loop.wait(0.01)
    print(recorder.pid, flush=True)
    loop.wait()
"""


def killed_loop(folder, where, *, compiled):
    """Kill a program that drives, and wait for the process that records to notice."""
    command = [sys.executable, "-c", KILLED, str(folder), where, str(compiled)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
        recorder = int(client.stdout.readline())
        time.sleep(0.1)
        client.kill()
        client.wait()
    for _ in range(1000):
        if not alive(recorder):
            break
        time.sleep(0.01)


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().split()[2] != "Z"
    except OSError:
        return False


def check_killed(folder, account):
    recording = osc.load(folder / "run")
    assert recording.ended.how == "crashed"
    assert recording.ended.reason == "the process of the loop is gone"
    assert np.all(np.diff(recording.t) > 0.0)
    follower = HistoryFollower(folder / "cycles")
    everything = follower.more(ended=True).rows
    # All but the last cycle, which may not have been whole.
    assert len(everything) - len(recording.t) <= 1
    np.testing.assert_array_equal(recording.t, everything[: len(recording.t), 0])
    # The robot lived as long as it did not miss its driver.
    assert account["silences"] == 1
    assert account["fastest"] < 0.02


def test_a_loop_that_is_killed_is_written_down_to_its_last_cycles(tmp_path):
    with robot_apart("memory", tmp_path) as (where, account):
        killed_loop(tmp_path, where, compiled=True)
        time.sleep(4.0)
    check_killed(tmp_path, account)


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [False, True])
def test_twenty_loops_are_killed(compiled, tmp_path):
    for k in range(20):
        folder = tmp_path / str(k)
        folder.mkdir()
        with robot_apart("memory", folder) as (where, account):
            killed_loop(folder, where, compiled=compiled)
            time.sleep(6.0)
        check_killed(folder, account)


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [False, True])
def test_twenty_recorders_are_killed_and_the_loop_goes_on(compiled, tmp_path):
    behind = []
    with robot_apart("memory", tmp_path) as (where, account):
        for k in range(20):
            folder = tmp_path / str(k)
            folder.mkdir()
            controller, _ = arm()
            *_, posture = controller.stack
            posture.target = controller.robot.q_reference
            history = osc.SharedHistory(folder / "cycles", controller.robot, 200_000)
            loop = osc.Loop(
                controller,
                driver_of("memory", where),
                history=history,
                patience=5000,
                handover=0.1,
                compiled=compiled,
            )
            with loop:
                recorder = osc.LoopRecorder(history, controller, folder / "run")
                while osc.load(folder / "run").t.size < 200:
                    assert loop.wait(0.05)
                killed_at = loop.history.t[-1]
                os.kill(recorder.pid, signal.SIGKILL)
                with pytest.raises(RecordingError, match="has ended with -9"):
                    recorder.close()
                cycles = loop.report.counts.cycles
                while loop.report.counts.cycles < cycles + 100:
                    assert loop.wait(0.01)
            assert loop.report.completed, loop.report.reason
            assert loop.report.standstill
            recording = osc.load(folder / "run")
            assert recording.ended.how == "unfinished"
            cycles = loop.history
            behind.append(killed_at - recording.t[-1])
            np.testing.assert_array_equal(recording.t, cycles.t[: len(recording.t)])
            # What it has not written the loop still has, for another one.
            osc.LoopRecorder(history, controller, folder / "again").close()
            again = osc.load(folder / "again")
            np.testing.assert_array_equal(again.group("tau"), cycles.tau)
            assert again.ended.how == "completed"
    print(f"at most {max(behind):.3f} s behind when it was killed")
    assert account["reflexes"] == account["silences"] == 0
    assert account["fastest"] < 0.02
