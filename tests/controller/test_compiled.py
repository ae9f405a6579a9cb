"""The compiled tick against the readable one."""

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.command import Status
from opspace.controller import Controller, ReferenceController
from opspace.loop import simulate
from opspace.plan.scales import Singularity
from opspace.robots import available_robots, load_robot
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario
from opspace.stack import Stack
from opspace.tasks import (
    ComTask,
    JointBuffer,
    JointLimits,
    JointTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    RelativeOrientationTask,
    RelativePoseTask,
    RelativePositionTask,
    Sample,
    Task,
    TaskTerms,
)
from tests.budget import examples
from tests.stack.arm import state, tasks_for
from tests.stack.programs import Program, programs, running_of

DT = 1e-3
PANDA = any(info.name == "panda" and info.installed for info in available_robots())
ROBOTS = [("puma560", "pinocchio"), ("puma560", "mujoco"), *([("panda", "pinocchio")] * PANDA)]


def assert_same(ours, readable):
    scale = max(1.0, float(np.max(np.abs(readable.tau))))
    np.testing.assert_allclose(ours.tau, readable.tau, rtol=0, atol=1e-9 * scale)
    assert ours.status == readable.status
    assert ours.hard_solves == readable.hard_solves
    assert list(ours.tasks) == list(readable.tasks)
    for name, task in readable.tasks.items():
        assert ours.tasks[name].activation == pytest.approx(task.activation, abs=1e-14)
        assert [level for level, _ in ours.tasks[name].levels] == [n for n, _ in task.levels]
        np.testing.assert_allclose(
            [w for _, w in ours.tasks[name].levels], [w for _, w in task.levels], atol=1e-12
        )
        np.testing.assert_allclose(ours.tasks[name].error, task.error, rtol=0, atol=1e-10)
    assert ours.limits.keys() == readable.limits.keys()
    for name, h in readable.limits.items():
        assert ours.limits[name] == pytest.approx(h, abs=1e-9)


