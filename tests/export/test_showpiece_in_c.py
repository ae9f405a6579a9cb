"""The show-pieces in C: every request of their stories gives the same torque, to the last bit."""

import numpy as np
import pytest

import opspace as osc
from opspace.kernels import columns
from opspace.scenario import load_scenario
from opspace.scenario.build import build
from tests.export.in_c import InC, with_cc


class Shadow:
    """Tells C what the stack and its references are told, and compares every tick."""

    def __init__(self, built, c):
        self.built, self.c, self.ticks, self.told = built, c, 0, []
        self.events = sorted(built.scenario.events, key=lambda event: event.at)

    def observe(self, q, v, command):
        t = command.t
        while self.events and self.events[0].at <= t:
            self.ask(self.events.pop(0))
        plan = self.built.controller._plan
        for packed in plan.packed:
            self.aim(packed, plan.tick)
        status, tau = self.c.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"t = {t:g} s")
        assert status == command.status
        self.ticks += 1

    def ask(self, event):
        tasks = self.built.tasks
        if event.kind == "swap":
            answers = [self.c.swap(*(tasks[name] for name in event.swap), event.at, event.duration)]
        elif event.kind == "move":
            answers = [self.c.move(tasks[event.move], event.level, event.at, event.duration)]
        elif event.kind == "insert":
            task = tasks[event.insert]
            level = event.level
            if level is None:
                level = self.built.scenario.tasks[event.insert].level
            answers = [
                self.c.move(task, level, event.at, event.duration),
                self.c.set("presence", task, 1, event.at, event.duration),
            ]
        else:
            answers = [self.c.set("presence", tasks[event.remove], 0, event.at, event.duration)]
        assert not any(answers), event
        self.told.append(event.kind)

    def aim(self, packed, tick):
        """Send where a task goes at this tick."""
        i, task = packed.index, packed.task
        if isinstance(task, osc.PositionTask | osc.OrientationTask):
            numbers = tick.numbers[i]
            first = columns.GOAL_POSITION
            size = 3
            if isinstance(task, osc.OrientationTask):
                first, size = columns.GOAL_ROTATION, 9
            starts = first, columns.GOAL_VELOCITY, columns.GOAL_ACCELERATION
            parts = [
                numbers[k : k + count].copy() for k, count in zip(starts, (size, 3, 3), strict=True)
            ]
        else:
            parts = [np.ascontiguousarray(part) for part in tick.goal[packed.rows].T]
        assert self.c.set("target", task, *parts) == 0


def at_rest(name):
    """The same controller with all its tasks in the stack and targets that stay."""
    built = build(load_scenario(name, ["events=[]"]))
    robot = built.robot
    robot.update(built.plant.q, built.plant.v)
    for task in built.tasks.values():
        if isinstance(task, osc.PositionTask | osc.OrientationTask):
            motion = task.source.measure(robot)
            at = isinstance(task, osc.PositionTask)
            task.target = motion.position if at else motion.rotation
        elif isinstance(task, osc.JointTask):
            task.target = 0.0
    return built.controller


@with_cc
@pytest.mark.slow
@pytest.mark.parametrize(("name", "requests"), [("showpiece", 10), ("showpiece-panda", 11)])
def test_the_whole_story_gives_the_same_torque(name, requests, tmp_path):
    built = build(load_scenario(name))
    guests = [name for name in built.tasks if name not in {t.name for t in built.stack}]
    guests += [e.insert for e in built.scenario.events if e.kind == "insert"]
    here = [member.task.name for member in built.stack.members]
    absent = sorted({guest for guest in guests if guest not in here})
    levels = {e.level for e in built.scenario.events if e.level is not None}
    c = InC(tmp_path, at_rest(name), absent=absent, levels=sorted(levels), moves=4)
    shadow = Shadow(built, c)
    osc.simulate(built.plant, built.controller, 20.0, observers=[shadow])
    assert shadow.ticks == 20000
    assert len(shadow.told) == requests
    assert {"insert", "remove", "move", "swap"} == set(shadow.told)
