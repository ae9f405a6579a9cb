"""Situations that users of other controllers reported, as shipped scenarios with their claims."""

from functools import cache

import numpy as np
import pytest

from tests.scenario.command import run_by_command


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    @cache
    def run(name, *overrides):
        out = tmp_path_factory.mktemp("run") / name
        return run_by_command(name, out, *overrides)

    return run


def torque_step(recording):
    """Largest step of any joint's torque from one tick to the next, N·m."""
    return float(np.abs(np.diff(recording.group("tau"), axis=0)).max())


def error(recording, task):
    return np.linalg.norm(recording.group(f"tasks/{task}/error"), axis=1)


def test_a_ur10_beyond_its_reach_rests_there(recording):
    run = recording("ur10-stretch")
    hold = (run.t > 4.2) & (run.t < 5.2)
    assert np.min(error(run, "position")[hold]) > 0.2  # out of reach, not merely late
    assert np.max(np.abs(run.group("v")[hold])) < 2e-3
    steps = np.abs(np.diff(run.group("tau")[hold], axis=0))
    assert np.max(steps) < 1e-3
    # Creeping to rest is monotonous: a joint that oscillates turns around again and again.
    turns = np.diff(np.sign(run.group("v")[hold]), axis=0) != 0
    assert np.all(turns.sum(axis=0) <= 2)


def test_a_ur10_beyond_its_reach_comes_back(recording):
    run = recording("ur10-stretch")
    assert error(run, "position")[-1] < 1e-3
    # At a limit a level sees 1e-5 of what those below give way.
    assert np.max(error(run, "orientation")) < 1e-5
    assert np.max(np.abs(run.group("v")[-1])) < 1e-3
    assert torque_step(run) < 0.7


def test_a_panda_that_starts_stretched_comes_back(recording):
    run = recording("panda-stretched-back")
    assert run["levels/1/activation/2"][0] < 0.7  # it does start where the direction is released,
    assert np.nanmin(run["levels/1/sigma/2"]) < 1e-3  # and goes through the singular posture
    assert run["levels/1/activation/2"][-1] == 1.0
    assert error(run, "position")[-1] < 1e-3
    assert np.max(error(run, "orientation")) < 1e-6
    assert np.max(np.abs(run.group("v")[-1])) < 1e-3
    assert torque_step(run) < 0.15
    assert np.max(run["q/panda_joint4"]) <= -0.0698


OUTSIDE = {"joint1": (-0.5, 0.5), "joint2": (1.0, 2.0)}


@pytest.mark.parametrize("joint", OUTSIDE)
def test_joints_that_start_outside_are_brought_back_inside(recording, joint):
    run = recording("outside-limits")
    lower, upper = OUTSIDE[joint]
    q = run[f"q/{joint}"]
    outside = np.maximum(q - upper, lower - q)
    assert outside[0] > 0.1
    assert np.all(np.diff(outside[outside > 0.0]) <= 1e-9)  # on its way back, never out again
    assert np.all(outside[run.t > 1.5] < 1e-3)
    assert outside[-1] < 1e-6


def test_they_are_brought_back_without_a_jolt(recording):
    run = recording("outside-limits")
    assert np.max(np.abs(run.group("v"))) < 0.6
    assert torque_step(run) < 1.9
    assert np.max(np.abs(run.group("v")[-1])) < 1e-6


def test_a_joint_pressed_into_its_limit_rests_there(recording):
    run = recording("limit-back-out")
    pressed = (run.t > 2.0) & (run.t < 2.5)
    assert np.all(run["limits/joint1/upper"][pressed] == 1.0)
    assert np.max(run["q/joint1"]) <= 0.5
    assert np.min(run["q/joint1"][pressed]) > 0.5 - 1e-3
    assert np.max(np.abs(run["v/joint1"][pressed])) < 1e-2


def test_a_joint_pressed_into_its_limit_moves_away_when_told_to(recording):
    run = recording("limit-back-out")
    arrived = np.searchsorted(run.t, 2.7)
    moving = np.flatnonzero((run.t > 2.5) & (run["v/joint1"] < -1e-2))[0]
    assert moving < arrived  # while the request fades in, not after it
    assert np.all(run["limits/joint1/upper"][arrived:] == 0.0)
    assert np.all(run["v/joint1"][moving:] < 1e-3)
    assert abs(run["q/joint1"][-1]) < 1e-3
    assert torque_step(run) < 0.95
