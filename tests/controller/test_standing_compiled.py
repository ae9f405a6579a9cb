"""A robot that stands: the compiled tick against the readable one."""

import pickle
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.controller.reference import ReferenceController
from opspace.errors import InputError

HALF, OFFSET = (0.085, 0.025), (0.035, 0.0, -0.035)
DT = 0.01
SOFT_ACCURACY = 1e-3
"""Where limits contradict each other, their softness makes the equations that badly conditioned."""


def humanoid(ankle, half, offset, hand, rests=osc.PointContact):
    """Two soles that stand, and a hand that may come, with what such a robot does."""

    def make():
        contacts = [
            osc.SoleContact(ankle.format(side), half, offset=offset, name=side)
            for side in ("left", "right")
        ]
        wall = rests(hand, normal=(-1.0, 0.0, 0.2), force=20.0, name="wall")
        tasks = [
            osc.ComTask(kp=50.0),
            [osc.PositionTask(hand, name="hand"), osc.AngularMomentumTask()],
            osc.PostureTask(kp=25.0),
        ]
        return tasks, contacts, wall

    return make


def quadruped():
    """Four points that stand, one of which comes and goes."""
    feet = [osc.PointContact(f, friction=0.8) for f in ("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT")]
    tasks = [osc.ComTask(), osc.OrientationTask("base_link", name="trunk"), osc.PostureTask()]
    return tasks, feet[1:], feet[0]


ROBOTS = {
    "g1": humanoid("{}_ankle_roll_link", HALF, OFFSET, "right_rubber_hand"),
    "talos": humanoid(
        "{}_sole_link",
        (0.1, 0.06),
        (0.0, 0.0, 0.0),
        "wrist_left_ft_tool_link",
        partial(osc.EdgeContact, half=0.05, along=(0.2, 1.0, 0.3), offset=(0.0, 0.01, 0.05)),
    ),
    "solo12": quadruped,
}


class Twins:
    """The same robot on the same contacts twice, run by either form."""

    def __init__(self, name, limits=osc.JointLimits, backend="pinocchio", **options):
        self.controllers, self.others = [], []
        for kind in (osc.Controller, ReferenceController):
            tasks, contacts, other = ROBOTS[name]()
            stack = osc.Stack(tasks, limits(), contacts)
            robot = osc.load_robot(name, backend=backend)
            self.controllers.append(kind(robot, stack, **options))
            self.others.append(other)
        self.robot = self.controllers[0].robot
        self.stacks = [c.stack for c in self.controllers]

    def step(self, t, q, v):
        ours, readable = (c.step(t, q, v) for c in self.controllers)
        lost = osc.Status.LIMIT_LOST in readable.status
        size = 1.0 + np.max(np.abs(readable.tau))
        near = (SOFT_ACCURACY if lost else 1e-8) * size
        assert np.max(np.abs(ours.tau - readable.tau)) <= near
        assert np.all(ours.tau[:6] == 0.0)
        if lost:
            assert osc.Status.LIMIT_LOST in ours.status
            return ours
        assert ours.status == readable.status
        assert ours.hard_solves == readable.hard_solves
        assert ours.limits.keys() == readable.limits.keys()
        assert list(ours.contacts) == list(readable.contacts)
        for name, told in readable.contacts.items():
            own = ours.contacts[name]
            assert abs(own.progress - told.progress) < 1e-7
            assert abs(own.motion - told.motion) < 1e-6
            assert abs(own.activation - told.activation) < 1e-6
            assert own.waiting == told.waiting
            for what in ("force", "moment"):
                moved = np.max(np.abs(getattr(own, what) - getattr(told, what)))
                assert moved <= 10.0 * near + 1e-6 * size * (own.progress != told.progress)
            if told.force @ told.force > 1e-2:
                assert np.max(np.abs(own.cop - told.cop)) < 1e-5
                assert abs(own.cone_use - told.cone_use) < 1e-5
        for name, task in readable.tasks.items():
            assert np.allclose(ours.tasks[name].error, task.error, rtol=0.0, atol=1e-10)
        return ours


def state(robot, rng, bend=0.1, speed=0.3):
    q = robot.integrate(robot.q_reference, rng.normal(0.0, bend, robot.nv), 1.0)
    return q, rng.normal(0.0, speed, robot.nv)


