"""G1 stands, leans over one foot, lifts the other, reaches, and lands: nothing steps."""

from collections import defaultdict

import numpy as np
import pytest

import opspace as osc
from opspace.sim import Disturbances, Ground, Push
from opspace.sim.disturbances import NO_DISTURBANCES

HALF, OFFSET = (0.085, 0.025), (0.035, 0.0, -0.035)
WEIGHT = 33.34114202 * 9.81
LIFTED = np.array([0.05, 0.0, 0.06])


class Show:
    """A standing G1 with everything that is asked of it, and what was measured on the way."""

    def __init__(self, hard=False, disturbances=NO_DISTURBANCES, tool=None):
        robot = self.robot = osc.load_robot("g1", tool=tool)
        self.soles = {
            side: osc.SoleContact(f"{side}_ankle_roll_link", HALF, offset=OFFSET, name=side)
            for side in ("left", "right")
        }
        robot.update(robot.q_reference, np.zeros(robot.nv))
        q = robot.q_reference.copy()
        q[2] -= robot.position("left_ankle_roll_link")[2] + OFFSET[2]
        robot.update(q, np.zeros(robot.nv))
        self.middle = robot.com_position().copy()
        self.over = self.middle + (0.03, 0.0, 0.0)
        self.over[1] = robot.position("left_ankle_roll_link")[1] - 0.018
        self.com = osc.ComTask(self.middle)
        self.foot = osc.PoseTask("right_ankle_roll_link", name="foot")
        self.hand = osc.PositionTask("right_rubber_hand", name="hand")
        tasks = [
            self.com,
            osc.OrientationTask("torso_link", name="torso"),
            osc.PostureTask(kp=25.0),
        ]
        limits = osc.JointLimits()
        self.stack = osc.Stack([limits, *tasks], contacts=list(self.soles.values()))
        self.controller = osc.Controller(robot, self.stack, torque_limits="priority")
        ground = Ground(list(self.soles.values()))
        self.plant = osc.Plant(robot, q, ground=ground, substeps=2, disturbances=disturbances)
        self.hard = hard
        self.steps, self.forces, self.errors = (defaultdict(float) for _ in range(3))
        self._tau, self._measured, self._planned = None, None, None

    def over_time(self, duration):
        return 0.0 if self.hard else duration

    def go(self, phase, seconds, until=lambda: False):
        """Run on, and tell the last command."""
        command, end = None, self.plant.t + seconds
        while self.plant.t < end - 1e-9 and not until():
            plant = self.plant
            command = self.controller.step(plant.t, plant.q, plant.v)
            if self._tau is not None:
                step = np.max(np.abs(command.tau - self._tau))
                self.steps[phase] = max(self.steps[phase], float(step))
            self._tau = command.tau
            self.errors[phase] = max(self.errors[phase], command.tasks["com"].error_norm)
            plant.advance(command.tau)
            measured = plant.contact_forces["right"]
            if self._measured is not None:
                step = float(np.max(np.abs(measured - self._measured)))
                self.forces[phase] = max(self.forces[phase], step)
            self._measured = measured
            assert measured[2] >= 0.0
            assert np.all(np.abs(command.tau) <= self.robot.torque_limit)
        return command

    def shift(self, start, goal, phase, seconds=2.0):
        self.com.target = osc.MinimumJerk(start, goal, seconds)
        return self.go(phase, seconds + 0.3)

    def lift(self, phase="lift"):
        self.robot.update(self.plant.q, self.plant.v)
        id_ = self.robot.frame_id("right_ankle_roll_link")
        # What the foot holds from here on, however far wrong masses let it sag.
        self.held = self.robot.position(id_).copy(), self.robot.rotation(id_).copy()
        self.stack.insert(self.foot, 0.5, 0.0)
        self.stack.remove("right", self.over_time(0.3))
        return self.go(phase, 0.5)

    def swing(self, phase, start, goal, seconds, until=lambda: False):
        """Move the foot from where it was told to be."""
        way = osc.MinimumJerk(start, goal, seconds)
        self.foot.target = osc.PoseReference(way, self.held[1])
        return self.go(phase, seconds + 0.2, until)

    def land(self):
        self.stack.insert(self.soles["right"], self.over_time(0.3))
        self.stack.remove(self.foot, self.over_time(0.3))
        return self.go("land", 0.6)

    def on_the_ground(self):
        return self.plant.contact_forces["right"][2] > 0.02 * WEIGHT


