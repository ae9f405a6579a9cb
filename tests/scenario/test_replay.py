"""A replay gives the recorded torques again, and shows where it does not."""

import json

import numpy as np
import pytest

from opspace.cli import main
from opspace.errors import RecordingError
from opspace.record import load
from opspace.record.format import DATA, HEADER
from opspace.runs.replay_run import replay
from opspace.runs.run import run_scenario
from tests.scenario.short import HOLD, short

TASKS = {
    **HOLD["tasks"],
    "elbow": {"type": "joint", "joint": "joint3", "level": 1, "kp": 50.0, "target": -2.5},
}
EVENTS = [
    {"at": 0.02, "insert": "elbow", "level": -1, "duration": 0.1},
    {"at": 0.08, "swap": ["orientation", "position"], "duration": 0.1},
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    directory = tmp_path_factory.mktemp("replay") / "run"
    run_scenario(short(tasks=TASKS, events=EVENTS, duration=0.25), directory)
    return directory


def test_the_torques_are_the_recorded_ones_to_the_last_bit(run):
    found = replay(run)
    assert found.ticks == len(load(run)) == 250
    assert found.gap == 0.0
    assert found.ended == "completed"


def test_another_torque_is_found_with_its_time(run, tmp_path):
    other = tmp_path / "run"
    other.mkdir()
    for path in run.iterdir():
        (other / path.name).write_bytes(path.read_bytes())
    recording = load(run)
    data = np.fromfile(run / DATA).reshape(len(recording), -1)
    data[77, list(recording.names).index("tau/joint2")] += 0.25
    data.tofile(other / DATA)
    found = replay(other)
    assert found.gap == pytest.approx(0.25)
    assert found.gap_at == pytest.approx(0.077)


def test_the_command_tells_it(run, capsys):
    with pytest.raises(SystemExit) as done:
        main(["replay", str(run)])
    assert done.value.code == 0
    assert "largest difference of a torque: 0 N·m" in capsys.readouterr().out


def test_a_recording_without_its_scenario_is_refused(run, tmp_path):
    other = tmp_path / "run"
    other.mkdir()
    for path in run.iterdir():
        (other / path.name).write_bytes(path.read_bytes())
    header = json.loads((run / HEADER).read_text())
    del header["scenario"]
    (other / HEADER).write_text(json.dumps(header))
    with pytest.raises(RecordingError, match=r"opspace\.replay\(recording, controller\)"):
        replay(other)
