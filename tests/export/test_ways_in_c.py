"""Targets that are approached on ways are so in C as in Python, to the last bit."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.plan.plan import Plan
from opspace.tasks.rotation import exp_rotation
from tests.export.in_c import InC, with_cc
from tests.export.test_standing_in_c import standing
from tests.export.test_standing_in_c import states as standing_states
from tests.tasks.test_way_round import wrist

DT = 1e-3
PACED = {"max_speed": 0.5, "max_acceleration": 2.0}
BOTH = {"max_speed": (0.5, 1.0), "max_acceleration": (2.0, 4.0)}
LEARNS = {"ki": 200.0, "max_integral": 2e-3}


def hand_and_turn():
    hand = osc.PositionTask(axes="xz", axes_frame="tool", name="hand", **PACED, **LEARNS)
    return "puma560", [hand, osc.OrientationTask(name="turn", **PACED)]


def pose_and_joint():
    joint = osc.JointTask("panda_joint2", name="elbow", kp=50.0, **PACED, **LEARNS)
    return "panda", [osc.PoseTask(name="pose", **BOTH, **LEARNS), joint]


def relative_and_centre():
    seen = osc.RelativePoseTask(None, "forearm_link", name="seen", **BOTH)
    return "ur5", [osc.ComTask(name="centre", max_speed=0.05, max_acceleration=0.2), seen]


BUILDS = {
    "hand and turn": hand_and_turn,
    "pose and joint": pose_and_joint,
    "relative and centre": relative_and_centre,
}


class Both:
    """A controller and its copy in C, which are asked for the same and must answer the same."""

    def __init__(self, directory, name, tasks, kind=None, **options):
        self.tasks = [*tasks, osc.PostureTask(name="rest", kp=25.0, **PACED)]
        robot = osc.load_robot(name)
        self.stack = osc.Stack(self.tasks, limits=osc.JointLimits())
        self.controller = osc.Controller(robot, self.stack, period=DT)
        robot.update(robot.q_reference, np.zeros(robot.nv))
        self.here = {}
        for task in self.tasks:
            self.here[task.name] = task._current(robot).copy()
            task.target = self.here[task.name]
        self.chance = np.random.default_rng(3)
        self.c = InC(directory, self.controller, **options)
        self.k, self.clock, self.taus = 0, 0.0, []

    @property
    def t(self):
        return DT * self.k + self.clock

    def aim(self, i, target, velocity=None):
        task = self.tasks[i]
        task.set_target(target, velocity)
        goal = task._target.goal
        if goal.shape == (4, 4):
            goal = np.concatenate([goal[:3, 3], goal[:3, :3].ravel()])
        assert self.c.set("target", task, np.ascontiguousarray(goal), velocity, None) == 0

    def away(self, i, size):
        """A value of a task that is so far from where it was at first."""
        here = self.here[self.tasks[i].name]
        turn = exp_rotation(size * np.array([0.6, -0.3, 0.5]))
        if here.shape == (3, 3):
            return turn @ here
        if here.shape == (4, 4):
            there = here.copy()
            there[:3, 3] += 0.1 * size
            there[:3, :3] = turn @ here[:3, :3]
            return there
        return here + 0.1 * size

    def run(self, ticks):
        for _ in range(ticks):
            robot = self.controller.robot
            q = robot.q_reference + 2e-3 * self.chance.normal(size=robot.nq)
            v = 2e-3 * self.chance.normal(size=robot.nv)
            command, (status, tau) = (one.step(self.t, q, v) for one in (self.controller, self.c))
            np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {self.k}")
            assert status == command.status
            self.taus.append(tau)
            self.k += 1

    def restart(self, clock):
        self.controller.restart()
        self.c.restart()
        self.clock += clock

    def leave(self, i, duration):
        self.stack.remove(self.tasks[i], duration=duration, start_time=self.t)
        assert self.c.set("presence", self.tasks[i], 0, self.t, duration) == 0

    def come(self, i, level, duration):
        self.stack.insert(self.tasks[i], level, duration=duration, start_time=self.t)
        assert self.c.set("presence", self.tasks[i], 1, self.t, duration) == 0


@with_cc
@pytest.mark.parametrize("name", BUILDS)
def test_ways_begin_are_interrupted_and_end_alike(name, tmp_path):
    both = Both(tmp_path, *BUILDS[name]())
    both.aim(0, both.away(0, 0.4))  # before the first step: it begins where it finds the robot
    both.run(30)
    for i, size in ((0, -0.5), (1, 0.6), (2, 1.5)):  # on the way, from rest, a posture
        both.aim(i, both.away(i, size))
        both.run(40)
    both.aim(0, both.away(0, -0.5))  # the same again is the same way
    both.run(5)
    both.aim(0, both.away(0, 0.3))  # taken back before anybody has looked
    both.aim(0, both.away(0, -0.5))
    both.run(20)
    both.aim(0, both.away(0, 0.01), np.full(both.tasks[0]._motion_size, 1e-3))  # followed as it is
    both.run(10)
    both.aim(0, both.away(0, 0.1))
    both.run(30)
    last = both.stack.members[2].level
    both.leave(2, 0.01)
    both.run(4)
    both.come(2, last, 0.01)  # turned: it is where it was
    both.run(20)
    both.leave(2, 0.01)
    both.run(15)
    both.aim(2, both.away(2, -1.0))  # while it is not there
    both.run(3)
    both.come(2, last, 0.01)  # where it finds the robot
    both.run(30)
    both.restart(-3.0)
    both.aim(1, both.away(1, -0.3))
    both.run(1)
    both.aim(1, both.away(1, 0.2))
    assert all(both.t < task.way.end for task in both.tasks), "nobody has arrived"
    both.run(1500 if name == "pose and joint" else 30)
    arrived = [task.way.end < both.t for task in both.tasks]
    assert all(arrived) == (name == "pose and joint")
    for i in range(3):  # from where they have arrived, or all but
        both.aim(i, both.away(i, 0.4))
    both.run(30)


@with_cc
@pytest.mark.parametrize("seed", range(3))
def test_whatever_is_told_at_any_time_comes_out_the_same(seed, tmp_path):
    chance, name = np.random.default_rng(seed), list(BUILDS)[seed]
    both = Both(tmp_path, *BUILDS[name](), absent=["rest"] if seed == 1 else [])
    there = seed != 1
    level = both.stack.members[2].level
    if not there:
        both.stack.remove(both.tasks[2], duration=0.0)
    both.run(1)
    for _ in range(40):
        i, size = int(chance.integers(3)), float(chance.choice([-0.5, 0.0, 0.2, 0.7]))
        velocity = None
        if chance.random() < 0.2:
            velocity = 1e-3 * chance.normal(size=both.tasks[i]._motion_size)
        both.aim(i, both.away(i, size), velocity)
        if chance.random() < 0.2:
            if there:
                both.leave(2, 0.004)
            else:
                both.come(2, level, 0.004)
            there = not there
            both.run(1)
        if chance.random() < 0.1:
            both.restart(float(chance.choice([-0.2, 0.5, 7.25])))
            both.run(1)
        both.run(int(chance.integers(1, 12)) if chance.random() < 0.8 else 300)


@with_cc
def test_a_joint_without_end_goes_the_short_way(tmp_path):
    task = osc.JointTask("j1", max_speed=3.0, max_acceleration=10.0)
    robot = osc.load_robot(wrist(tmp_path))
    controller = osc.Controller(robot, osc.Stack([task, osc.PostureTask(np.zeros(3))]))
    task.target = 2.9
    c = InC(tmp_path / "c", controller)
    q, v = np.array([3.0, 0.0, 0.0]), np.zeros(3)
    for k in range(400):
        if k in (100, 200):
            task.target = -3.0 if k == 100 else 5.5
            assert c.set("target", task, task.target, None, None) == 0
        q[0] += 0.02 if 150 < k < 300 else 0.0
        command, (status, tau) = controller.step(0.01 * k, q, v), c.step(0.01 * k, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status


@with_cc
def test_what_cannot_be_approached_is_refused_and_nothing_begins(tmp_path):
    both, other = (Both(tmp_path / one, *hand_and_turn()) for one in ("c", "d"))
    hand, turn, _ = both.tasks
    bad = np.array([0.1, np.nan, 0.2])
    both.run(20)
    other.run(20)
    assert both.c.set("target", hand, bad, None, None) == -3
    assert both.c.set("target", hand, np.zeros(3), bad, None) == -3
    assert both.c.set("target", turn, np.zeros(9), None, None) == -3
    with pytest.raises(osc.InputError):
        hand.target = bad
    both.run(20)
    other.run(20)
    np.testing.assert_array_equal(both.taus, other.taus)


def test_a_goal_that_is_no_number_brakes_until_there_is_one_again():
    hand = osc.PositionTask(**PACED)
    robot = osc.load_robot("puma560")
    controller = osc.Controller(robot, osc.Stack([hand, osc.PostureTask()]))
    q, v = robot.q_reference, np.zeros(6)
    controller.step(0.0, q, v)
    robot.update(q, v)
    hand.target = robot.position(robot.tool) + 0.1
    controller.step(DT, q, v)
    led = controller._plan.tick.led
    kept, led.ends[:] = led.ends.copy(), 0.0
    good, led.goal[:] = led.goal.copy(), np.nan
    assert osc.Status.FAULT in controller.step(2.0 * DT, q, v).status
    led.ends[:], led.goal[:] = kept, good
    assert controller.step(3.0 * DT, q, v).status == 0


@with_cc
def test_a_robot_that_stands_leans_on_ways_alike(tmp_path):
    controller, *_ = standing("solo12")
    tasks = list(controller.stack)
    for task in tasks:
        task.max_speed, task.max_acceleration = 0.2, 1.0
    c = InC(tmp_path, controller)
    for k, t, q, v in standing_states(controller.robot, 60, 0.01):
        for task in tasks:
            if k in (10, 25):
                turn = task.target.ndim == 2
                goal = exp_rotation(np.full(3, 0.1)) @ task.target if turn else task.target + 0.03
                task.target = goal
                assert c.set("target", task, task._target.goal, None, None) == 0
        command, (status, tau) = controller.step(t, q, v), c.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status


def torques(kind, name, backend, changes, dt=0.01):
    """Torques of either form while targets jump; changes(k, stack, guest) happen before tick k."""
    robot_name, tasks = BUILDS[name]()
    robot = osc.load_robot(robot_name, backend=backend)
    tasks.append(osc.PostureTask(name="rest", kp=25.0, **PACED))
    controller = kind(robot, osc.Stack(tasks))
    robot.update(robot.q_reference, np.zeros(robot.nv))
    here = [task._current(robot).copy() for task in tasks]
    guest, found = osc.PostureTask(robot.q_reference, name="guest"), []
    for k in range(60):
        changes(k, controller.stack, guest)
        for task, x in zip(tasks, here, strict=True):
            if k in (5, 20, 38):
                goal = x + 0.002 * k if x.ndim == 1 else x.copy()
                if x.ndim == 2:
                    goal[:3, :3] = exp_rotation(np.array([0.01 * k, 0.0, 0.2])) @ x[:3, :3]
                task.target = goal
        q = robot.q_reference + 1e-3 * np.sin(np.arange(robot.nq) + 0.1 * k)
        found.append(controller.step(dt * k, q, np.zeros(robot.nv)).tau)
        assert all(task.way is not None for task in tasks) == (k >= 5)
        if kind is osc.Controller:
            assert (controller._plan is not None) == Plan.fits(controller.stack.members)
    return found


@pytest.mark.parametrize("name", BUILDS)
@pytest.mark.parametrize(
    ("backend", "dt"), [("pinocchio", 0.01), ("mujoco", 0.01), ("pinocchio", 0.1)]
)
def test_the_readable_form_goes_the_same_ways(name, backend, dt):
    """Also where the robot's library places its bodies, and from where they have arrived."""
    ours, readable = (
        torques(kind, name, backend, lambda *_: None, dt)
        for kind in (osc.Controller, ReferenceController)
    )
    np.testing.assert_allclose(ours, readable, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", BUILDS)
def test_either_form_goes_on_with_the_ways_of_the_other(name, monkeypatch):
    """From the compiled tick to the readable one and back, always on ways."""

    def changes(k, stack, guest):
        compiled = not 30 <= k < 45
        monkeypatch.setattr(Plan, "fits", staticmethod(lambda *_: compiled))
        if k == 30:
            stack.insert(guest, 5.0, duration=0.05)
        if k == 45:
            stack.remove(guest, duration=0.05)

    ours, readable = (
        torques(kind, name, "pinocchio", changes) for kind in (osc.Controller, ReferenceController)
    )
    np.testing.assert_allclose(ours, readable, rtol=1e-9, atol=1e-9)