def show(*, hard=False, disturbances=NO_DISTURBANCES):
    """Everything once."""
    s = Show(hard, disturbances)
    s.go("stand", 0.3)
    s.shift(s.middle, s.over, "shift")
    s.lift()
    here = s.held[0]
    s.swing("swing", here, here + LIFTED, 1.0)
    s.robot.update(s.plant.q, s.plant.v)
    s.hand.target = s.robot.position("right_rubber_hand") + (0.07, 0.0, 0.05)
    s.stack.insert(s.hand, 1.5, s.over_time(0.5))
    s.go("hand in", 0.8)
    s.stack.remove(s.hand, s.over_time(0.5))
    s.go("hand out", 0.6)
    low = here + (0.05, 0.0, -0.03)
    s.swing("down", here + LIFTED, low, 3.0, s.on_the_ground)
    s.land()
    s.shift(s.over, s.middle, "back")
    return s


TRANSITIONS = ("lift", "hand in", "hand out")


@pytest.mark.slow
def test_nothing_steps_while_contacts_and_tasks_come_and_go():
    smooth, hard = show(), show(hard=True)
    print(dict(smooth.steps), dict(hard.steps), dict(smooth.forces), dict(smooth.errors))
    for phase in TRANSITIONS:
        assert smooth.steps[phase] <= 0.15, phase
        assert hard.steps[phase] >= 20.0 * smooth.steps[phase], phase
    assert smooth.steps["land"] <= 0.5
    assert smooth.forces["lift"] <= 1.0
    assert max(smooth.errors.values()) <= 2e-3
    assert smooth.plant.q[2] > 0.7


@pytest.mark.slow
@pytest.mark.parametrize("height", [-0.01, 0.01])
def test_it_lands_where_the_ground_is_not_where_it_was_expected(height):
    s = Show()
    s.go("stand", 0.2)
    s.shift(s.middle, s.over, "shift")
    s.lift()
    here = s.held[0]
    # A foot that is so much nearer to the ground than the plan says meets it so much earlier.
    nearer = np.array([0.0, 0.0, -height])
    s.swing("swing", here, here + LIFTED + nearer, 1.0)
    low = here + (0.05, 0.0, -0.04)
    s.swing("down", here + LIFTED + nearer, low + nearer, 3.0, s.on_the_ground)
    s.land()
    assert s.steps["land"] <= 1.5
    assert s.plant.q[2] > 0.7


@pytest.mark.slow
def test_a_foot_that_is_still_needed_waits_and_goes_when_it_is_not():
    s = Show()
    s.go("stand", 0.2)
    command = s.lift("early")
    assert osc.Status.CONTACT_WAITS in command.status
    assert 0.3 < command.contacts["right"].progress < 1.0
    assert s.steps["early"] <= 0.5
    assert s.errors["early"] <= 1e-3
    s.shift(s.middle, s.over, "going on")
    assert "right" not in s.stack.contacts
    assert s.steps["going on"] <= 0.5
    assert s.plant.q[2] > 0.7


@pytest.mark.slow
def test_a_lift_that_is_turned_around_half_way():
    s = Show()
    s.go("stand", 0.2)
    s.shift(s.middle, s.over, "shift")
    s.stack.insert(s.foot, 0.5, 0.0)
    s.stack.remove("right", 0.3)
    s.go("turned", 0.15)
    s.stack.insert(s.soles["right"], 0.3)
    s.go("turned", 0.1)
    s.stack.remove("right", 0.3)
    s.go("turned", 0.1)
    s.stack.insert(s.soles["right"], 0.3)
    command = s.go("turned", 0.4)
    assert command.contacts["right"].activation == 1.0
    assert s.steps["turned"] <= 0.15
    assert s.errors["turned"] <= 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_wrong_masses_move_the_robot_little_and_the_torque_not_in_steps(seed):
    s = show(disturbances=Disturbances(mass_error=0.1, seed=seed))
    assert max(s.steps.values()) <= 0.5
    assert max(s.errors.values()) <= 4e-3
    assert s.plant.q[2] > 0.7


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 1])
def test_a_push_of_eight_newton_seconds_at_the_pelvis(axis):
    push = Push(0.1, 0.1, 80.0 * np.eye(3)[axis])
    s = Show(disturbances=Disturbances(pushes=[push]), tool="pelvis")
    s.go("before", 0.1)
    s.go("pushed", 0.103)
    s.go("after", 1.0)
    assert s.steps["after"] <= 1.0
    assert max(s.errors.values()) <= 15e-3
    assert s.errors["after"] > 1e-3
    assert s.plant.q[2] > 0.7