requests = st.lists(
    st.tuples(
        st.sampled_from(
            ["insert", "remove", "force out", "out", "swap", "wanted", "friction", "calm"]
        ),
        st.sampled_from([0.0, 0.02, 0.05]),
        st.integers(1, 3),
    ),
    min_size=1,
    max_size=4,
)


@pytest.mark.parametrize("name", ROBOTS)
@given(asked=requests, seed=st.integers(0, 1000), speed=st.sampled_from([0.0, 0.2, 0.6]))
@settings(max_examples=3, deadline=None)
def test_both_forms_agree_whatever_is_asked(name, asked, seed, speed):
    rng = np.random.default_rng(seed)
    twins = Twins(name, torque_limits="priority")
    tick = 0
    q, v = state(twins.robot, rng, 0.1, speed)
    twins.step(0.0, q, v)
    for what, duration, ticks in asked:
        for stack, other in zip(twins.stacks, twins.others, strict=True):
            first = next(iter(stack.contacts))
            if what == "insert":
                stack.insert(other, duration)
            elif what == "remove":
                stack.remove(first, duration)
            elif what == "force out":
                stack.remove(first, duration, wait=False)
            elif what == "out" and other.name in stack.contacts:
                stack.remove(other, duration)
            elif what == "swap":
                stack.swap("com", "posture", duration)
            elif what == "wanted":
                other.force = 12.0
            elif what == "friction":
                stack.contacts[first].friction = 0.3
            elif what == "calm" and "angular_momentum" in [task.name for task in stack]:
                stack["angular_momentum"].kv = 3.0
            if not stack.contacts:
                return
        for _ in range(ticks):
            tick += 1
            twins.step(tick * DT, *state(twins.robot, rng, 0.1, speed))


@pytest.mark.parametrize("name", ["g1", "solo12"])
@pytest.mark.parametrize(
    "options",
    [
        {"singularity": osc.Singularity(), "limits": lambda: None},
        {"backend": "mujoco", "blending": "chain"},
        {"limits": lambda: osc.JointLimits(mode="buffer")},
        {
            "limits": lambda: osc.JointLimits(observer_time=0.1),
            "torque_limits": "priority",
            "period": DT,
        },
    ],
    ids=["singular", "mujoco", "buffer", "observer"],
)
def test_both_forms_agree_with_other_options(name, options):
    twins, rng = Twins(name, **options), np.random.default_rng(3)
    for stack, other in zip(twins.stacks, twins.others, strict=True):
        stack.insert(other, 0.04)
    for i in range(4):
        q, v = state(twins.robot, rng)
        near = rng.integers(8, twins.robot.nq, 2)
        reachable = np.isfinite(twins.robot.q_upper[near - 1])
        q[near[reachable]] = twins.robot.q_upper[near[reachable] - 1] - 0.02
        twins.step(i * DT, q, v)


def test_in_the_air_and_with_one_point_both_forms_agree():
    """Forces cannot give every wrench: the rank of the equations falls."""
    twins, rng = Twins("solo12"), np.random.default_rng(5)
    for i, left in enumerate([3, 2, 1, 0]):
        for stack in twins.stacks:
            for name in list(stack.contacts)[left:]:
                stack.remove(name, 0.0, wait=False)
        twins.step(i * DT, *state(twins.robot, rng))


def test_a_posture_that_names_the_base_and_a_long_quaternion_are_the_same_in_both_forms():
    twins, rng = Twins("g1"), np.random.default_rng(2)
    for stack in twins.stacks:
        stack.insert(osc.PostureTask(joints=["floating_base"], name="base"), 0.5, 0.0)
    q, v = state(twins.robot, rng)
    once = twins.step(0.0, q, v).tau
    q[3:7] *= 3.0
    assert np.max(np.abs(twins.step(DT, q, v).tau - once)) < 1e-9
    assert abs(np.linalg.norm(twins.robot.q[3:7]) - 1.0) < 1e-15
    for wrong, what in ((0.0, "length zero"), (np.nan, "is nan")):
        q[3:7] = wrong
        with pytest.raises(InputError, match=what):
            twins.controllers[0].step(2 * DT, q, v)


