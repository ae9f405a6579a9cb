"""Kernels that are compiled for one controller alone give its torque to the last digits."""

import ctypes

import numpy as np
import pytest

from opspace.export.own_kernels import WRITTEN, arrays_of
from opspace.plan.records import TICK
from tests.export.in_c import InC, with_cc
from tests.export.test_c_library import start
from tests.export.test_integrals_in_c import learning
from tests.export.test_standing_in_c import standing


def on_ways(name):
    """A controller whose tasks go to their targets on ways, the hand from where it is found."""
    controller, tasks = start(name)
    for task in tasks:
        task.max_speed, task.max_acceleration = 0.5, 2.0
    return controller


MOVES = {"arm that learns": 0}
"""How many moves there are at once; without any, levels are constant as well."""
BUILDS = {
    "arm that moves tasks": lambda: start("puma560", torque_limits="priority")[0],
    "arm that learns": lambda: learning("panda", "tool")[0],
    "arm on ways": lambda: on_ways("puma560"),
    "quadruped": lambda: standing("solo12")[0],
}


@pytest.mark.parametrize("name", BUILDS)
def test_what_is_constant_is_written_by_no_tick(name):
    controller = BUILDS[name]()
    robot = controller.robot
    q, v = robot.q_reference, np.zeros(robot.nv)
    controller.step(0.0, q, v)
    tick = controller._plan.tick
    before = {one: array.copy() for one, array, stays in arrays_of(TICK, tick, WRITTEN) if stays}
    assert {"option", "bodies.kind", "inertia.end", "torque_limit"} <= set(before)
    assert not {"tau", "kind", "variable", "numbers", "dynamics.M"} & set(before)
    for k in range(1, 100):
        chance = np.random.default_rng(k)
        spread = 0.3 if k % 7 == 0 and robot.nq == robot.nv else 0.01
        q = robot.integrate(robot.q_reference, spread * chance.normal(size=robot.nv), 1.0)
        controller.step(1e-3 * k, q, spread * chance.normal(size=robot.nv))
    after = {one: array for one, array, _ in arrays_of(TICK, tick, WRITTEN)}
    for one, array in before.items():
        np.testing.assert_array_equal(after[one], array, err_msg=one)


@with_cc
@pytest.mark.slow
@pytest.mark.parametrize("name", BUILDS)
def test_kernels_of_its_own_give_the_same_torque(name, tmp_path):
    controller = BUILDS[name]()
    robot, stack = controller.robot, controller.stack
    other = InC(tmp_path, controller, moves=MOVES.get(name, 2), own_kernels=True)
    last = stack.members[-1].task
    seen = set()
    for k in range(300):
        chance = np.random.default_rng(k)
        spread = 0.3 if k % 7 == 0 and robot.nq == robot.nv else 0.01
        q = robot.integrate(robot.q_reference, spread * chance.normal(size=robot.nv), 1.0)
        v, t = spread * chance.normal(size=robot.nv), 1e-3 * k
        if k == 50:
            stack.remove(last, duration=0.05)
            assert other.set("presence", last, 0, t, 0.05) == 0
        if k == 70:
            stack.insert(last, stack.members[-1].level, duration=0.05)
            assert other.set("presence", last, 1, t, 0.05) == 0
        if k == 150 and len(stack.members) > 1 and name not in MOVES:
            first = stack.members[0].task
            stack.swap(first, last, duration=0.05)
            assert other.swap(first, last, t, 0.05) == 0
        command, (status, tau) = controller.step(t, q, v), other.step(t, q, v)
        scale = max(1.0, np.abs(command.tau).max())
        np.testing.assert_allclose(tau, command.tau, rtol=0.0, atol=1e-10 * scale)
        assert status == command.status
        seen.add(status)
    assert len(seen) > 1
    model = ctypes.byref(ctypes.c_char.in_dll(other.library, "controller"))
    assert not other.library.opspace_open(model), "its memory is in use"
    other.library.opspace_close(other.own)
    again = other.own = ctypes.c_void_p(other.library.opspace_open(model))
    assert again
    fresh = BUILDS[name]()
    state = 0.0, robot.q_reference.copy(), np.zeros(robot.nv)
    np.testing.assert_allclose(other.step(*state)[1], fresh.step(*state).tau, rtol=0.0, atol=1e-9)
