"""The paper's two experiments on the PUMA 560, and what the library claims about them."""

import json

import numpy as np
import pytest

from opspace.record import load
from opspace.runs.reproduce import EXPERIMENTS, reproduce


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    directory = tmp_path_factory.mktemp("results")
    reproduce(EXPERIMENTS, "puma560", directory)
    return directory


def metrics(results, experiment):
    return json.loads((results / experiment / "metrics.json").read_text())


def test_out_of_reach_and_back(results):
    found = metrics(results, "singularity")
    transition, switch, without = (found[k] for k in ("transition", "switch", "without"))
    assert not without["completed"]
    assert transition["completed"]
    assert transition["max_orientation_error"] < 1e-3
    assert transition["rest_speed"] < 1e-2
    assert transition["final_position_error"] < 1e-3
    assert transition["max_torque_step"] * 20 < switch["max_torque_step"]


def test_the_target_is_out_of_reach_and_the_arm_rests_in_the_buffer(results):
    run = load(results / "singularity" / "transition")
    desired = run.group("tool")[:, :3] + run.group("tasks/position/error")
    far = int(np.argmax(desired[:, 0]))
    # Shoulder axis to tool, stretched: 0.15 m beside it, 0.4318 + 0.4323 + 0.1 m along the arm.
    reach = np.hypot(0.4318 + np.hypot(0.4318, 0.0203) + 0.1, 0.15005)
    assert np.linalg.norm(desired[far] - [0.0, 0.0, 0.67183]) > reach + 0.2
    resting = (run.t > 4.0) & (run.t < 4.5)
    sigma = run.group("levels/1/sigma")[resting, -1]
    assert np.all((sigma > 0.01) & (sigma < 0.02))
    assert np.ptp(sigma) < 1e-4


def test_past_a_joint_limit_and_back(results):
    found = metrics(results, "joint-limit")
    transition, switch, without = (found[k] for k in ("transition", "switch", "without"))
    assert without["max_joint_position"] > 0.75
    assert transition["max_joint_position"] <= 0.75
    assert transition["min_joint_position"] >= -0.75
    assert transition["final_position_error"] < 1e-3
    assert transition["max_torque_step"] * 20 < switch["max_torque_step"]
    run = load(results / "joint-limit" / "transition")
    limit = run["limits/joint1/upper"]
    assert np.max(limit) > 0.3
    assert limit[-1] == 0.0
    assert np.all(run["tasks/position/activation"] == 1.0)
    assert np.all(run["tasks/orientation/activation"] == 1.0)


@pytest.mark.parametrize("speed", ["x1", "x2", "x3"])
def test_fast_approaches_rest_at_the_limit(results, speed):
    run = load(results / "joint-limit-fast" / speed)
    assert run.ended.how == "completed"
    position = run["q/joint1"]
    assert np.max(position) <= 0.75
    assert np.max(position) > 0.75 - 1e-3
    assert run["limits/joint1/upper"][-1] == 0.0
    assert np.linalg.norm(run.group("tasks/position/error")[-1]) < 1e-3
