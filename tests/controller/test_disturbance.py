"""Joint limits that hold although the model is wrong."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.controller.disturbance import DisturbanceObserver
from opspace.loop import simulate
from opspace.sim import Disturbances, Plant

PANDA = osc.load_robot("panda")


def test_a_constant_disturbance_is_learnt_with_the_time_constant():
    observer = DisturbanceObserver(2, time=0.02)
    v, true, dt = np.zeros(2), np.array([3.0, -1.0]), 1e-3
    for tick in range(41):
        observer.observe(tick * dt, v)
        commanded = np.array([np.sin(tick), 2.0])
        observer.remember(tick * dt, v, commanded)
        v = v + dt * (commanded + true)
    assert observer.acceleration == pytest.approx(true * (1.0 - (1.0 - dt / 0.02) ** 40), rel=1e-9)


def test_ticks_far_apart_and_lost_ones_teach_nothing():
    observer = DisturbanceObserver(1, time=0.01)
    observer.remember(0.0, np.zeros(1), np.zeros(1))
    observer.observe(1.0, np.ones(1))
    assert observer.acceleration == 0.0
    observer.remember(1.0, np.zeros(1), np.zeros(1))
    observer.forget_last()
    observer.observe(1.001, np.ones(1))
    assert observer.acceleration == 0.0


class Reach:
    """How far beyond its limits any joint went, and the ticks that called a limit lost."""

    def __init__(self):
        self.beyond = -np.inf
        self.lost = []

    def observe(self, q, v, command):
        if osc.Status.LIMIT_LOST in command.status:
            self.lost.append(command.t)
        beyond = max(np.max(q - PANDA.q_upper), np.max(PANDA.q_lower - q))
        self.beyond = max(self.beyond, beyond)


def driven(observer_time, clearance=0.01, kind=osc.Controller, duration=2.0, **wrong):
    limits = osc.JointLimits(clearance=clearance, observer_time=observer_time)
    posture = osc.PostureTask(PANDA.q_upper + 0.5, kp=200.0, max_speed=4.0)
    controller = kind(PANDA, osc.Stack([posture], limits=limits), torque_limits="priority")
    reach = Reach()
    plant = Plant(PANDA, PANDA.q_reference, disturbances=Disturbances(**wrong))
    assert simulate(plant, controller, duration, [reach]).completed
    return reach, plant.q


def driven_into_limits(*given, **options):
    reach, q = driven(*given, **options)
    return reach.beyond, q


@pytest.mark.parametrize("seed", [1, 4, 7])
def test_limits_hold_with_wrong_masses_only_where_they_learn(seed):
    trusting, learning = (
        driven_into_limits(time, clearance=0.0, mass_error=0.25, seed=seed)[0]
        for time in (None, 0.01)
    )
    assert trusting > 1e-3
    assert learning < 0.0


@pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
@pytest.mark.parametrize("seed", [1, 4, 7])
def test_what_is_learnt_counts_where_a_limit_would_be_lost(kind, seed):
    """The torque of a joint that is slowed by what the model does not know looks as if it went on."""
    duration = 2.0 if kind is osc.Controller else 0.6
    reach, _ = driven(0.01, kind=kind, duration=duration, mass_error=0.25, seed=seed)
    assert not reach.lost


def test_with_a_right_model_learning_changes_next_to_nothing():
    trusting, learning = (driven_into_limits(time)[1] for time in (None, 0.01))
    assert np.allclose(trusting, learning, atol=1e-4)


def test_compiled_is_readable_while_it_learns():
    ends = [
        driven_into_limits(0.01, kind=kind, duration=0.6, mass_error=0.2, seed=1)[1]
        for kind in (osc.Controller, ReferenceController)
    ]
    assert np.allclose(*ends, rtol=0.0, atol=1e-9)


def test_learning_takes_motors_that_are_respected():
    limits = osc.JointLimits(observer_time=0.01)
    with pytest.raises(osc.InputError, match="torque_limits='priority'"):
        osc.Controller(PANDA, osc.Stack([osc.PostureTask()], limits=limits))


def test_a_clearance_that_leaves_no_range_names_the_joint():
    with pytest.raises(osc.InputError, match="panda_joint"):
        osc.Controller(PANDA, osc.Stack([osc.PostureTask()], limits=osc.JointLimits(clearance=2.0)))
    with pytest.raises(osc.InputError, match="clearance"):
        osc.JointLimits(clearance=-0.1)
    with pytest.raises(osc.InputError, match="observer_time"):
        osc.JointLimits(observer_time=0.0)
