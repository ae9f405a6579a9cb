"""The loop reads, commands, tells and advances, in this order, and stops when it must."""

from types import SimpleNamespace

import numpy as np
import pytest

from opspace.loop import Outcome, StopRule, simulate


class Cart:
    """One joint of 1 kg·m² without anything else."""

    dt = 0.01

    def __init__(self, log):
        self.log, self.t, self.state = log, 0.0, np.zeros(2)

    @property
    def q(self):
        return self.state[:1].copy()

    @property
    def v(self):
        return self.state[1:].copy()

    def measure(self):
        return self.q, self.v

    def advance(self, tau):
        self.log.append(("advance", self.t))
        self.state = self.state + self.dt * np.array([self.state[1], tau[0]])
        self.t += self.dt


class Push:
    """A controller that always asks for the same torque."""

    robot = SimpleNamespace(joint_names=("slide",))

    def __init__(self, log, torque=1.0):
        self.log, self.torque = log, torque

    def step(self, t, q, v):
        self.log.append(("step", t))
        return SimpleNamespace(t=t, tau=np.array([self.torque]))


class Witness:
    def __init__(self, log):
        self.log, self.states = log, []

    def observe(self, q, v, command):
        self.log.append(("observe", command.t))
        self.states.append((q[0], v[0]))


def run(duration=0.1, stop=None, torque=1.0):
    log = []
    witness = Witness(log)
    plant = Cart(log)
    outcome = simulate(plant, Push(log, torque), duration, [witness], stop or StopRule())
    return outcome, witness, log, plant


def test_each_tick_steps_tells_and_then_advances():
    outcome, witness, log, _ = run()
    assert outcome.completed
    assert outcome.reason == ""
    assert len(witness.states) == 10
    assert [what for what, _ in log] == ["step", "observe", "advance"] * 10
    times = [t for what, t in log if what == "step"]
    np.testing.assert_allclose(times, 0.01 * np.arange(10), atol=1e-12)
    assert witness.states[0] == (0.0, 0.0)


def test_two_runs_are_the_same():
    assert run()[1].states == run()[1].states


def test_a_second_call_goes_on():
    log = []
    plant, controller = Cart(log), Push(log)
    for _ in range(2):
        simulate(plant, controller, 0.05)
    times = [t for what, t in log if what == "step"]
    np.testing.assert_allclose(times, 0.01 * np.arange(10), atol=1e-12)


@pytest.mark.parametrize(
    ("stop", "reason"),
    [
        (StopRule(max_joint_speed=0.045), "joint 'slide' moved at 0.1 rad/s"),
        (StopRule(max_torque=0.5), "joint 'slide' was asked for 1 N·m"),
    ],
)
def test_a_rule_ends_the_run_before_the_plant_advances(stop, reason):
    outcome, witness, log, plant = run(stop=stop)
    assert outcome == Outcome(False, witness.states and 0.01 * (len(witness.states) - 1), reason)
    assert [what for what, _ in log].count("advance") == len(witness.states) - 1
    assert plant.state[1] < 0.06


def test_rules_that_are_not_broken_change_nothing():
    lenient = StopRule(max_joint_speed=100.0, max_torque=100.0)
    assert run(stop=lenient)[1].states == run()[1].states


@pytest.mark.parametrize("torque", [np.nan, np.inf])
def test_a_run_that_diverges_ends(torque):
    outcome, witness, _, _ = run(torque=torque)
    assert outcome == Outcome(False, 0.0, "the simulation diverged")
    assert len(witness.states) == 1


def test_a_state_that_diverges_ends_the_run_before_the_controller_sees_it():
    log = []
    plant = Cart(log)
    plant.state = np.array([0.0, np.nan])
    outcome = simulate(plant, Push(log), 0.1)
    assert not outcome.completed
    assert log == []
