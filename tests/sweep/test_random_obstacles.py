"""Obstacles of random campaigns: where they start, and what is counted of their distances."""

import numpy as np
import pytest
from tests.scenario.short import HOLD

from opspace.command import Status
from opspace.law.scalars import allowed_speed
from opspace.runs.run import run_scenario
from opspace.scenario.build import build
from opspace.scenario.load import scenario_from
from opspace.sweep import SweepPlan, Variation, random_scenario
from opspace.sweep.random_obstacles import SPEED
from opspace.sweep.row import run_row

TOOL = np.array([0.64, -0.15, 0.776])
"""Where that of HOLD is, m."""


def drawn(monkeypatch, seed, part):
    """A scenario of a PUMA, with obstacles in this part of them."""
    monkeypatch.setattr(random_scenario, "AMONG_OBSTACLES", part)
    monkeypatch.setattr(random_scenario, "_arms", lambda: ("puma560",))
    return random_scenario.random_scenario(np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(8))
def test_obstacles_leave_an_arm_time_and_the_rest_of_its_scenario_alone(monkeypatch, seed):
    plain, found = drawn(monkeypatch, seed, 0.0), drawn(monkeypatch, seed, 1.0)
    assert "collisions" not in plain
    assert {**plain, "collisions": found["collisions"]} == found
    built = build(scenario_from(found))
    guard, obstacles = built.controller.collisions, found["collisions"]["obstacles"]
    assert 2 <= len(guard.obstacles) == len(obstacles) <= 6
    command = built.controller.step(0.0, built.plant.q, built.plant.v)
    for pair, apart in command.distances.items():
        other = pair.split("/")[1]
        speed = np.linalg.norm(obstacles.get(other, {}).get("velocity", 0.0))
        assert speed <= SPEED
        allowed, _ = allowed_speed(apart.distance - guard.margin, guard.brake, guard.k1)
        assert apart.distance > guard.margin
        assert allowed > speed


@pytest.mark.parametrize(("speed", "reason"), [(0.3, "noise"), (3.0, "it comes too fast")])
def test_what_a_sweep_counts_of_distances_is_what_a_recording_shows(tmp_path, speed, reason):
    ball = {
        "shape": "ball",
        "radius": 0.1,
        "position": (TOOL + [0.2, 0.0, 0.0]).tolist(),
        "velocity": [-speed, 0.0, 0.0],
    }
    scenario = {
        **HOLD,
        "duration": 0.5,
        "torque_limits": "priority",
        "collisions": {"margin": 0.02, "pairs": "none", "obstacles": {"ball": ball}},
        "plant": {"position_noise": 3e-3},
    }
    row = run_row(SweepPlan(scenario, [Variation("seed", (3,))]), 0)
    recording = run_scenario(scenario_from(row["scenario"]), tmp_path / "r").recording
    least = recording["distances/least"]
    lost = recording["status"].astype(int) & int(Status.COLLISION_LOST) > 0
    before = least[~np.maximum.accumulate(lost)]
    assert row["numbers"]["distance_excess"] == max(0.02 - np.min(before, initial=np.inf), 0.0)
    assert row["seconds"].get("COLLISION_LOST", 0.0) == pytest.approx(1e-3 * np.sum(lost))
    assert least.min() < 0.02
    assert lost.any() == (reason != "noise")
