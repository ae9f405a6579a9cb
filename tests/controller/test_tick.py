"""One tick against the equations, written out with plain inverses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.command import Status
from opspace.controller import Controller
from opspace.errors import InputError, UnknownNameError
from opspace.plan.scales import Singularity
from opspace.robots import load_robot
from opspace.stack import Stack
from opspace.tasks import (
    JointLimits,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Task,
    TaskTerms,
)

STATES = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def robot():
    return load_robot("puma560")


def state(robot, seed, spread=0.3):
    rng = np.random.default_rng(seed)
    q = robot.q_reference + rng.uniform(-spread, spread, robot.nv)
    return q, rng.uniform(-0.5, 0.5, robot.nv)


def target(robot, seed):
    robot.update(robot.q_reference, np.zeros(robot.nv))
    offset = np.random.default_rng(seed).uniform(-0.1, 0.1, 3)
    return robot.position(robot.frame_id(robot.tool)) + offset


def acceleration(robot, q, v, tau):
    robot.update(q, v)
    return np.linalg.solve(robot.M, tau - robot.bias)


@settings(max_examples=40)
@given(STATES)
def test_two_levels_are_eq_17_to_20_with_compensation(robot, seed):
    position = PositionTask(target=target(robot, seed))
    orientation = OrientationTask(target=np.eye(3))
    controller = Controller(robot, Stack([orientation, position]), singularity=None, damping=0.0)
    q, v = state(robot, seed)
    tau = controller.step(0.0, q, v).tau
    robot.update(q, v)
    Ai = np.linalg.inv(robot.M)
    expected, NT = np.zeros(6), np.eye(6)
    for task in (orientation, position):
        terms = task.evaluate(robot, 0.0)
        JN = terms.J @ NT.T
        Lambda = np.linalg.inv(JN @ Ai @ JN.T)
        f = terms.acceleration - terms.drift
        expected = expected + JN.T @ Lambda @ (f - terms.J @ Ai @ expected)
        NT = NT @ (np.eye(6) - JN.T @ (Ai @ JN.T @ Lambda).T)
    scale = max(1.0, np.max(np.abs(expected)))
    np.testing.assert_allclose(tau, expected + robot.bias, rtol=0, atol=1e-8 * scale)


@settings(max_examples=40)
@given(STATES)
def test_the_top_task_gets_exactly_what_it_asks_for(robot, seed):
    position = PositionTask(target=target(robot, seed))
    stack = Stack([position, OrientationTask(target=np.eye(3)), PostureTask()])
    q, v = state(robot, seed)
    command = Controller(robot, stack).step(0.0, q, v)
    got = acceleration(robot, q, v, command.tau)
    terms = position.evaluate(robot, 0.0)
    np.testing.assert_allclose(terms.J @ got + terms.drift, terms.acceleration, atol=1e-8)


@settings(max_examples=25)
@given(STATES)
def test_bias_in_the_task_is_eq_3_to_5(robot, seed):
    """Γ = Jᵀ (Λ f* + μ + p): what the paper prints, only as far as the task reaches."""
    position = PositionTask(target=target(robot, seed))
    controller = Controller(robot, Stack([position]), bias="task", singularity=None, damping=0.0)
    q, v = state(robot, seed)
    tau = controller.step(0.0, q, v).tau
    robot.update(q, v)
    terms = position.evaluate(robot, 0.0)
    J, Ai = terms.J, np.linalg.inv(robot.M)
    Lambda = np.linalg.inv(J @ Ai @ J.T)
    mu_and_p = Lambda @ (J @ Ai @ robot.bias - terms.drift)
    np.testing.assert_allclose(tau, J.T @ (Lambda @ terms.acceleration + mu_and_p), atol=1e-8)


@settings(max_examples=25)
@given(STATES)
def test_both_biases_give_the_task_the_same_acceleration(robot, seed):
    q, v = state(robot, seed)
    goal = target(robot, seed)
    found = []
    for bias in ("joint", "task"):
        position = PositionTask(target=goal)
        tau = Controller(robot, Stack([position]), bias=bias).step(0.0, q, v).tau
        robot.update(q, v)
        found.append(position.evaluate(robot, 0.0).J @ acceleration(robot, q, v, tau))
    np.testing.assert_allclose(found[0], found[1], atol=1e-8)


@settings(max_examples=25)
@given(STATES)
def test_away_from_singularities_their_handling_changes_nothing(robot, seed):
    q, v = state(robot, seed, spread=0.1)
    tasks = [OrientationTask(target=np.eye(3)), PositionTask(target=target(robot, seed))]
    on, off = (
        Controller(robot, Stack([*tasks, PostureTask()]), singularity=s).step(0.0, q, v)
        for s in (Singularity(0.001, 0.002), None)
    )
    assert not on.status & Status.DIRECTION_OFF
    np.testing.assert_allclose(on.tau, off.tau, rtol=0, atol=1e-10 * np.max(np.abs(off.tau)))


@pytest.mark.parametrize("name", ["puma560"])
def test_pinocchio_and_mujoco_give_the_same_command(name):
    commands = []
    for backend in ("pinocchio", "mujoco"):
        robot = load_robot(name, backend=backend)
        stack = Stack([JointLimits(), PoseTask(), PostureTask()])
        controller = Controller(robot, stack)
        controller.step(0.0, robot.q_reference, np.zeros(6))
        q, v = state(robot, 3)
        commands.append(controller.step(0.001, q, v))
    np.testing.assert_allclose(commands[0].tau, commands[1].tau, rtol=0, atol=1e-7)


def test_unused_motions_are_damped(robot):
    """Without a posture task the joints that no task moves lose their speed at the given rate."""
    position = PositionTask()
    controller = Controller(robot, Stack([position]), damping=7.0)
    q, v = state(robot, 8)
    tau = controller.step(0.0, q, v).tau
    got = acceleration(robot, q, v, tau)
    J = position.evaluate(robot, 0.0).J
    _, _, Vt = np.linalg.svd(J)
    free = Vt[3:].T  # motions that the tool does not feel
    # Dynamically consistent: M-orthogonal to the task, so the freed momenta decay, not the rates.
    momenta = free.T @ robot.M
    np.testing.assert_allclose(momenta @ got, -7.0 * momenta @ v, atol=1e-8)


def test_the_command_explains_itself(robot):
    stack = Stack([OrientationTask(), PositionTask(), PostureTask()])
    controller = Controller(robot, stack)
    command = controller.step(0.0, robot.q_reference, np.zeros(6))
    assert set(command.tasks) == {"orientation", "position", "posture"}
    assert command.tasks["position"].error_norm < 1e-14  # placed by two libraries
    assert command.tasks["position"].activation == 1.0
    assert [level.tasks for level in command.levels] == [
        ("orientation",),
        ("position",),
        ("posture",),
    ]
    sigma = command.levels[1].sigma
    assert np.all(np.diff(sigma) <= 0)
    assert np.all(sigma > 0)
    assert command.status == Status.OK
    stretched = controller.step(0.001, robot.configurations["stretched"], np.zeros(6))
    assert stretched.status & Status.DIRECTION_OFF
    assert stretched.levels[1].activation[-1] == 0.0
    # The direction that is off is the one along the stretched arm.
    robot.update(robot.configurations["stretched"], np.zeros(6))
    along = robot.position(robot.frame_id("tool")) - [0, 0, 0.67183]
    lost = stretched.levels[1].directions[:, -1]
    assert abs(lost @ along) / np.linalg.norm(along) > 0.9
    assert np.all(np.isfinite(stretched.tau))


def test_torque_is_finite_and_continuous_through_an_exact_singularity(robot):
    stack = Stack([OrientationTask(), PositionTask(), PostureTask()])
    controller = Controller(robot, stack)
    controller.step(0.0, robot.q_reference, np.zeros(6))
    stretched = robot.configurations["stretched"]
    direction = np.array([0.1, 0.2, 1.0, 0.3, 0.7, 0.2])

    def steps(n):
        path = [
            controller.step(0.0, stretched + s * direction, np.zeros(6)).tau
            for s in np.linspace(-0.5, 0.5, n + 1)
        ]
        return np.max(np.abs(np.diff(path, axis=0)))

    assert steps(1000) < 0.2 * steps(100)


class Elbow(Task):
    """A task of a user's own: hold one joint, in plain Python."""

    def __init__(self):
        super().__init__("elbow", rows=1, units=("rad",))

    def bind(self, robot):
        self.column = robot.joint_names.index("joint3")

    def evaluate(self, robot, t):
        J = np.zeros((1, robot.nv))
        J[0, self.column] = 1.0
        error = np.array([-2.0 - robot.q[self.column]])
        command = self.kp * error - self.kv * robot.v[[self.column]]
        return TaskTerms(J, np.zeros(1), command, error)


