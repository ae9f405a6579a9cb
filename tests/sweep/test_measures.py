"""What a sweep counts against the joint limits, and what it does not."""

import numpy as np
import pytest
from tests.scenario.short import short

from opspace.command import Command, Found, Status
from opspace.scenario.build import build
from opspace.sweep.limit_measures import LimitWatch

LIMITS = {"joints": {"joint1": [-0.5, 0.5]}, "speeds": {"joint1": 1.0}, "clearance": 0.02}


def watched(*ticks, pushes=()):
    """Numbers of a run that joint 1 spends at these positions and speeds, with these statuses."""
    built = build(short(joint_limits=LIMITS, plant={"pushes": list(pushes)}))
    watch, rest = LimitWatch(built), built.plant.q
    for i, (q, v, status) in enumerate(ticks):
        built.plant.data.qpos[:] = np.r_[q, rest[1:]]
        built.plant.data.qvel[:] = np.r_[v, np.zeros(5)]
        command = Command(0.001 * i, np.zeros(6), status, 1, Found({}, (), {}))
        watch.observe(built.plant.q, built.plant.v, command)
    return watch.numbers


def test_a_limit_that_could_be_respected_counts_from_the_limit_itself():
    found = watched((0.0, 0.0, Status.OK), (0.49, 0.0, Status.OK), (0.53, 0.0, Status.OK))
    assert found["position_excess"] == found["position_outside"] == pytest.approx(0.03, abs=1e-8)
    assert watched((0.0, 0.0, Status.OK), (0.495, 0.0, Status.OK))["position_excess"] == 0.0


@pytest.mark.parametrize(
    "first", [(0.6, 0.0, Status.OK), (0.45, 5.0, Status.OK)], ids=["outside", "too fast to stop"]
)
def test_a_limit_that_could_not_be_respected_does_not(first):
    assert watched(first, (0.53, 5.0, Status.OK))["position_excess"] == 0.0
    back = watched(first, (0.0, 0.0, Status.OK), (0.53, 0.0, Status.OK))
    assert back["position_excess"] == pytest.approx(0.03, abs=1e-8)


def test_a_lost_limit_does_not_count_until_the_joint_could_stop_again():
    lost = (0.4, 0.0, Status.LIMIT_LOST)
    found = watched((0.0, 0.0, Status.OK), lost, (0.53, 2.0, Status.OK))
    assert found["position_excess"] == found["speed_excess"] == 0.0
    assert found["position_outside"] == pytest.approx(0.03, abs=1e-8)
    again = watched(lost, (0.4, 0.0, Status.OK), (0.53, 2.0, Status.OK))
    assert again["position_excess"] == pytest.approx(0.03, abs=1e-8)
    assert again["speed_excess"] == pytest.approx(1.0)


def test_a_push_excuses_while_it_lasts():
    push = {"at": 0.001, "duration": 0.0005, "force": [1.0, 0.0, 0.0]}
    ticks = [(0.4, 0.0, Status.OK), (0.4, 0.0, Status.OK), (0.53, 2.0, Status.OK)]
    assert watched(*ticks)["position_excess"] > 0.0
    assert watched(*ticks, pushes=[push])["position_excess"] == 0.0
