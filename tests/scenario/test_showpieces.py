"""The show-pieces do everything they promise, and the commanded torque stays smooth meanwhile."""

from itertools import pairwise

import numpy as np
import pytest

from opspace.robots import load_robot
from opspace.scenario import load_scenario
from tests.scenario.command import run_by_command

SMOOTH = 1.0
"""Largest step of any joint's torque from one tick of 1 ms to the next, N·m."""

FENCE = {"showpiece-panda": "panda_joint1", "showpiece": "joint1"}


NAMES = ("showpiece-panda", pytest.param("showpiece", marks=pytest.mark.slow))


@pytest.fixture(scope="module", params=NAMES)
def shown(request, tmp_path_factory):
    scenario = load_scenario(request.param)
    out = tmp_path_factory.mktemp("run") / request.param
    return request.param, scenario, run_by_command(request.param, out)


def torque_step(recording):
    return float(np.abs(np.diff(recording.group("tau"), axis=0)).max())


def in_a_ramp(scenario, t):
    """Which ticks lie strictly inside the ramp of an event."""
    return np.any([(t > e.at) & (t < e.end) for e in scenario.events], axis=0)


def test_the_torque_is_smooth_over_the_whole_run(shown):
    _, scenario, recording = shown
    assert recording.ended.how == "completed"
    assert recording.t[-1] == pytest.approx(20.0 - scenario.dt)
    assert torque_step(recording) < SMOOTH


def test_the_story_has_every_kind_of_event_and_ramps_that_overlap(shown):
    _, scenario, _ = shown
    events = sorted(scenario.events, key=lambda event: event.at)
    assert len(events) >= 8
    assert {event.kind for event in events} == {"insert", "remove", "move", "swap"}
    overlapping = sum(b.at < a.end for a, b in pairwise(events))
    assert overlapping >= 3
    assert events[-1].end < scenario.duration


def test_tasks_come_in_at_the_top_in_the_middle_and_at_the_bottom(shown):
    _, scenario, recording = shown
    present = {
        name: recording[f"tasks/{name}/activation"] for name in ("height", "posture", "orientation")
    }
    for event in scenario.events:
        if event.kind != "insert":
            continue
        h = recording[f"tasks/{event.insert}/activation"]
        before = recording.t < event.at
        during = (recording.t > event.at) & (recording.t < event.end - 2 * scenario.dt)
        after = np.searchsorted(recording.t, event.end + 2 * scenario.dt)
        assert np.isnan(h[before][-1]) or h[before][-1] == 0.0, event
        assert np.all((h[during] > 0.0) & (h[during] < 1.0)), event
        assert h[after] == 1.0, event
    assert np.isnan(present["height"][0])
    assert np.isnan(present["posture"][0])
    assert np.all(present["orientation"] == 1.0)
    inserted = {event.insert: event.level for event in scenario.events if event.kind == "insert"}
    levels = {scenario.tasks[n].level if k is None else k for n, k in inserted.items()}
    assert min(levels) == -1
    assert max(levels) == 3
    assert any(-1 < level < 3 for level in levels)


def test_every_removed_task_is_gone_at_its_time(shown):
    _, scenario, recording = shown
    removals = [event for event in scenario.events if event.kind == "remove"]
    assert len(removals) >= 2
    for event in removals:
        h = recording[f"tasks/{event.remove}/activation"]
        assert h[np.searchsorted(recording.t, event.at) - 1] == 1.0, event
        assert np.isnan(h[np.searchsorted(recording.t, event.end + 2 * scenario.dt)]), event


def test_a_joint_limit_works_inside_a_ramp_and_holds(shown):
    name, scenario, recording = shown
    ramping = in_a_ramp(scenario, recording.t)
    active = recording[f"limits/{FENCE[name]}/upper"]
    assert np.any((active > 0.0) & ramping)
    assert np.max(active) > 0.1
    assert active[-1] == 0.0
    (lower, upper) = scenario.joint_limits.joints[FENCE[name]]
    q = recording[f"q/{FENCE[name]}"]
    assert np.max(q) <= upper
    assert np.min(q) >= lower
    assert np.max(q) > upper - 1e-3


def test_no_joint_leaves_the_range_of_its_model(shown):
    _, scenario, recording = shown
    robot = load_robot(scenario.robot)
    q = recording.group("q")
    assert np.all((q >= robot.q_lower) & (q <= robot.q_upper))


def test_a_direction_is_lost_inside_a_ramp_and_comes_back(shown):
    _, scenario, recording = shown
    stretched = (recording.t > 3.0) & (recording.t < 9.0) & in_a_ramp(scenario, recording.t)
    # Level 1 is the position's in this part; a task above it may leave it fewer directions.
    weakest = np.nanmin(recording.group("levels/1/activation"), axis=1)
    assert np.min(weakest[stretched]) < 0.1
    assert np.any((weakest[stretched] > 0.0) & (weakest[stretched] < 0.1))
    assert weakest[-1] == 1.0


def test_everything_returns_to_where_it_began(shown):
    _, _, recording = shown
    for task in ("position", "orientation"):
        assert np.linalg.norm(recording.group(f"tasks/{task}/error")[-1]) < 1e-6
    assert np.max(np.abs(recording.group("v")[-1])) < 1e-4


@pytest.mark.parametrize("name", NAMES)
def test_hard_switches_of_the_same_story_are_far_from_smooth(name, tmp_path):
    # The first third, with two pairs of events and the singularity, is enough.
    found = run_by_command(name, tmp_path / "run", "method=switch", "duration=7.0")
    assert torque_step(found) > 15.0 * SMOOTH