def test_a_task_of_ones_own_takes_part(robot):
    elbow = Elbow()
    controller = Controller(robot, Stack([elbow, PositionTask(axes="z")]))
    q, v = state(robot, 1)
    command = controller.step(0.0, q, v)
    got = acceleration(robot, q, v, command.tau)
    assert got[2] == pytest.approx(elbow.evaluate(robot, 0.0).acceleration[0], abs=1e-9)


def test_building_twice_gives_the_same_controller(robot):
    q, v = state(robot, 2)
    commands = []
    for _ in range(2):
        stack = Stack([JointLimits(), OrientationTask(), PositionTask(), PostureTask()])
        controller = Controller(robot, stack)
        controller.step(0.0, robot.q_reference, np.zeros(6))
        commands.append(controller.step(0.001, q, v))
    assert np.array_equal(commands[0].tau, commands[1].tau)


@pytest.mark.parametrize(
    ("t", "q", "v", "message"),
    [
        (0.0, np.full(6, np.nan), np.zeros(6), "joint1"),
        (0.0, np.zeros(5), np.zeros(6), "6"),
        (0.0, np.zeros(6), np.full(6, np.inf), "joint1"),
        (np.nan, np.zeros(6), np.zeros(6), "time must be finite"),
    ],
)
def test_a_bad_state_is_refused(robot, t, q, v, message):
    controller = Controller(robot, Stack([PositionTask()]))
    with pytest.raises(InputError, match=message):
        controller.step(t, q, v)


