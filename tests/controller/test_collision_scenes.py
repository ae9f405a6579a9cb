"""A Panda in scenes where it would touch itself or something else, and from random starts."""

import importlib
from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from tests.controller.collision_scenes import SCENES, SECONDS, run

pytestmark = pytest.mark.slow
# N·m per ms: the largest, and 99 of 100. A link's balls take over from each other with a kink.
STEPS = {
    "table": (0.5, 0.3),
    "self_fold": (0.5, 0.3),
    "moving_ball": (0.5, 0.4),
    "gap": (0.5, 0.3),
    "clutter": (1.0, 0.5),
}
LONGER = {"moving_ball": 4.0}
"""Until the ball has passed, s."""


@pytest.mark.parametrize("name", SCENES)
def test_nothing_comes_nearer_than_the_margin(name):
    seconds = LONGER.get(name, SECONDS)
    free, kept = run(name, guarded=False, seconds=seconds), run(name, seconds=seconds)
    assert free.least < 0.0
    assert kept.least >= 0.01
    assert osc.Status.COLLISION in kept.status
    assert osc.Status.COLLISION_LOST not in kept.status
    largest, most = STEPS[name]
    assert np.max(kept.steps) <= largest
    assert np.quantile(kept.steps, 0.99) <= most


STARTS = 25
EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"


@pytest.mark.parametrize("kind", ["panda", "ur5", "xarm7", "puma560", "two-ur5"])
def test_from_random_starts_nothing_comes_nearer_unless_it_is_said(monkeypatch, kind):
    monkeypatch.syspath_prepend(EVIDENCE)
    campaign = importlib.import_module("collision_campaign")
    runs = [campaign.one_start(kind, seed) for seed in range(STARTS)]
    runs = [run for run in runs if run.ticks]
    assert len(runs) >= 0.5 * STARTS
    assert min(run.least for run in runs) >= 0.01
    assert sum(run.lost for run in runs) <= 0.05 * len(runs) + 1