def assert_same_levels(ours, readable):
    assert len(ours.levels) == len(readable.levels)
    for a, b in zip(ours.levels, readable.levels, strict=True):
        assert (a.level, a.tasks, a.directions.shape) == (b.level, b.tasks, b.directions.shape)
        assert a.scale == pytest.approx(b.scale, abs=1e-9)
        np.testing.assert_allclose(a.sigma, b.sigma, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(a.activation, b.activation, rtol=0, atol=1e-7)
        # Vectors are known up to their sign only, and not at all where values coincide.
        np.testing.assert_allclose(
            a.directions * a.sigma @ a.directions.T, b.directions * b.sigma @ b.directions.T,
            atol=1e-8 * max(1.0, float(np.max(b.sigma, initial=0.0))),
        )  # fmt: skip


@functools.cache
def loaded(name, backend):
    return load_robot(name, backend=backend)


def with_robots(values, robots=ROBOTS):
    """Every value with some robot and every robot with some value; the other pairs are slow."""
    return [
        pytest.param(robot, value, id=f"{'-'.join(robot)}-{value}", marks=[pytest.mark.slow] * odd)
        for i, robot in enumerate(robots)
        for k, value in enumerate(values)
        for odd in [(i + k) % 2]
    ]


class Twins:
    """The same stack twice, run by either form on a robot of its own."""

    def __init__(self, robot, make, **options):
        self.stacks = [Stack(make()), Stack(make())]
        self.ours = Controller(loaded(*robot).fresh(), self.stacks[0], **options)
        self.readable = ReferenceController(loaded(*robot).fresh(), self.stacks[1], **options)
        self.robot = self.ours.robot

    def step(self, t, q, v, levels=True):
        ours, readable = self.ours.step(t, q, v), self.readable.step(t, q, v)
        assert_same(ours, readable)
        if levels:
            assert_same_levels(ours, readable)
        return ours

    def random_state(self, rng, spread=0.5):
        n = self.robot.nv
        return self.robot.q_reference + rng.uniform(-spread, spread, n), rng.uniform(-1, 1, n)


class Spring(Task):
    """A task of one's own: pulls the tool's height to 0.5 m."""

    def __init__(self):
        super().__init__("spring", rows=1, units=("m",))

    def bind(self, robot):
        self.frame = robot.frame_id(robot.tool)

    def evaluate(self, robot, t):
        height = robot.position(self.frame)[2]
        J = robot.jacobian(self.frame)[2:3]
        error = np.array([0.5 - height])
        return TaskTerms(J, robot.drift(self.frame)[2:3], 50.0 * error - 5.0 * J @ robot.v, error)


def circle(t):
    return Sample(
        np.array([0.4, 0.1 * np.sin(t), 0.4]),
        np.array([0.0, 0.1 * np.cos(t), 0.0]),
        np.array([0.0, -0.1 * np.sin(t), 0.0]),
    )


def frame_of(robot):
    """A link half-way along the arm."""
    name, backend = robot
    return load_robot(name, backend=backend).frame_names[4]


KINDS = {
    "position": lambda r: [PositionTask(axes="xz", max_speed=0.3)],
    "offset": lambda r: [PositionTask(offset=[0.1, 0.02, -0.03], target=[0.4, 0.1, 0.3])],
    "tool axes": lambda r: [PositionTask(axes="zy", axes_frame="tool", target=[0.4, 0.1, 0.3])],
    "orientation": lambda r: [OrientationTask(target=np.eye(3), max_speed=0.8)],
    "turned": lambda r: [OrientationTask(axes="xy", axes_frame="tool", target=np.eye(3))],
    "pose": lambda r: [
        PoseTask(kp_linear=80, kp_angular=30, max_speed=(0.2, 0.5), target=np.eye(4))
    ],
    "pose in tool axes": lambda r: [PoseTask(axes_frame="tool", target=np.eye(4))],
    "relative position": lambda r: [RelativePositionTask(None, frame_of(r), axes="xy")],
    "relative orientation": lambda r: [
        RelativeOrientationTask(None, frame_of(r), target=np.eye(3))
    ],
    "relative pose": lambda r: [RelativePoseTask(None, frame_of(r), target=np.eye(4))],
    "centre of mass": lambda r: [ComTask(axes="xz", target=[0.1, 0.0, 0.4])],
    "joint": lambda r: [JointTask(load_robot(r[0]).joint_names[2], 0.3, max_speed=0.2)],
    "some joints": lambda r: [
        PostureTask(joints=load_robot(r[0]).joint_names[1:4], max_speed=0.3, name="three")
    ],
    "reference in time": lambda r: [PositionTask(target=circle)],
    "own": lambda r: [Spring()],
    "several": lambda r: [
        [PositionTask(axes="z", target=[0, 0, 0.4]), OrientationTask(axes="x")],
        ComTask(axes="x"),
        JointTask(load_robot(r[0]).joint_names[0], 0.2),
    ],
    "nothing": lambda r: [],
}


@pytest.mark.parametrize(("robot", "posture"), with_robots([True, False]))
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_task(robot, kind, posture):
    twins = Twins(robot, lambda: [JointLimits(), *KINDS[kind](robot), *([PostureTask()] * posture)])
    rng = np.random.default_rng(1)
    for k in range(12):
        twins.step(k * DT, *twins.random_state(rng))


OPTIONS = {
    "task bias": {"bias": "task"},
    "no buffer": {"singularity": None},
    "absolute buffer": {"singularity": Singularity(0.01, 0.5, scale="absolute", profile="cubic")},
    "wide buffer": {"singularity": Singularity(0.5, 30.0, profile="half-sine")},
    "no damping": {"damping": 0.0},
    "torque limits": {"torque_limits": "priority"},
    "torque limits, task bias": {"torque_limits": "priority", "bias": "task"},
}


@pytest.mark.parametrize(("robot", "mode"), with_robots(["admissible", "buffer"]))
@pytest.mark.parametrize("option", OPTIONS)
def test_every_option(robot, option, mode):
    def make():
        height = PositionTask(axes="z", name="height", target=[0, 0, 0.2])
        height.activation = JointBuffer(load_robot(robot[0]).joint_names[1], -0.2, 0.9)
        return [
            JointLimits(0.5, mode=mode),
            height,
            [OrientationTask(), PositionTask(target=[0.6, 0, 0.6])],
        ]

    twins = Twins(robot, make, **OPTIONS[option])
    rng = np.random.default_rng(2)
    for k in range(25):
        # Also where several joints are near and beyond their limits.
        q, v = twins.random_state(rng, spread=3.0)
        twins.step(k * DT, q, 2.0 * v)


def test_many_joints_at_their_limits():
    twins = Twins(ROBOTS[0], lambda: [JointLimits(), PositionTask(), PostureTask()])
    robot = twins.robot
    found = set()
    rng = np.random.default_rng(3)
    for k in range(100):
        side = np.where(rng.random(robot.nv) < 0.5, robot.q_lower, robot.q_upper)
        q = np.where(np.isfinite(side), side + rng.normal(0, 0.1, robot.nv), 0.0)
        found.add(len(twins.step(k * DT, q, rng.normal(0, 1.0, robot.nv)).limits))
    assert max(found) >= 4


@examples(10)
@given(
    steps=programs(0.002, 0.06),
    seed=st.integers(0, 2**32 - 1),
    blending=st.sampled_from(["auto", "idv", "chain", "smooth-chain"]),
)
def test_random_programs_of_requests(steps, seed, blending):
    robot = ROBOTS[-1]
    arms = [load_robot(robot[0]) for _ in range(2)]
    tasks = [tasks_for(arm) for arm in arms]
    stacks = [Stack({0: t[:1], 2: t[6:]}) for t in tasks]
    ours = Controller(arms[0], stacks[0], blending=blending)
    readable = ReferenceController(arms[1], stacks[1], blending=blending)
    initial = {tasks[0][0].name: 0.0, tasks[0][6].name: 2.0}
    plays = [Program(s, t, steps, initial, overlap=5) for s, t in zip(stacks, tasks, strict=True)]
    q, v = state(arms[0], seed)
    for k in range(90):
        members = [s.begin_tick(k * DT) for s in stacks]
        for play, present in zip(plays, members, strict=True):
            here = {m.task.name for m in present}
            play.play(k, here, running_of(present, k * DT))
        t = (k + 0.5) * DT
        a, b = ours.step(t, q, v), readable.step(t, q, v)
        scale = max(1.0, float(np.max(np.abs(b.tau))))
        np.testing.assert_allclose(a.tau, b.tau, rtol=0, atol=1e-9 * scale)
        assert {n: s.levels for n, s in a.tasks.items()}.keys() == b.tasks.keys()
        for name, task in b.tasks.items():
            np.testing.assert_allclose(a.tasks[name].levels, task.levels, atol=1e-12)
        q, v = q + 2e-3 * v, v * np.cos(k * 0.1)


def test_what_is_changed_while_it_runs():
    def make():
        return [PositionTask(), OrientationTask(), PostureTask()]

    twins = Twins(ROBOTS[-1], make)
    q, v = state(twins.robot)
    twins.step(0.0, q, v)
    changes = [
        lambda p, o, j: setattr(p, "target", [0.3, 0.2, 0.5]),
        lambda p, o, j: p.set_target([0.3, 0.2, 0.4], [0.1, 0, 0], [0, 0, 1.0]),
        lambda p, o, j: setattr(p, "kp", 33.0),
        lambda p, o, j: setattr(p, "kv", 2.0),
        lambda p, o, j: setattr(p, "max_speed", 0.1),
        lambda p, o, j: setattr(p, "max_speed", None),
        lambda p, o, j: setattr(p, "target", circle),
        lambda p, o, j: setattr(p, "target", None),
        lambda p, o, j: setattr(o, "target", np.diag([1.0, -1.0, -1.0])),
        lambda p, o, j: setattr(o, "activation", lambda robot, t: min(1.0, 10.0 * t)),
        lambda p, o, j: setattr(o, "activation", None),
        lambda p, o, j: setattr(j, "kp", np.linspace(10, 20, len(q))),
    ]
    before = twins.step(DT, q, v).tau
    for k, change in enumerate(changes, start=2):
        for stack in twins.stacks:
            change(*stack)
        q = q + 5e-3 * v
        after = twins.step(k * DT, q, v).tau
        assert not np.array_equal(before, after)
        before = after


class Late(PositionTask):
    """Has an activation from some moment on, without an assignment."""

    begun = False

    @property
    def activation(self):
        return (lambda robot, t: 0.7) if self.begun else None


def test_a_class_may_decide_anew_whether_its_tasks_have_an_activation():
    twins = Twins(ROBOTS[-1], lambda: [Late(), OrientationTask(), PostureTask()])
    q, v = state(twins.robot)
    assert twins.step(0.0, q, v).tasks["position"].activation == 1.0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Late, "begun", True)
        assert twins.step(DT, q, v).tasks["position"].activation == 0.7
    assert twins.step(2 * DT, q, v).tasks["position"].activation == 1.0


