"""Whatever happens to a run, its recording says so and keeps every row."""

import json

import pytest

from opspace.errors import InputError, RecordingError
from opspace.record import load
from opspace.runs.metrics import measure
from opspace.runs.run import first_return, limited_joint, run_scenario
from opspace.scenario import load_scenario
from tests.scenario.short import short


class Trap:
    """A progress bar that raises at a tick."""

    def __init__(self, tick, error):
        self.left, self.error = tick, error

    def run(self, title, duration):
        return self

    def observe(self, q, v, command):
        self.left -= 1
        if self.left == 0:
            raise self.error


def test_the_same_seed_gives_the_same_recording_bit_for_bit(tmp_path):
    for name in "ab":
        run_scenario(short(seed=3), tmp_path / name)
    for file in ("data.f64", "header.json", "end.json", "metrics.json", "scenario.yaml"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_a_run_records_every_tick_and_what_was_run(tmp_path):
    scenario = short()
    result = run_scenario(scenario, tmp_path)
    assert result.outcome.completed
    assert len(result.recording) == round(scenario.duration / scenario.dt)
    assert result.recording.ended.how == "completed"
    assert result.recording.header["seed"] == scenario.seed
    assert load_scenario(tmp_path / "scenario.yaml") == scenario
    written = json.loads((tmp_path / "metrics.json").read_text())
    assert written == measure(load(tmp_path), return_time=0.02).to_json()


def test_a_stopped_run_says_why(tmp_path):
    result = run_scenario(short("stop.max_joint_speed=0.001"), tmp_path)
    assert not result.outcome.completed
    assert result.recording.ended.how == "stopped"
    assert "rad/s" in result.recording.ended.reason
    assert result.metrics.stopped_at == result.recording.t[-1] == result.outcome.t < 0.04


@pytest.mark.parametrize(
    ("error", "how"),
    [(KeyboardInterrupt(), "interrupted"), (InputError("a reference failed"), "crashed")],
)
def test_an_interrupt_or_a_crash_loses_no_row(tmp_path, error, how):
    with pytest.raises(type(error)):
        run_scenario(short(), tmp_path, progress=Trap(20, error))
    found = load(tmp_path)
    assert found.ended.how == how
    assert len(found) == 20
    assert how == "interrupted" or "a reference failed" in found.ended.reason


def test_a_recording_is_replaced_only_on_request(tmp_path):
    run_scenario(short(), tmp_path)
    before = (tmp_path / "scenario.yaml").read_bytes()
    with pytest.raises(RecordingError, match="already holds a recording"):
        run_scenario(short(seed=1), tmp_path)
    assert (tmp_path / "scenario.yaml").read_bytes() == before
    assert run_scenario(short(seed=1), tmp_path, overwrite=True).recording.header["seed"] == 1


def test_the_limited_joint_and_the_return_are_found():
    assert first_return(short()) == 0.02
    assert first_return(short("tasks.position.target=null")) is None
    assert limited_joint(short()) is None
    assert limited_joint(short("joint_limits.joints.joint2=[-1, 2]")) == "joint2"
    assert limited_joint(short("joint_limits=null")) is None
