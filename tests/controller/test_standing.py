"""A robot with a floating base: the plan is what a rigid plant does, and nothing pulls at the base."""

import numpy as np
import pytest

import opspace as osc
from opspace.controller.reference import ReferenceController
from opspace.errors import InputError

HALF, OFFSET = (0.085, 0.025), (0.035, 0.0, -0.035)
FEET = ("left", "right")
WEIGHT = 33.34114202 * 9.81
FORM = [osc.Controller]
"""What runs the stack in a test that both forms have to pass."""
both_forms = pytest.mark.usefixtures("_form")


@pytest.fixture(scope="module")
def g1():
    return osc.load_robot("g1")


def soles(**options):
    return [
        osc.SoleContact(f"{side}_ankle_roll_link", HALF, offset=OFFSET, name=side, **options)
        for side in FEET
    ]


def controller_of(robot, *, contacts=None, limits=None, **options):
    tasks = [
        osc.ComTask(kp=50.0),
        osc.OrientationTask("torso_link", name="torso"),
        osc.PostureTask(kp=25.0),
    ]
    stack = osc.Stack(tasks, limits, soles() if contacts is None else contacts)
    return FORM[0](robot, stack, **options)


@pytest.fixture(params=[osc.Controller, ReferenceController], ids=["compiled", "readable"])
def _form(request):
    FORM[0] = request.param
    yield
    FORM[0] = osc.Controller


def states(robot, seed, speed=0.3):
    """Near the reference posture, moving."""
    rng = np.random.default_rng(seed)
    bend = rng.normal(0.0, 0.1, robot.nv)
    return robot.integrate(robot.q_reference, bend, 1.0), rng.normal(0.0, speed, robot.nv)


def plant(robot, tau, contacts):
    """q̈ and forces of a rigid robot whose contacts are stilled as they were told to be."""
    terms = [contact.evaluate(robot) for contact in contacts]
    J = np.concatenate([np.zeros((0, robot.nv)), *(t.J for t in terms)])
    gamma = np.concatenate([np.zeros(0), *(t.acceleration for t in terms)])
    m = gamma.size
    K = np.block([[robot.M, -J.T], [J, np.zeros((m, m))]])
    x = np.linalg.solve(K, np.concatenate([tau - robot.bias, gamma]))
    own = np.split(x[robot.nv :], len(contacts)) if contacts else []
    return x[: robot.nv], [t.axes @ f[:3] for t, f in zip(terms, own, strict=True)]


@both_forms
@pytest.mark.parametrize("seed", range(3))
def test_a_rigid_plant_answers_with_the_forces_that_were_planned(g1, seed):
    q, v = states(g1, seed)
    controller = controller_of(g1)
    command = controller.step(0.0, q, v)
    assert np.all(command.tau[:6] == 0.0)
    contacts = list(controller.stack.contacts.values())
    moved, felt = plant(g1, command.tau, contacts)
    for contact, force in zip(contacts, felt, strict=True):
        assert np.max(np.abs(command.contacts[contact.name].force - force)) < 1e-6 * WEIGHT
        assert command.contacts[contact.name].cone_use <= 1.0 + 1e-6
    if command.status == osc.Status.OK:
        # What the tasks asked for is what happens.
        task = controller.stack["com"]
        terms = task.evaluate(g1, 0.0)
        asked = terms.acceleration - terms.drift
        assert np.max(np.abs(terms.J @ moved - asked)) < 1e-7 * (1.0 + np.max(np.abs(asked)))


@both_forms
def test_at_rest_the_feet_carry_the_weight_and_nothing_is_given_up(g1):
    command = controller_of(g1).step(0.0, g1.q_reference, np.zeros(g1.nv))
    assert command.status == osc.Status.OK
    forces = [command.contacts[side].force for side in FEET]
    assert abs(sum(forces)[2] - WEIGHT) < 1e-6 * WEIGHT
    # The robot is not quite the same left and right.
    assert abs(forces[0][2] - forces[1][2]) < 0.01 * WEIGHT
    for side in FEET:
        status = command.contacts[side]
        assert (status.progress, status.motion, status.activation) == (1.0, 1.0, 1.0)
        assert np.all(np.abs(status.cop) < HALF)
        assert 0.0 < status.cone_use < 1.0


@pytest.mark.parametrize("seed", range(2))
def test_both_libraries_give_the_same_torque_and_forces(g1, seed):
    q, v = states(g1, seed)
    commands = [
        controller_of(robot, limits=osc.JointLimits(), torque_limits="priority").step(0.0, q, v)
        for robot in (g1, osc.load_robot("g1", backend="mujoco"))
    ]
    assert np.max(np.abs(commands[0].tau - commands[1].tau)) < 1e-8
    for side in FEET:
        a, b = (command.contacts[side].force for command in commands)
        assert np.max(np.abs(a - b)) < 1e-8


@both_forms
def test_in_the_air_the_centre_of_mass_falls(g1):
    q, v = states(g1, 1)
    controller = controller_of(g1, contacts=[])
    command = controller.step(0.0, q, v)
    assert osc.Status.NOT_BALANCED in command.status
    assert osc.Status.GIVEN_UP in command.status
    moved, _ = plant(g1, command.tau, [])
    fall = g1.com_jacobian() @ moved + g1.com_drift()
    assert np.max(np.abs(fall - (0.0, 0.0, -9.81))) < 1e-6
    # The torso still turns as it should: nothing pulls at it from outside.
    assert np.all(np.isfinite(command.tau))


