"""Tasks that change their level in C do so as in a stack, to the last bit."""

import numpy as np
import pytest

import opspace as osc
from tests.export.in_c import InC, with_cc

DT = 1e-3


def four():
    """An arm with four tasks at levels 0 to 3."""
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    tasks = [
        osc.OrientationTask(target=robot.rotation(robot.tool).copy()),
        osc.PositionTask(target=robot.position(robot.tool) + 0.05),
        osc.JointTask("joint1", target=0.3),
        osc.PostureTask(target=robot.q_reference),
    ]
    stack = osc.Stack(dict(enumerate(tasks)), limits=osc.JointLimits())
    controller = osc.Controller(robot, stack, torque_limits="priority", period=DT)
    return controller, tasks


class Both:
    """A stack, and the same in C, told the same and compared at every tick."""

    def __init__(self, folder, **options):
        self.controller, self.tasks = four()
        self.stack = self.controller.stack
        self.c = InC(folder, self.controller, **options)
        self.chance, self.k, self.clock = np.random.default_rng(0), 0, 0.0

    @property
    def t(self):
        return DT * self.k + self.clock

    def restart(self, clock):
        """Go on with a clock that is so far from the one before."""
        self.controller.restart()
        self.c.restart()
        self.clock += clock
        self.run(1)

    def leave(self, i, duration):
        self.stack.remove(self.tasks[i], duration=duration, start_time=self.t)
        assert self.c.set("presence", self.tasks[i], 0, self.t, duration) == 0

    def move(self, i, level, duration):
        self.stack.move(self.tasks[i], level, duration)
        assert self.c.move(self.tasks[i], level, self.t, duration) == 0

    def swap(self, i, j, duration):
        self.stack.swap(self.tasks[i], self.tasks[j], duration)
        assert self.c.swap(self.tasks[i], self.tasks[j], self.t, duration) == 0

    def run(self, ticks):
        largest = 0.0
        for _ in range(ticks):
            q = self.controller.robot.q_reference + 0.1 * np.sin(self.t * np.arange(1.0, 7.0))
            v = 0.1 * self.chance.normal(size=6)
            command, (status, tau) = (one.step(self.t, q, v) for one in (self.controller, self.c))
            np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {self.k}")
            assert status == command.status
            largest = max(largest, np.abs(tau).max())
            self.k += 1
        return largest


@with_cc
def test_tasks_move_and_swap_as_in_a_stack(tmp_path):
    both = Both(tmp_path, levels=[-1, 0.5], moves=3)
    both.run(5)
    both.move(2, -1, 0.02)
    both.run(8)
    both.move(2, 2, 0.02)  # back on the way
    both.run(30)
    both.swap(0, 1, 0.02)
    both.run(6)
    both.move(3, 0.5, 0.03)  # while others swap
    both.run(3)
    both.swap(0, 1, 0.02)  # turned around
    both.run(40)
    both.move(2, 0.5, 0.02)
    both.run(5)
    both.move(2, -1, 0.02)  # further, before it has arrived
    both.run(40)
    both.move(2, 3, 0.0)  # at once
    assert both.run(10) > 1.0


@with_cc
@pytest.mark.parametrize("seed", range(3))
def test_whatever_is_asked_for_at_any_time_comes_out_the_same(seed, tmp_path):
    both, chance = Both(tmp_path, levels=[-1, 0.5], moves=4), np.random.default_rng(seed)
    levels = [-1, 0, 0.5, 1, 2, 3]
    for _ in range(40):
        duration = float(chance.choice([0.0, 0.01, 0.0137, 0.03]))
        start = both.t + float(chance.choice([0.0, 0.0, -0.004, -0.0003, 0.0003, 0.0124]))
        i, j = chance.permutation(3)[:2].tolist()
        if chance.random() < 0.4:
            answer = both.c.swap(both.tasks[i], both.tasks[j], start, duration)
            if answer == 0:
                both.stack.swap(both.tasks[i], both.tasks[j], duration, start_time=start)
        else:
            level = float(chance.choice(levels))
            answer = both.c.move(both.tasks[i], level, start, duration)
            if answer == 0:
                both.stack.move(both.tasks[i], level, duration, start_time=start)
        assert answer in (0, -5)
        both.run(int(chance.integers(0, 15)))
        if chance.random() < 0.1:
            both.restart(float(chance.choice([-0.2, 0.5, 7.25])))
    both.run(60)
    # All have arrived, and every change can be asked for again.
    assert both.c.move(both.tasks[0], -1, both.t, 0.01) == 0


