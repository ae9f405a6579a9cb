"""Robots that stand, run as scenarios say, and what was seen of every tick."""

from itertools import pairwise

import numpy as np

from opspace.command import Status
from opspace.loop import simulate
from opspace.scenario.build import build


class Seen:
    """Watches a run: steps of the torque, errors, and how far limits were passed.

    Args:
        scenario: What is run.
        asks: Called with the controller and each command, after the events of the scenario.
    """

    def __init__(self, scenario, asks=lambda controller, command: None):
        self.built = build(scenario)
        self.controller, self.plant = self.built.controller, self.built.plant
        self.asks = asks
        self.t, self.tau, self.com, self.q, self.status = [], [], [], [], []
        self.cone_use = 0.0
        followed = [self.built.triggers, self]
        self.outcome = simulate(
            self.plant, self.controller, scenario.duration, followed, self.built.stop
        )

    def observe(self, q, v, command):
        del v
        self.t.append(command.t)
        self.tau.append(command.tau)
        self.com.append(command.tasks["com"].error_norm)
        self.q.append(q.copy())
        self.status.append(command.status)
        used = [one.cone_use for one in command.contacts.values()]
        self.cone_use = max([self.cone_use, *used])
        self.asks(self.controller, command)

    def step(self, start=0.01, end=np.inf):
        """Tell the largest torque step between two times, N·m per tick."""
        steps = [
            np.max(np.abs(after - before))
            for t, (before, after) in zip(self.t[1:], pairwise(self.tau), strict=True)
            if start <= t <= end
        ]
        return float(max(steps))

    @property
    def upright(self):
        return not any(Status.FALLING in one for one in self.status)

    def beyond_joints(self):
        """Tell by how much a joint was ever outside its limits, rad."""
        robot, q = self.controller.robot, np.array(self.q)[:, 7:]
        return float(max(np.max(q - robot.q_upper[6:]), np.max(robot.q_lower[6:] - q)))

    def beyond_motors(self):
        """Tell by how much a torque was ever above its limit, N·m."""
        return float(np.max(np.abs(self.tau) - self.controller.robot.torque_limit))