@both_forms
def test_motors_and_joints_keep_their_limits_on_the_ground(g1):
    limited = 0
    controller = controller_of(g1, limits=osc.JointLimits(), torque_limits="priority")
    for seed in range(4):
        controller.restart()
        q, v = states(g1, seed, speed=1.5)
        command = controller.step(0.0, q, v)
        assert np.all(np.abs(command.tau) <= g1.torque_limit)
        limited += osc.Status.FILTERED in command.status
    assert limited


@both_forms
def test_a_contact_leaves_without_a_step_and_waits_while_it_is_needed(g1):
    """The state stands still, so every change is that of the contact."""
    controller = controller_of(g1, limits=osc.JointLimits())
    stack, q, still = controller.stack, g1.q_reference, np.zeros(g1.nv)
    stack.insert(osc.PoseTask("right_ankle_roll_link", name="foot"), 0.5, 0.0)
    tau = [controller.step(0.0, q, still).tau]
    stack.remove("right", 0.3)
    for i in range(1, 60):
        command = controller.step(5e-3 * i, q, still)
        tau.append(command.tau)
    assert osc.Status.CONTACT_WAITS in command.status
    status = command.contacts["right"]
    assert status.waiting
    assert 0.3 < status.progress < 1.0
    assert status.force[2] > 0.05 * WEIGHT
    assert np.max(np.abs(np.diff(tau, axis=0))) < 5.0
    stack.insert(stack.contacts["right"], 0.1)
    for i in range(60, 90):
        command = controller.step(5e-3 * i, q, still)
    assert command.contacts["right"].activation == 1.0
    assert np.max(np.abs(command.tau - tau[0])) < 1e-6


@both_forms
def test_a_wanted_force_is_given_by_a_hand_and_taken_by_the_feet(g1):
    hand = osc.PointContact("right_rubber_hand", normal=(-1.0, 0.0, 0.0), force=20.0, name="hand")
    controller = controller_of(g1, contacts=[*soles(), hand])
    command = controller.step(0.0, g1.q_reference, np.zeros(g1.nv))
    assert command.status == osc.Status.OK
    assert abs(command.contacts["hand"].force[0] + 20.0) < 2.0
    assert (
        np.max(np.abs(sum(s.force for s in command.contacts.values()) - (0, 0, WEIGHT)))
        < 1e-6 * WEIGHT
    )
    assert np.all(command.contacts["hand"].moment == 0.0)


@both_forms
def test_a_quadruped_stands_on_points_and_its_momentum_decays_as_asked():
    robot = osc.load_robot("solo12")
    feet = [osc.PointContact(f, friction=0.8) for f in ("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT")]
    tasks = [osc.AngularMomentumTask(kv=5.0), osc.ComTask(), osc.PostureTask()]
    controller = FORM[0](robot, osc.Stack(tasks, contacts=feet))
    speed = 0.05 * np.random.default_rng(0).normal(size=robot.nv)
    command = controller.step(0.0, robot.q_reference, speed)
    assert command.status == osc.Status.OK
    moved, felt = plant(robot, command.tau, feet)
    for foot, force in zip(feet, felt, strict=True):
        assert np.max(np.abs(command.contacts[foot.name].force - force)) < 1e-6
    terms = controller.stack["angular_momentum"].evaluate(robot, 0.0)
    assert np.max(np.abs(terms.J @ moved + terms.drift - terms.acceleration)) < 1e-8
    assert np.max(np.abs(terms.acceleration)) > 1e-4


@both_forms
def test_a_contact_has_an_activation_of_its_own(g1):
    controller = controller_of(g1)
    controller.stack.contacts["right"].activation = lambda _robot, t: 0.65 if t < 1.0 else 2.0
    command = controller.step(0.0, g1.q_reference, np.zeros(g1.nv))
    assert abs(command.contacts["right"].activation - 0.5) < 1e-12
    assert command.contacts["right"].motion == 1.0
    with pytest.raises(InputError, match="contact 'right': activation"):
        controller.step(1.5, g1.q_reference, np.zeros(g1.nv))


@both_forms
def test_a_tick_that_cannot_be_trusted_holds_the_last_torque(g1):
    controller = controller_of(g1, period=1e-3, on_time_jump="hold")
    q, still = g1.q_reference, np.zeros(g1.nv)
    before = controller.step(0.0, q, still)
    after = controller.step(1.0, q, still)
    assert osc.Status.TIME_JUMP in after.status
    assert np.all(after.tau[:6] == 0.0)
    assert np.max(np.abs(after.tau - before.tau)) < 1e-9


def test_what_makes_no_sense_is_refused(g1):
    with pytest.raises(InputError, match="bolted down"):
        osc.Controller(osc.load_robot("ur5"), osc.Stack([], contacts=[osc.PointContact("tool0")]))
    for option in ({"bias": "task"}, {"gravity": "robot"}):
        with pytest.raises(InputError, match="floating base"):
            controller_of(g1, **option)
    with pytest.raises(osc.UnknownNameError, match="sole"):
        controller_of(g1, contacts=[osc.SoleContact("sole", HALF)])
