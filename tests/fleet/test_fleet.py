"""Every robot of a fleet does what a controller of its own would do."""

import numpy as np
import pytest

import opspace as osc
from tests.fleet.fleets import Beside

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")


def test_random_states_with_limits_and_singular_postures():
    both = Beside(count=64).prepare()
    rng = np.random.default_rng(1)
    seen = 0
    for k in range(12):
        Q, V = both.states(rng, spread=0.3 * (k + 1), speed=2.0)
        for command in both.assert_same(0.001 * k, Q, V):
            seen |= int(command.status)
    wanted = osc.Status.DIRECTION_OFF | osc.Status.FILTERED | osc.Status.TORQUE_SCALED
    assert wanted in osc.Status(seen)


def test_transitions_of_some_robots():
    both = Beside().prepare()
    rng = np.random.default_rng(2)
    Q, V = both.states(rng, spread=0.4)
    program = {
        2: lambda x, some: x.swap("position", "orientation", 0.1, **some([0, 2, 4])),
        5: lambda x, some: x.move("position", 2, 0.05, **some([1, 3])),
        8: lambda x, some: x.remove("orientation", 0.04, **some([1, 4, 5])),
        12: lambda x, some: x.insert("orientation", 1, 0.06, **some([5])),
        20: lambda x, some: x.swap("position", "orientation", 0.0, **some([2])),
    }
    for k in range(36):
        if k == 3:
            both.fleet.insert("elbow", 0, 0.08, profile="cubic", robots=[0, 1])
            for i in (0, 1):
                both.stacks[i].insert(both.others[i], 0, 0.08, profile="cubic")
        if k in program:
            program[k](both.fleet, lambda robots: {"robots": robots})
            for i, stack in enumerate(both.stacks):
                for_one = Only(stack, i)
                program[k](for_one, lambda robots: {"robots": robots})
        both.assert_same(0.005 * k, Q + 0.005 * k * V, V)


class Only:
    """The stack of one robot, which does what a fleet is asked to do with it."""

    def __init__(self, stack, i):
        self._stack, self._i = stack, i

    def __getattr__(self, name):
        def ask(*given, robots):
            if self._i in robots:
                task = self._stack[given[0]] if name == "insert" else given[0]
                getattr(self._stack, name)(task, *given[1:])

        return ask