class Silent(PositionTask):
    """Tells nobody what is assigned to it."""

    def __setattr__(self, name, value):
        object.__setattr__(self, name, value)


def test_a_task_that_tells_nobody_of_its_changes_is_followed():
    twins = Twins(ROBOTS[-1], lambda: [Silent(), PostureTask()])
    q, v = state(twins.robot)
    before = [twins.step(k * DT, q, v).tau for k in range(3)][-1]
    for stack in twins.stacks:
        next(iter(stack)).target = [0.3, 0.2, 0.5]
    assert not np.array_equal(before, twins.step(3 * DT, q, v).tau)


def test_what_a_reference_assigns_to_another_task_is_followed_in_the_same_tick():
    twins = Twins(ROBOTS[-1], lambda: [OrientationTask(), PositionTask(), PostureTask()])
    q, v = state(twins.robot)
    twins.step(0.0, q, v)

    def leading(stack):
        orientation, position, _ = stack

        def reference(t):
            if t > 2.5 * DT:
                position.target = [0.3, 0.2, 0.5]
            return Sample(np.eye(3), np.zeros(3), np.zeros(3))

        orientation.target = reference

    for stack in twins.stacks:
        leading(stack)
    for k in range(1, 6):
        twins.step(k * DT, q, v)


def test_gains_and_rates_cannot_be_changed_in_place():
    task = PositionTask(kp=[10.0, 20.0, 30.0])
    for found in (task.kp, task.kv, task.target_velocity, task.target_acceleration):
        with pytest.raises(ValueError, match="read-only"):
            found[...] = 1.0


