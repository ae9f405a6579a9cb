"""Requests from other threads while the loop runs as fast as it can."""

import threading
import time

import numpy as np
import pytest

from opspace.controller import Controller
from opspace.stack import Stack
from opspace.tasks import JointTask, PositionTask, PostureTask
from tests.stack.arm import arm, state

STAY = "height"
DT = 0.005
PATIENCE = 60.0


class Loop(threading.Thread):
    """Ticks one after the other at a fixed state; remembers what went wrong, and looks at all."""

    def __init__(self, controller, q, v):
        super().__init__()
        self.controller, self.q, self.v = controller, q, v
        self.ticks, self.error, self.running = 0, None, True
        self.blended = 0
        self.slowest, self.most = 0.0, 0

    def run(self):
        try:
            while self.running:
                self.tick()
        except BaseException as error:
            self.error = error

    def tick(self):
        self.ticks += 1
        begin = time.perf_counter()
        command = self.controller.step(self.ticks * DT, self.q, self.v)
        self.slowest = max(self.slowest, time.perf_counter() - begin)
        self.look_at(command)

    def look_at(self, command):
        assert command.tasks[STAY].activation == 1.0
        for task in command.tasks.values():
            assert sum(weight for _, weight in task.levels) == pytest.approx(1.0, abs=1e-12)
        for level in command.levels:
            rows = sum(3 if name == "hand" else 1 for name in level.tasks if name != "posture")
            rows += self.controller.robot.nv * ("posture" in level.tasks)
            assert level.directions.shape[0] == rows
        self.blended += command.hard_solves > 1
        self.most = max(self.most, command.hard_solves)


class Client(threading.Thread):
    """Asks for its own tasks only, so it knows which requests are possible and where it ends."""

    def __init__(self, stack, tasks, seed, loop):
        super().__init__()
        self.stack, self.tasks, self.loop = stack, tasks, loop
        self.rng = np.random.default_rng(seed)
        self.levels, self.asked, self.error = {}, 0, None

    def run(self):
        try:
            while self.loop.running and self.loop.error is None:
                self.ask()
                self.asked += 1
                time.sleep(0.04)
        except BaseException as error:
            self.error = error

    def ask(self):
        a, b = self.rng.choice(len(self.tasks), 2, replace=False)
        a, b = self.tasks[a], self.tasks[b]
        level, duration = float(self.rng.integers(-1, 4)), float(self.rng.uniform(0.02, 0.06))
        if a.name not in self.levels:
            self.stack.insert(a, level, duration)
            self.levels[a.name] = level
        elif b.name in self.levels and self.rng.random() < 0.3:
            self.stack.swap(a, b, duration)
            self.levels[a.name], self.levels[b.name] = self.levels[b.name], self.levels[a.name]
        elif self.rng.random() < 0.5:
            self.stack.move(a, level, duration)
            self.levels[a.name] = level
        else:
            self.stack.remove(a, duration)
            del self.levels[a.name]


def run_for(seconds):
    robot = arm()
    own = [PositionTask(axes="z", name=STAY), PostureTask(robot.q_reference)]
    hand = PositionTask(name="hand")
    joints = [JointTask(name, 0.1 * k) for k, name in enumerate(robot.joint_names[:6])]
    stack = Stack(own)
    loop = Loop(Controller(robot, stack, blending="chain"), *state(robot))
    loop.controller.step(0.0, loop.q, loop.v)
    clients = [
        Client(stack, tasks, seed, loop)
        for seed, tasks in enumerate([joints[:3], joints[3:5], [hand, joints[5]]])
    ]
    threads = [loop, *clients]
    for thread in threads:
        thread.start()
    time.sleep(seconds)
    # How fast the machine is does not matter, but something must have happened.
    patience = time.monotonic() + PATIENCE
    while time.monotonic() < patience and not enough(loop, clients):
        time.sleep(0.1)
    loop.running = False
    for thread in threads:
        thread.join(30.0)
    for thread in threads:
        if thread.error is not None:
            raise thread.error
    met = enough(loop, clients)
    for _ in range(60):
        loop.tick()
    return stack, clients, met


def enough(loop, clients):
    """Whether everybody has asked for something, and the loop has met transitions."""
    return loop.blended > 3 and all(client.asked > 3 for client in clients)


def check(seconds):
    stack, clients, met = run_for(seconds)
    assert stack.settled
    found = {t.name: n for n, level in stack.levels_by_number.items() for t in level}
    expected = {STAY: 0.0, "posture": 1.0}
    for client in clients:
        expected |= client.levels
    assert found == expected
    assert met


def test_nothing_is_lost_or_torn_in_a_short_while():
    check(3.0)


@pytest.mark.slow
def test_nothing_is_lost_or_torn_in_a_minute():
    check(60.0)