@with_cc
def test_what_is_asked_for_later_hurries_nobody(tmp_path):
    both = Both(tmp_path, levels=[-1], moves=2)
    both.run(3)
    both.move(0, 2, 0.03)
    both.leave(3, 0.03)
    both.run(5)
    both.stack.move(both.tasks[2], -1, 0.01, start_time=both.t + 0.05)
    assert both.c.move(both.tasks[2], -1, both.t + 0.05, 0.01) == 0
    both.run(5)
    both.restart(-1.0)  # it waits on, and tasks go on from where they were
    assert both.run(80) > 1.0


@with_cc
def test_wishes_for_times_to_come_are_counted_and_none_is_lost(tmp_path):
    both = Both(tmp_path)
    other = both.tasks[1]
    for _ in range(2):  # those that wait for their time, then those that wait for a step
        for k in range(64):
            assert both.c.set("presence", other, k % 2, 0.1, 0.01) == 0
        both.c.step(both.t, both.controller.robot.q_reference, np.zeros(6))
    assert both.c.set("presence", other, 0, 0.1, 0.01) == -5
    both.c.step(0.1, both.controller.robot.q_reference, np.zeros(6))
    both.c.step(0.2, both.controller.robot.q_reference, np.zeros(6))
    assert both.c.set("presence", other, 0, 0.2, 0.01) == 0
    assert both.c.read("h")[1] == 1.0, "the last wish of each"


@with_cc
def test_durations_and_times_without_sense_are_refused_and_huge_ones_are_taken(tmp_path):
    both = Both(tmp_path)
    both.run(2)
    for t, duration in ((np.nan, 1.0), (np.inf, 1.0), (0.0, np.nan), (0.0, np.inf), (0.0, -1e-9)):
        assert both.c.move(both.tasks[0], 1, t, duration) == -3
        assert both.c.swap(both.tasks[0], both.tasks[1], t, duration) == -3
        assert both.c.set("presence", both.tasks[0], 0, t, duration) == -3
    for i in (-1, 4, 2**31 - 1):
        assert both.c._call("move", i, 1.0, 0.0, 1.0) == -2
        assert both.c._call("swap", 0, i, 0.0, 1.0) == -2
        assert both.c._call("set_presence", i, 0, 0.0, 1.0) == -2
    both.move(0, 2, 1e300)
    both.swap(1, 2, 1e-300)
    both.run(5)


@with_cc
def test_moves_are_counted_and_unknown_levels_are_refused(tmp_path):
    both = Both(tmp_path, moves=1)
    hand, base = both.tasks[1], both.tasks[2]
    refused, no_task, busy = -3, -2, -5
    assert both.c.move(hand, 0.5, 0.0, 1.0) == refused
    assert both.c.move(osc.PositionTask(name="nobody"), 0.0, 0.0, 1.0) == no_task
    assert both.c.move(hand, 0, 0.0, -1.0) == refused
    assert both.c.swap(hand, hand, 0.0, 1.0) == refused
    both.run(1)
    both.move(1, 0, 0.01)
    assert both.c.move(base, 0, both.t, 0.01) == busy
    both.run(20)
    both.move(2, 0, 0.01)
    both.run(20)


@with_cc
def test_a_task_that_is_not_there_is_at_another_level_at_once(tmp_path):
    controller, tasks = four()
    c = InC(tmp_path, controller, absent=["joint1"])
    other, others = four()
    other.stack.remove(others[2], duration=0.0)
    q, v = controller.robot.q_reference, np.zeros(6)
    other.step(0.0, q, v)
    c.step(0.0, q, v)
    other.stack.insert(others[2], level=0, duration=0.01)
    assert c.move(tasks[2], 0, DT, 0.5) == 0
    assert c.set("presence", tasks[2], 1, DT, 0.01) == 0
    for k in range(1, 30):
        command, (status, tau) = other.step(DT * k, q, v), c.step(DT * k, q, v)
        np.testing.assert_array_equal(tau, command.tau)
        assert status == command.status


def test_rooms_that_there_are_not_are_refused(tmp_path):
    controller, _ = four()
    for options, said in (
        ({"moves": -1}, "moves is from 0 to 27"),
        ({"moves": 28}, "moves is from 0 to 27"),
        ({"levels": [7], "moves": 0}, "1 more levels need moves=1"),
        ({"levels": [np.nan]}, "level must be a finite number"),
    ):
        with pytest.raises(osc.InputError, match=said):
            osc.export_c(controller, tmp_path, **options)
    assert not list(tmp_path.iterdir())