def test_robot_and_stack_of_a_controller_stay():
    controller = Controller(load_robot("puma560"), Stack([PositionTask()]))
    for name in ("robot", "stack"):
        with pytest.raises(AttributeError):
            setattr(controller, name, getattr(controller, name))


def test_an_answer_stays_what_it_is_whatever_is_done_to_another():
    twins = Twins(ROBOTS[-1], lambda: [PositionTask(), OrientationTask(), PostureTask()])
    q, v = state(twins.robot)
    first = twins.step(0.0, q, v)
    tau, error = first.tau.copy(), first.tasks["position"].error.copy()
    first.tasks["posture"].error[:] = np.nan
    second = twins.step(DT, q + 0.01, v)
    second.tau[:] = np.nan
    second.tasks["position"].error[:] = np.nan
    np.testing.assert_array_equal(first.tau, tau)
    np.testing.assert_array_equal(first.tasks["position"].error, error)
    assert np.isfinite(twins.step(2 * DT, q, v).tau).all()


def test_a_rotation_past_half_a_turn_keeps_its_way():
    twins = Twins(ROBOTS[0], lambda: [OrientationTask()])
    q, v = twins.robot.q_reference.copy(), np.zeros(6)
    largest = 0.0
    for k in range(250):
        q[0] += 0.02
        task = twins.step(k * DT, q, v).tasks["orientation"]
        largest = max(largest, task.error_norm)
        if k == 100:  # a change of plan must not forget the way
            for stack in twins.stacks:
                stack.insert(PostureTask(), 5.0, 0.02)
    assert largest > np.pi + 0.2


@pytest.mark.parametrize(("robot", "max_speed"), with_robots([None, 1.0], ROBOTS[:2]))
def test_no_angle_makes_a_step(robot, max_speed):
    """Two turns of the first joint away from the target: ten times finer, steps of a tenth."""
    largest = []
    for ticks in (100, 1000):
        twins = Twins(robot, lambda: [OrientationTask(kp=50.0, max_speed=max_speed)])
        q, v = twins.robot.q_reference.copy(), np.zeros(6)
        path = []
        for k in range(ticks):
            path.append(twins.step(k * DT, q, v).tau)
            q[0] += 4.0 * np.pi / ticks
        largest.append(np.abs(np.diff(path, axis=0)).max())
    assert largest[1] < 0.15 * largest[0]


