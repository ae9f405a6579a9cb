"""A robot in this process that does what it declares, and what a test has it do besides."""

import numpy as np

import opspace as osc
from opspace.loop.driver import DriverFacts, RobotState


class FakeRobot:
    """A simulated arm behind the protocol of drivers; its time passes when it is read.

    ``trouble`` maps the number of a read to what happens then: ``"silent"``, ``"lost"`` (the robot
    goes on without having heard the command), ``"again"``, a number that is added to the clock, or
    an exception to raise.
    """

    def __init__(self, robot, *, gravity="controller", adds_gravity=None, trouble=None, **facts):
        adds = (gravity == "robot") if adds_gravity is None else adds_gravity
        facts.setdefault("period", 1e-3)
        self.facts = DriverFacts(gravity=gravity, **facts)
        self.plant = osc.Plant(robot, robot.q_reference, dt=facts["period"], adds_gravity=adds)
        self.trouble = trouble or {}
        self.calls, self.accepted, self.steps = [], None, []
        self.reads = 0
        self.clock = 0.0
        self._command = None
        self._told = None

    def start(self):
        self.calls.append("start")

    def stop(self):
        self.calls.append("stop")

    def write(self, tau):
        self._command = tau.copy()

    def read(self, timeout):
        self.reads += 1
        trouble = self.trouble.get(self.reads)
        if isinstance(trouble, Exception):
            raise trouble
        if trouble == "again":
            return self._told
        self._move(heard=trouble != "lost")
        if trouble == "silent":
            return None
        if isinstance(trouble, float):
            self.clock += trouble
        q, v = self.plant.measure()
        accepted = None if self.accepted is None else self.accepted.copy()
        self._told = RobotState(self.plant.t + self.clock, q, v, accepted)
        return self._told

    def _move(self, heard):
        if self._command is not None and heard:
            before = np.zeros(self._command.size) if self.accepted is None else self.accepted
            self.steps.append(np.max(np.abs(self._command - before)))
            self.accepted, self._command = self._command, None
        if self.accepted is not None:
            self.plant.advance(self.accepted)
        else:
            self.clock += self.facts.period