HOVERING = """<mujoco><worldbody><body name="trunk" pos="0 0 1"><freejoint/>
<geom type="box" size=".2 .1 .1" mass="4"/>
<body name="arm" pos=".2 0 0" gravcomp="1"><joint name="a" axis="0 1 0" range="-2 2"/>
<geom type="capsule" size=".03" fromto="0 0 0 .3 .1 0" mass="1"/></body>
<body name="leg" pos="0 0 -.1"><joint name="l" axis="1 0 0" range="-2 2"/>
<geom type="capsule" size=".03" fromto="0 0 0 0 .05 -.3" mass="1"/></body>
</body></worldbody>
<actuator><motor joint="a" ctrlrange="-50 50"/><motor joint="l" ctrlrange="-50 50"/></actuator>
</mujoco>"""


def test_weight_that_is_carried_turns_a_robot(tmp_path):
    file = tmp_path / "hovering.xml"
    file.write_text(HOVERING, encoding="utf-8")
    rng = np.random.default_rng(0)
    for backend in ("mujoco", "pinocchio"):
        commands = []
        robot = osc.load_robot(file, backend=backend)
        q, v = state(robot, rng)
        for kind in (osc.Controller, ReferenceController):
            tasks = [osc.AngularMomentumTask(kv=2.0), osc.PostureTask()]
            stack = osc.Stack(tasks, contacts=[osc.PointContact("leg", offset=(0.0, 0.0, -0.3))])
            controller = kind(robot, stack)
            commands.append(controller.step(0.0, q, v))
        ours, readable = commands
        # One point cannot carry every wrench: a part of the trace stands in for the rest.
        assert np.max(np.abs(ours.tau - readable.tau)) < 1e-7 * np.max(np.abs(readable.tau))
        assert ours.status == readable.status


class Cautious(osc.SoleContact):
    """A contact of one's own, with half the friction."""

    def cone(self):
        found = super().cone()
        found[:4, 2] *= 0.5
        return found


def test_contacts_of_ones_own_take_the_readable_form_and_more_than_there_is_room_for_get_it():
    twins, rng = Twins("g1"), np.random.default_rng(4)
    many = [f"left_{part}_link" for part in ("elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")]
    twins.step(0.0, *state(twins.robot, rng))
    for stack in twins.stacks:
        stack.insert(Cautious("left_rubber_hand", HALF, name="own"), 0.0)
    twins.step(DT, *state(twins.robot, rng))
    assert twins.controllers[0]._laid_out is None
    for stack in twins.stacks:
        stack.remove("own", 0.0)
        for frame in [*many, "pelvis", "torso_link"]:
            stack.insert(osc.PointContact(frame), 0.03)
    for i in range(3):
        twins.step((2 + i) * DT, *state(twins.robot, rng))
    assert twins.controllers[0]._laid_out is not None


def test_a_batch_computes_what_the_next_tick_would():
    twins, rng = Twins("solo12", torque_limits="priority"), np.random.default_rng(6)
    controller, stack, other = twins.controllers[0], twins.stacks[0], twins.others[0]
    stack.insert(other, 0.1)
    states = [state(twins.robot, rng) for _ in range(5)]
    for i in range(3):
        controller.step(i * 0.02, *states[i])
    Q, V = (np.array(part) for part in zip(*states, strict=True))
    found = controller.torque_batch(Q, V, threads=2)
    for (q, v), tau in zip(states, found, strict=True):
        assert np.max(np.abs(controller.step(0.04, q, v).tau - tau)) < 1e-9
    other.activation = lambda _robot, _t: 0.5
    with pytest.raises(InputError, match="'FL_FOOT' has an activation of its own"):
        controller.torque_batch(Q, V)
    del other.activation
    for extra in ("FL_UPPER_LEG", "FR_UPPER_LEG", "HL_UPPER_LEG"):
        stack.insert(osc.PointContact(extra), 0.0)
    controller.step(0.06, *states[0])
    many = controller.torque_batch(Q, V)
    assert np.max(np.abs(controller.step(0.06, *states[1]).tau - many[1])) < 1e-9


def test_what_a_command_tells_of_contacts_can_be_copied():
    command = Twins("g1").step(0.0, *state(osc.load_robot("g1"), np.random.default_rng(0)))
    told = pickle.loads(pickle.dumps(command)).contacts
    assert list(told) == ["left", "right"]
    assert np.array_equal(told["left"].force, command.contacts["left"].force)