def test_bad_options_are_refused(robot):
    stack = Stack([PositionTask()])
    with pytest.raises(UnknownNameError, match=r"blending 'indv'.*idv"):
        Controller(robot, stack, blending="indv")
    with pytest.raises(UnknownNameError, match=r"bias 'joints'.*joint"):
        Controller(robot, stack, bias="joints")
    with pytest.raises(InputError, match="damping"):
        Controller(robot, stack, damping=-1.0)
    with pytest.raises(InputError, match="0 < lower < release <= upper"):
        Singularity(0.5, 0.1)
    with pytest.raises(UnknownNameError, match=r"scale 'relativ'.*relative"):
        Singularity(scale="relativ")
    with pytest.raises(UnknownNameError, match=r"'position': unknown frame.*'tol'.*tool"):
        Controller(robot, Stack([PositionTask("tol")]))


def test_mixed_up_arguments_are_refused(robot):
    with pytest.raises(InputError, match="takes a Stack, not list"):
        Controller(robot, [PositionTask()])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="takes a robot, not str"):
        Controller("puma560", Stack([PositionTask()]))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a list of tasks"):
        Stack(PositionTask())  # type: ignore[arg-type]


def test_bad_stacks_are_refused():
    with pytest.raises(InputError, match="two tasks are named 'position'"):
        Stack([PositionTask(), PositionTask()])
    with pytest.raises(InputError, match="not str"):
        Stack(["position"])  # type: ignore[list-item]
    with pytest.raises(InputError, match="one JointLimits"):
        Stack([JointLimits(), JointLimits()])
