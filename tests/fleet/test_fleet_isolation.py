"""What is asked of some robots of a fleet changes no bit of any other, and steps take no memory."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from tests.fleet.fleets import Beside

wp = pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")

COUNT, DT, DURATION = 8, 0.005, 0.04
EVERY = 10
"""Ticks between two requests: what has been asked for has happened by then, in the places there are."""
KINDS = ("swap", "move", "remove", "insert", "reset", "target", "gains", "activation")


def ask(fleet, kind, rng, robots):
    """Ask something of robots; what some of them cannot do is refused for all."""
    position = fleet["position"]
    if kind == "swap":
        fleet.swap("position", "orientation", DURATION, robots=robots)
    elif kind == "move":
        fleet.move("elbow", 0, DURATION, robots=robots)
    elif kind == "remove":
        fleet.remove(str(rng.choice(["posture", "position"])), DURATION, robots=robots)
    elif kind == "insert":
        fleet.insert("elbow", 2, DURATION, robots=robots)
    elif kind == "reset":
        fleet.reset(robots)
    elif kind == "target":
        position.set_target(rng.uniform(-0.4, 0.4, 3), robots=robots)
    elif kind == "gains":
        position.set_gains(float(rng.uniform(10, 300)), robots=robots)
    else:
        whole = position.activation.numpy().copy()
        whole[robots] = rng.random()
        position.activation.assign(whole)


@settings(max_examples=3)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_request_of_some_robots_changes_a_bit_of_another(seed):
    rng = np.random.default_rng(seed)
    some, alone = (Beside(COUNT, alone=True).prepare() for _ in range(2))
    Q, V = some.states(rng, spread=0.5)
    asked = rng.random(COUNT) < 0.5
    asked[:2] = True, False
    differ = False
    for k in range(8 * EVERY):
        if k % EVERY == 1:
            robots = np.flatnonzero(asked & (rng.random(COUNT) < 0.7))
            try:
                ask(some.fleet, str(rng.choice(KINDS)), rng, robots)
            except osc.InputError:
                ask(some.fleet, "reset", rng, robots)
        q = Q + 0.002 * k * V
        tau, want = (both.fleet.step(DT * k, q, V).numpy() for both in (some, alone))
        np.testing.assert_array_equal(tau[~asked], want[~asked])
        differ |= bool((tau[asked] != want[asked]).any())
    assert differ


class Counting:
    """An allocator of Warp that counts.

    Args:
        allocator: The one that does it.
    """

    def __init__(self, allocator):
        self._allocator, self.count = allocator, 0

    def __getattr__(self, name):
        return getattr(self._allocator, name)

    def allocate(self, size):
        self.count += 1
        return self._allocator.allocate(size)


def test_steps_take_no_memory(monkeypatch):
    both = Beside(COUNT, alone=True).prepare()
    fleet, (Q, V) = both.fleet, both.states(np.random.default_rng(1))
    q, v = (wp.array(x, device="cpu") for x in (Q, V))
    t = wp.zeros(1, dtype=wp.float64, device="cpu")
    fleet.remove("posture", 0.02, robots=[1])
    fleet.step(t, q, v)
    device = fleet.device
    counting = Counting(device.default_allocator)
    for name in ("default_allocator", "current_allocator"):
        if hasattr(device, name):
            monkeypatch.setattr(device, name, counting)
    for k in range(5):
        t.fill_(0.01 * k)
        fleet.step(t, q, v)
        fleet.step(0.01 * k, Q, V)
    assert counting.count == 0
    wp.zeros(3, device=device)
    assert counting.count == 1


def buried(robot):
    """Tasks to which the posture leaves no motion."""
    stack = [osc.PostureTask(), osc.PositionTask(target=[0.4, 0.1, 0.3]), osc.OrientationTask()]
    return stack, osc.JointTask(robot.joint_names[2], 0.3, name="elbow")


@pytest.mark.parametrize("name", ["position", "orientation", "elbow"])
@pytest.mark.parametrize("where", ["nothing is left", "on its way out", "with no activation"])
def test_a_target_that_is_no_number_brakes_its_robot_only(name, where):
    wrong, fair = (Beside(4, alone=True, make=buried) for _ in range(2))
    Q, V = wrong.states(np.random.default_rng(3), spread=0.5)
    for both in (wrong, fair):
        both.fleet.insert(both.later, 2, 0.0)
        both.fleet.step(0.0, Q, V)
        if where == "on its way out":
            both.fleet.remove(name, 0.1)
        if where == "with no activation":
            both.fleet[name].activation.zero_()
        both.fleet.step(0.01, Q, V)
    target = wrong.fleet[name].target
    right = target.numpy().copy()
    none = right.copy()
    none[2, -1] = np.nan
    target.assign(none)
    tau, want = (both.fleet.step(0.02, Q, V).numpy().copy() for both in (wrong, fair))
    faults = wrong.fleet.status.numpy() & int(osc.Status.FAULT) != 0
    assert faults.tolist() == [False, False, True, False]
    np.testing.assert_array_equal(tau[~faults], want[~faults])
    assert np.isfinite(tau).all()
    target.assign(right)
    for t in (0.03, 0.3):  # where it has gone out, nothing about it matters
        tau, want = (both.fleet.step(t, Q, V).numpy().copy() for both in (wrong, fair))
        np.testing.assert_array_equal(tau, want)
        np.testing.assert_array_equal(wrong.fleet.status.numpy(), fair.fleet.status.numpy())
        if where == "on its way out":
            target.assign(none)