@pytest.mark.parametrize("experiment", ["singularity", "joint-limit"])
def test_the_experiments_of_the_paper_tick_by_tick(experiment):
    scenario = load_scenario(experiment)
    built, readable = build(scenario), build(scenario, ReferenceController).controller
    worst = 0.0

    class Watch:
        def observe(self, q, v, command):
            nonlocal worst
            assert np.isfinite(command.tau).all()
            gap = np.max(np.abs(readable.step(command.t, q, v).tau - command.tau))
            worst = max(worst, float(gap) / max(1.0, float(np.max(np.abs(command.tau)))))

    simulate(built.plant, built.controller, 1.5, [Watch()])
    assert worst < 1e-9


def test_a_task_of_ones_own_that_gives_nonsense_is_refused():
    class Broken(Spring):
        def evaluate(self, robot, t):
            terms = super().evaluate(robot, t)
            return TaskTerms(terms.J, terms.drift, terms.acceleration * np.nan, terms.error)

    controller = Controller(load_robot("puma560"), Stack([Broken()]))
    with pytest.raises(osc.InputError, match=r"'spring'.*finite"):
        controller.step(0.0, controller.robot.q_reference, np.zeros(6))


def test_more_tasks_than_there_are_bits_take_the_readable_form():
    robot = load_robot("puma560")

    def make():
        return [PositionTask(axes="z", name=f"height{k}") for k in range(40)]

    twins = Twins(ROBOTS[0], make)
    twins.step(0.0, robot.q_reference, np.full(6, 0.1))


def crowded(kind, blending, ticks):
    """31 tasks, five of them leaving, and two more places in the middle: one bit more than there are."""
    robot = load_robot("puma560")
    names = robot.joint_names
    leaving = [JointTask(names[i], name=f"leaving {i}", target=[1.0]) for i in range(3)]
    leaving += [
        PositionTask(target=[0.5, 0.2, 0.4]),
        OrientationTask(target=np.diag([1.0, -1, -1])),
    ]
    rest = [JointTask(names[i % 6], name=f"rest {i}", target=[0.3]) for i in range(25)]
    levels = {0.1 * i: task for i, task in enumerate(leaving)}
    stack = Stack({**levels, 1.0: PostureTask(), 2.0: rest})
    controller = kind(robot, stack, blending=blending)
    dt = 0.4 / ticks
    for i, k in enumerate((4, 3, 2, 1, 0)):
        stack.remove(leaving[k], duration=0.35, start_time=0.01 + 0.01 * i)
    for task in rest[:3]:
        stack.move(task, 3.0, duration=0.1, start_time=0.1)
    return np.array(
        [controller.step(k * dt, robot.q_reference, np.zeros(6)).tau for k in range(ticks)]
    )


@pytest.mark.parametrize("blending", ["auto", "chain", "smooth-chain"])
def test_the_number_of_bits_is_crossed_without_a_step(blending):
    """There and back again in the middle of transitions, whose groups either form goes on with."""
    ours, readable = (crowded(kind, blending, 80) for kind in (Controller, ReferenceController))
    np.testing.assert_allclose(ours, readable, rtol=0, atol=1e-8)
    fine = crowded(Controller, blending, 400)
    steps = [np.abs(np.diff(path, axis=0)).max() for path in (ours, fine)]
    assert steps[1] < 0.3 * steps[0]


@pytest.mark.parametrize("kind", [Controller, ReferenceController])
@pytest.mark.parametrize("duration", [1e154, 1e300, 1.7e308])
def test_requests_may_last_for_ever(kind, duration):
    robot = load_robot("puma560")
    here, there = JointTask("joint3", name="here"), JointTask("joint4", name="there")
    stack = Stack([PositionTask(), here, PostureTask()])
    controller = kind(robot, stack)
    requests = [
        lambda: stack.insert(there, 0.5, duration=duration),
        lambda: stack.remove(there, duration=duration),
        lambda: stack.insert(there, 0.2, duration=duration),
        lambda: stack.swap(here, "position", duration=duration, start_time=1e300),
        lambda: stack.move(here, 0.1, duration=duration),
        lambda: stack.move(here, 0.3, duration=0.01),
    ]
    for k in range(60):
        if k % 5 == 1 and requests:
            requests.pop(0)()
        command = controller.step(k * DT, robot.q_reference, np.zeros(6))
        assert not command.status & Status.FAULT
    controller.hand_back(np.zeros(6), duration)
    assert not controller.step(0.06, robot.q_reference, np.zeros(6)).status & Status.FAULT
