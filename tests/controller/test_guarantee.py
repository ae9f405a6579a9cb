"""The guarantee of joint limits: none is passed that could be respected, whatever is asked for."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from tests.controller.limit_search import (
    AIMS,
    KEPT,
    OFF_THE_MEAN,
    PASSED,
    TOO_FAST,
    Genes,
    adversary,
    climb,
)

ARMS = tuple(r.name for r in osc.available_robots() if r.kind == "arm" and r.installed)
MOTORS = ("report", "priority")
STEPS = (1, 20)
SEEDS = st.integers(0, 2**32 - 1)
SEARCHED = ("puma560", "ur5", "panda", "xarm7", "so101")
WORST = json.loads(KEPT.read_text())


def check(arm, draw, too_fast=TOO_FAST):
    run = arm.run(draw)
    assert run.position <= PASSED
    assert run.speed <= too_fast
    # Without limits of the motors some torque always does it.
    assert arm.motors == "priority" or not run.lost
    return run.lost


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("motors", MOTORS)
@pytest.mark.parametrize("name", ARMS)
@given(SEEDS)
@settings(max_examples=3)
def test_no_joint_passes_a_limit_that_it_could_respect(name, motors, steps, seed):
    check(adversary(name, motors, steps), np.random.default_rng(seed))


@pytest.mark.slow
@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("motors", MOTORS)
@pytest.mark.parametrize("name", ARMS)
def test_not_in_two_hundred_runs_and_seldom_is_a_limit_lost(name, motors, steps):
    arm = adversary(name, motors, steps)
    lost = [check(arm, np.random.default_rng(seed)) for seed in range(200)]
    assert np.mean(lost) < 0.1


@pytest.mark.parametrize("run", sorted(WORST))
def test_nor_in_the_worst_runs_that_a_search_has_found(run):
    name, motors, aim = run.split()
    too_fast = OFF_THE_MEAN if aim == "speed" else TOO_FAST
    check(adversary(name, motors, 20), Genes(WORST[run]), too_fast)


@pytest.mark.slow
@pytest.mark.parametrize("aim", AIMS)
@pytest.mark.parametrize("name", SEARCHED)
def test_a_search_for_worse_runs_finds_none_that_passes(name, aim):
    arm = adversary(name, "priority", 20)
    found, farthest = climb(arm, aim, 1000, np.random.default_rng(0))
    assert farthest <= PASSED
    check(arm, Genes(found[0][1]))
