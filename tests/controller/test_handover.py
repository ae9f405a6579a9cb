"""The controller starts from the torque that is on the robot and ends at the one that follows."""

import numpy as np
import pytest

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController

PANDA = osc.load_robot("panda")
Q, V, DT = PANDA.q_reference, np.zeros(7), 1e-3
HERE = np.array([5.0, -20.0, 3.0, 30.0, 1.0, 2.0, 0.5])
KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])


def controller(kind=osc.Controller, **options):
    tool = osc.PositionTask(target=[0.4, 0.2, 0.5])
    return kind(PANDA, osc.Stack([tool, osc.PostureTask(PANDA.q_reference)]), **options)


def torques(driver, ticks, first=0):
    return np.array([driver.step((first + k) * DT, Q, V).tau for k in range(ticks)])


@KINDS
def test_it_begins_at_the_torque_on_the_robot_and_becomes_its_own(kind):
    own = torques(controller(kind), 1)[0]
    driver = controller(kind)
    driver.take_over(HERE, duration=0.1)
    tau = torques(driver, 120)
    assert np.allclose(tau[0], HERE, atol=1e-12)
    assert np.array_equal(tau[-1], own)
    assert np.max(np.abs(np.diff(tau, axis=0))) < 2.0 * np.max(np.abs(own - HERE)) / 100
    assert Status.HANDOVER not in driver.step(0.2, Q, V).status


@KINDS
def test_it_ends_at_the_torque_that_follows_and_stays(kind):
    driver = controller(kind)
    own = torques(driver, 5)[-1]
    driver.hand_back(PANDA.gravity, duration=0.1)
    gravity = np.array(PANDA.gravity)
    tau = torques(driver, 150, first=5)
    assert np.allclose(tau[0], own, atol=1e-12)
    assert np.allclose(tau[100:], gravity, atol=1e-12)
    assert np.max(np.abs(np.diff(tau, axis=0))) < 2.0 * np.max(np.abs(own - gravity)) / 100
    assert Status.HANDOVER in driver.step(1.0, Q, V).status


def test_the_slope_is_continuous_too():
    driver = controller()
    driver.take_over(HERE, duration=0.2)
    tau = torques(driver, 250)
    bend = np.abs(np.diff(tau, 2, axis=0))
    assert bend.max() < 8.0 * np.abs(tau[0] - tau[-1]).max() / 200**2


def test_feedback_acts_from_the_first_tick_on():
    driver = controller()
    driver.take_over(HERE, duration=10.0)
    driver.step(0.0, Q, V)
    tau, plain = driver.step(DT, Q, V + 0.1).tau, controller().step(DT, Q, V + 0.1).tau
    still = controller().step(DT, Q, V).tau
    assert np.allclose(tau - HERE, plain - still, atol=1e-6)


@pytest.mark.parametrize("back", [False, True])
def test_what_cannot_be_handed_over_is_refused(back):
    driver = controller()
    hand = driver.hand_back if back else driver.take_over
    with pytest.raises(osc.InputError, match=r"shape \(7,\)"):
        hand(np.zeros(6))
    with pytest.raises(osc.InputError, match="finite"):
        hand(np.full(7, np.nan))
    with pytest.raises(osc.InputError, match="duration of a handover must be above zero"):
        hand(np.zeros(7), 0.0)
    assert Status.HANDOVER not in driver.step(0.0, Q, V).status
