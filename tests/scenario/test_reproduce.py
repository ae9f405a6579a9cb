"""One call leaves runs, numbers, figures and pictures of every experiment."""

import json

import pytest

from opspace.record import load
from opspace.runs import reproduce as module
from opspace.runs.experiments import VARIANTS, Experiment
from opspace.runs.reproduce import EXPERIMENTS, draw, reproduce
from tests.scenario.short import short

KEYS = {
    "completed",
    "stopped_at",
    "max_torque_step",
    "max_joint_speed",
    "max_orientation_error",
    "rest_speed",
    "final_position_error",
    "min_sigma",
    "max_joint_position",
    "min_joint_position",
}


@pytest.fixture
def quick(monkeypatch):
    """The experiments in a moment each."""
    limited = "joint_limits.joints.joint1=[-1, 1]"

    def shortened(name, runs):
        return lambda robot: Experiment(name, name, runs)

    runs = {name: short(limited, method=method) for name, method in VARIANTS.items()}
    monkeypatch.setattr(module, "singularity", shortened("singularity", runs))
    monkeypatch.setattr(module, "joint_limit", shortened("joint-limit", runs))
    fast = {"x1": short(limited), "x2": short(limited)}
    monkeypatch.setattr(module, "fast_approaches", shortened("joint-limit-fast", fast))


@pytest.mark.usefixtures("quick")
def test_every_experiment_has_its_numbers_and_figures(tmp_path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "off")
    done = reproduce(EXPERIMENTS, "puma560", tmp_path)
    assert [found.experiment.name for found in done] == [*EXPERIMENTS, "joint-limit-fast"]
    for found in done:
        written = json.loads((found.directory / "metrics.json").read_text())
        assert list(written) == list(found.runs)
        for name, numbers in written.items():
            assert set(numbers) == KEYS
            assert load(found.directory / name).ended.how == "completed"
    (problem,) = draw(done, tmp_path)
    assert "MUJOCO_GL" in problem
    assert "\n" not in problem
    for name in ("singularity/fig3-joint-speed", "joint-limit/fig7-joint-limit", "overview"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert not list(tmp_path.glob("*/snapshots.png"))


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("which", EXPERIMENTS)
def test_one_experiment_runs_alone_and_may_be_repeated(tmp_path, which):
    for _ in range(2):
        done = reproduce([which], "puma560", tmp_path)
    assert done[0].experiment.name == which
    others = set(EXPERIMENTS) - {which}
    assert not any((tmp_path / other).exists() for other in others)
