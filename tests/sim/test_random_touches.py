"""Random programs of force and motion requests above random surfaces: no step, no chatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.sim import Disturbances
from tests.sim.touching import ROUGH

ROBOT = osc.load_robot("puma560")
SECONDS = 0.9
IDEAL = Disturbances()
SURFACES = st.tuples(
    st.floats(0.002, 0.02), st.floats(3.0, 5.0), st.floats(0.0, 0.5), st.floats(-0.2, 0.2)
)
"""How far below the tool, m; decade of the stiffness, N/m; friction; how much it leans, rad."""
REQUESTS = st.lists(
    st.tuples(
        st.sampled_from(["press", "press by touch", "spring", "hand", "swap", "force"]),
        st.floats(0.0, 0.8 * SECONDS),
        st.floats(0.1, 0.5),
    ),
    min_size=2,
    max_size=5,
)
"""What is asked for, when [s], and how long it takes [s]."""


@dataclass
class Course:
    """What one run gave, a row per tick.

    Attributes:
        tau: Torque, N·m.
        force: True size of the force, N.
        confidence: Of the force task.
    """

    tau: np.ndarray
    force: np.ndarray
    confidence: np.ndarray

    @property
    def step(self) -> float:
        """Largest step of a joint torque, N·m."""
        return float(np.max(np.abs(np.diff(self.tau, axis=0))))

    @property
    def touches(self) -> int:
        """How often the surface was touched."""
        touching = self.force > 0.0
        return int(touching[0]) + int(np.sum(touching[1:] & ~touching[:-1]))

    @property
    def crossings(self) -> int:
        """How often the confidence crossed a half."""
        sure = self.confidence > 0.5
        return int(np.sum(sure[1:] != sure[:-1]))


class Asked:
    """Makes requests: what is absent comes, what is present goes, on the way or not."""

    def __init__(self, stack, tasks):
        self.stack, self.tasks = stack, tasks
        self.levels = {"press": 0.0, "spring": 0.5, "upright": 1.0, "hand": 2.0}
        self.present = {"press", "upright", "hand"}

    def __call__(self, what, duration):
        """Make one request."""
        what = "press" if what == "press by touch" else what
        if what == "force":
            self.tasks["press"].force = -5.0 - 30.0 * (duration - 0.1)
        elif what == "swap":
            if "hand" in self.present:
                self.stack.swap("hand", "upright", duration)
                self.levels["hand"], self.levels["upright"] = (
                    self.levels["upright"], self.levels["hand"],
                )  # fmt: skip
        elif what in self.present:
            self.present.remove(what)
            self.stack.remove(what, duration)
        else:
            self.present.add(what)
            self.stack.insert(self.tasks[what], self.levels[what], duration)


def course(surface, requests, dt, disturbances=IDEAL):
    """Run a program with ticks of ``dt`` [s]."""
    robot = ROBOT.fresh()
    robot.update(robot.q_reference, np.zeros(robot.nv))
    tool = robot.frame_id(robot.tool)
    start, upright = robot.position(tool).copy(), robot.rotation(tool).copy()
    below, decade, friction, lean = surface
    press = osc.ForceTask(force=-8.0, axes_frame="world", name="press")
    if any(what == "press by touch" for what, *_ in requests):
        press.activation = osc.Contact(press)
    way = osc.MinimumJerk(start, start + [0.03, 0.05, -0.03], SECONDS)
    tasks = {
        "press": press,
        "upright": osc.OrientationTask(target=upright, kp=200.0, name="upright"),
        "hand": osc.PositionTask(target=osc.GiveWay(way, press), kp=200.0, name="hand"),
        "spring": osc.ImpedanceTask(target=start, stiffness=300.0, name="spring"),
    }
    stack = osc.Stack(
        [press, tasks["upright"], tasks["hand"], osc.PostureTask(ROBOT.q_reference, kp=20.0)]
    )
    controller = osc.Controller(robot, stack, period=dt)
    table = osc.Surface(
        start - [0.0, 0.0, below], [lean, 0.0, 1.0], stiffness=10.0**decade, friction=friction,
        damping=20.0,
    )  # fmt: skip
    plant = osc.Plant(robot, ROBOT.q_reference, dt=dt, surfaces=[table], disturbances=disturbances)
    asked = Asked(stack, tasks)
    waiting, rows = sorted(requests, key=lambda one: one[1]), []
    for i in range(round(SECONDS / dt)):
        while waiting and waiting[0][1] <= i * dt:
            what, _, value = waiting.pop(0)
            asked(what, value)
        command = controller.step(i * dt, *plant.measure(), wrenches=plant.wrenches())
        sure = press.touch.confidence if press.touch else 0.0
        rows.append((command.tau, np.linalg.norm(plant.exerted[:3]), sure))
        plant.advance(command.tau)
    return Course(*(np.array(column) for column in zip(*rows, strict=True)))


def check(surface, requests):
    """Hold a program against what is promised of all."""
    coarse, fine = (course(surface, requests, dt) for dt in (1e-3, 5e-4))
    # Half the tick, half the step; a request that begins with a tick is up to one late.
    assert fine.step <= 0.65 * coarse.step + 1e-3
    asked = sum(what.startswith("press") for what, *_ in requests)
    for run in (coarse, fine, course(surface, requests, 1e-3, ROUGH)):
        # A task that is put back begins without contact, so that coming and going count as touches.
        assert run.crossings <= 2 * (run.touches + asked)


@settings(max_examples=2)
@given(SURFACES, REQUESTS)
def test_no_program_steps_or_chatters_in_the_air_or_in_contact(surface, requests):
    check(surface, requests)


@pytest.mark.slow
@settings(max_examples=60)
@given(SURFACES, REQUESTS)
def test_no_program_of_many_steps_or_chatters(surface, requests):
    check(surface, requests)


def test_a_target_that_gives_way_does_so_smoothly_while_its_task_leaves_and_returns():
    """Whichever of the two is asked first in a tick; the force may turn round as well."""
    dt, speed = 1e-3, np.array([0.0, 0.05, 0.05])
    runs = []
    for press_first in (True, False):
        robot = ROBOT.fresh()
        x = np.array([0.6, -0.15, 0.7])
        press = osc.ForceTask(force=8.0, axes_frame="world")
        press.bind(robot)
        robot.update(ROBOT.q_reference, np.zeros(robot.nv))
        give = osc.GiveWay(lambda t, x=x: osc.Sample(x + speed * t, speed, np.zeros(3)), press)
        found = []
        for i in range(900):
            t, there = i * dt, not 300 <= i < 330 and not 600 <= i < 800
            if i in (330, 800):
                press.reset()
            if i == 450:
                press.force = -8.0
            press.take(t, np.array([0.0, 0.0, 8.0 if i < 500 else -8.0, 0.0, 0.0, 0.0]))
            if there and press_first:
                press.sense(robot, t)
            found.append(give(t))
            if there and not press_first:
                press.sense(robot, t)
        way, rate = (np.array([getattr(one, key) for one in found]) for key in ("x", "v"))
        assert np.max(np.abs(np.diff(way[2:], axis=0))) <= 0.1 * np.ptp(way[:, 2])
        assert np.max(np.abs(np.diff(rate[2:], axis=0))) <= 0.1 * speed[2]
        np.testing.assert_allclose(way[-1], give(900 * dt - dt).x)
        runs.append(way)
    np.testing.assert_allclose(*runs, atol=1e-12)
