"""The guarantee of joint limits: none is passed that could be respected, whatever is asked for."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace import Status
from opspace.law.scalars import LOST
from opspace.sim import Plant

ARMS = tuple(r.name for r in osc.available_robots() if r.kind == "arm" and r.installed)
MOTORS = ("report", "priority")
STEPS = (1, 20)
SEEDS = st.integers(0, 2**32 - 1)
DT = 0.001
TICKS = 300
PASSED = LOST / (osc.JointLimits.k1 * osc.JointLimits.k2)
"""What an acceleration that is wrong by LOST, too little for a word, makes of a position, rad."""
TOO_FAST = LOST / osc.JointLimits.k2


class Adversary:
    """An arm with tasks that care for no limit, and a simulation with the controller's own model.

    The simulation makes one step in a tick, or many, between which inertia and Coriolis forces change.
    """

    def __init__(self, name, motors, steps):
        self.robot = robot = osc.load_robot(name)
        self.limits = osc.JointLimits()
        self.tool = osc.PositionTask(target=np.zeros(3), kp=1e5)
        self.turn = osc.OrientationTask(target=np.eye(3), kp=1e5)
        self.posture = osc.PostureTask(robot.q_reference, kp=1e5)
        self.stack = osc.Stack([self.tool, self.turn, self.posture], limits=self.limits)
        # What one step is worth is the acceleration at its beginning: then nothing else counts.
        period = None if steps == 1 else DT
        self.controller = osc.Controller(robot, self.stack, torque_limits=motors, period=period)
        self.steps = steps
        self.plant = Plant(
            robot, robot.q_reference, dt=DT / steps, torque_limits=motors == "priority"
        )
        self.t = 0.0
        self.side = np.ones(robot.nv)

    def begin(self, rng):
        """A state from which every joint can stop at its limits: many near them, many at the edge.

        Most joints begin on their way to the limit that they are near, and are driven there.
        """
        robot = self.robot
        lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -3.0)
        upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, 3.0)
        away = np.minimum(rng.exponential(0.1, robot.nv), upper - lower)
        self.side = rng.choice([-1.0, 1.0], robot.nv)
        near = np.where(self.side < 0.0, lower + away, upper - away)
        q = np.where(rng.random(robot.nv) < 0.7, near, rng.uniform(lower, upper))
        fastest = np.full((2, robot.nv), 5.0)
        for side in self.limits.sides:
            distance = max(side.sign * (side.limit - q[side.index]), 0.0)
            allowed = 5.0
            if np.isfinite(side.limit):
                allowed = self.limits.allowed_speed(side, distance)
            row = fastest[int(side.sign > 0.0)]
            row[side.index] = min(allowed, side.speed, row[side.index])
        there = self.side * rng.choice([-1.0, 1.0, 1.0, 1.0], robot.nv)
        v = np.where(there < 0.0, -fastest[0], fastest[1])
        self.plant.data.qpos[:] = q
        self.plant.data.qvel[:] = v * rng.choice([0.0, 0.5, 1.0, 1.0], robot.nv)
        for task in (self.tool, self.turn, self.posture):
            task.kp = 10.0 ** rng.uniform(2.0, 8.0)

    def change(self, rng):
        """Other targets, and the stack on its way to another order."""
        self.tool.target = 3.0 * rng.normal(size=3)
        quaternion = rng.normal(size=4)
        self.turn.target = quaternion / np.linalg.norm(quaternion)
        beyond = self.plant.q + self.side * rng.uniform(0.0, 8.0, self.robot.nv)
        anywhere = rng.uniform(-8.0, 8.0, self.robot.nv)
        self.posture.target = np.where(rng.random(self.robot.nv) < 0.8, beyond, anywhere)
        if rng.random() < 0.5:
            first, second = rng.permutation([self.tool, self.turn, self.posture])[:2]
            self.stack.swap(first, second, duration=float(rng.choice([0.0, 0.03, 0.2])))

    def run(self, rng):
        """Largest distance beyond a limit, and of a speed beyond its own, until a tick says LOST."""
        passed, too_fast = -np.inf, -np.inf
        self.begin(rng)
        for tick in range(TICKS):
            if tick % 60 == 0:
                self.change(rng)
            q, v = self.plant.q, self.plant.v
            for side in self.limits.sides:
                passed = max(passed, side.sign * (q[side.index] - side.limit))
                too_fast = max(too_fast, side.sign * v[side.index] - side.speed)
            command = self.controller.step(self.t, q, v)
            self.t = round(self.t + DT, 9)
            assert Status.FAULT not in command.status
            if Status.LIMIT_LOST in command.status:
                return passed, too_fast, True
            for _ in range(self.steps):
                self.plant.advance(command.tau)
        return passed, too_fast, False


adversary = cache(Adversary)


def check(name, motors, steps, seed):
    passed, too_fast, lost = adversary(name, motors, steps).run(np.random.default_rng(seed))
    assert passed <= PASSED
    assert too_fast <= TOO_FAST
    # Without limits of the motors some torque always does it.
    assert motors == "priority" or not lost
    return lost


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("motors", MOTORS)
@pytest.mark.parametrize("name", ARMS)
@given(SEEDS)
@settings(max_examples=3)
def test_no_joint_passes_a_limit_that_it_could_respect(name, motors, steps, seed):
    check(name, motors, steps, seed)


@pytest.mark.slow
@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("motors", MOTORS)
@pytest.mark.parametrize("name", ARMS)
def test_not_in_two_hundred_runs_and_seldom_is_a_limit_lost(name, motors, steps):
    lost = [check(name, motors, steps, seed) for seed in range(200)]
    assert np.mean(lost) < 0.1
