"""Every robot of a fleet does what a controller of its own would do."""

import numpy as np
import pytest

import opspace as osc
from tests.fleet.fleets import Beside, tasks

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")


def test_random_states_with_limits_and_singular_postures():
    both = Beside(count=16).prepare()
    rng = np.random.default_rng(1)
    seen = 0
    for k in range(12):
        Q, V = both.states(rng, spread=0.3 * (k + 1), speed=2.0)
        for command in both.assert_same(0.001 * k, Q, V):
            seen |= int(command.status)
    wanted = osc.Status.DIRECTION_OFF | osc.Status.FILTERED | osc.Status.TORQUE_SCALED
    assert wanted in osc.Status(seen)


def test_transitions_of_some_robots():
    both = Beside().prepare()
    rng = np.random.default_rng(2)
    Q, V = both.states(rng, spread=0.4)
    program = {
        2: lambda x, some: x.swap("position", "orientation", 0.1, **some([0, 2, 4])),
        5: lambda x, some: x.move("position", 2, 0.05, **some([1, 3])),
        8: lambda x, some: x.remove("orientation", 0.04, **some([1, 4, 5])),
        12: lambda x, some: x.insert("orientation", 1, 0.06, **some([5])),
        20: lambda x, some: x.swap("position", "orientation", 0.0, **some([2])),
    }
    for k in range(36):
        if k == 3:
            both.fleet.insert("elbow", 0, 0.08, profile="cubic", robots=[0, 1])
            for i in (0, 1):
                both.stacks[i].insert(both.others[i], 0, 0.08, profile="cubic")
        if k in program:
            program[k](both.fleet, lambda robots: {"robots": robots})
            for i, stack in enumerate(both.stacks):
                for_one = Only(stack, i)
                program[k](for_one, lambda robots: {"robots": robots})
        both.assert_same(0.005 * k, Q + 0.005 * k * V, V)


class Only:
    """The stack of one robot, which does what a fleet is asked to do with it."""

    def __init__(self, stack, i):
        self._stack, self._i = stack, i

    def __getattr__(self, name):
        def ask(*given, robots):
            if self._i in robots:
                task = self._stack[given[0]] if name == "insert" else given[0]
                getattr(self._stack, name)(task, *given[1:])

        return ask


def test_targets_and_gains_of_each_robot():
    both = Beside().prepare()
    rng = np.random.default_rng(3)
    for k in range(6):
        goals = [0.4, 0.1, 0.3] + rng.uniform(-0.2, 0.2, (both.count, 3))
        turns = rng.normal(size=(both.count, 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        rate, kp = rng.uniform(-1, 1, (both.count, 3)), rng.uniform(10, 300, (both.count, 3))
        position, orientation = both.fleet["position"], both.fleet["orientation"]
        position.target.assign(goals)
        position.set_gains(kp)
        orientation.set_target(turns[::2], velocity=rate[::2], robots=[0, 2, 4])
        orientation.activation.assign(np.linspace(0, 1, both.count))
        for i, stack in enumerate(both.stacks):
            stack["position"].target, stack["position"].kp = goals[i], kp[i]
            stack["position"].kv = 2 * np.sqrt(kp[i])
            if i % 2 == 0:
                stack["orientation"].set_target(turns[i], rate[i])
            stack["orientation"].activation = lambda robot, t, h=i / (both.count - 1): h
        both.assert_same(0.001 * k, *both.states(rng))


def integrals(robot):
    """Integrals above and below, in the axes of the tool, of some rows, and of joints."""
    pose = osc.PoseTask(
        ki=300.0, max_integral=1e-3, max_speed=(0.2, 0.5), axes_frame="tool", name="pose"
    )
    later = osc.JointTask(robot.joint_names[2], ki=90.0, name="elbow")
    return [pose, osc.PostureTask(kp=20.0, ki=50.0)], later


def test_integrals_of_each_robot():
    both = Beside(make=integrals, torque_limits="report")
    both.fleet.insert(both.later, 0, robots=[])
    rng = np.random.default_rng(12)
    Q, V = both.states(rng, 0.6, 0.2)
    Q[3:, 4], V[3:, 4] = [0.0, 0.05, 0.15], 0.01  # wrists that are singular or nearly so
    seen = 0
    for k in range(60):
        if k == 10:
            both.fleet["pose"].set_gains(60.0, robots=[1])
            both.stacks[1]["pose"].kp = 60.0
            both.fleet["pose"].ki.assign(np.full(both.count, 300.0))
        for when, ask in ((15, "insert"), (35, "remove"), (45, "insert")):
            if k == when:
                given = (0, 0.01) if ask == "insert" else (0.01,)
                getattr(both.fleet, ask)(both.later, *given, robots=[0, 2])
                for i in (0, 2):
                    getattr(both.stacks[i], ask)(both.others[i], *given)
        jump = 0.06 if k == 20 else 0.0  # longer ago than one torque says anything about
        commands = both.assert_same(0.002 * k + jump * (k >= 20), Q + 0.002 * k * V, V)
        for i, stack in enumerate(both.stacks):
            for task in stack:
                told = both.fleet[task.name].integral.numpy()[i]
                np.testing.assert_allclose(told, task.integral, rtol=0, atol=1e-9)
        seen |= int(np.bitwise_or.reduce([int(command.status) for command in commands]))
    assert osc.Status.DIRECTION_OFF in osc.Status(seen)
    for name in ("pose", "posture", "elbow"):
        assert np.abs(both.fleet[name].integral.numpy()).max() > 1e-3
    both.fleet.reset(robots=[3])
    both.fleet.step(0.3, Q, V)
    np.testing.assert_array_equal(both.fleet["pose"].integral.numpy()[3], np.zeros(6))


def springs(robot):
    """A spring for a pose in the axes of the tool, and one for a point on the arm below it."""
    point = osc.ImpedanceTask(robot.frame_names[-3], [0.1, 0.2, 0.3], force=[1, 2, 3], name="point")
    pose = osc.ImpedanceTask(
        target=np.diag([1.0, -1.0, -1.0, 1.0])
        + [[0, 0, 0, 0.4], [0, 0, 0, 0.1], [0, 0, 0, 0.2], [0] * 4],
        stiffness=[800, 800, 400, 30, 30, 30],
        damping_ratio=0.7,
        axes_frame="tool",
        name="pose",
    )
    return [osc.JointLimits(), pose, point, osc.PostureTask()], None


def test_springs_of_each_robot():
    both = Beside(make=springs)
    rng = np.random.default_rng(9)
    pose, point = both.fleet["pose"], both.fleet["point"]
    for k in range(6):
        if k == 2:
            stiffness, push = rng.uniform(0, 900, (6, 6)), rng.uniform(-20, 20, (6, 3))
            ratio, rate = rng.uniform(0, 2, 6), rng.uniform(-1, 1, (6, 6))
            pose.stiffness.assign(stiffness)
            pose.damping_ratio.assign(ratio)
            pose.velocity.assign(rate)
            point.force.assign(push)
            for i, stack in enumerate(both.stacks):
                stack["pose"].stiffness, stack["pose"].damping_ratio = stiffness[i], ratio[i]
                stack["pose"].set_target(stack["pose"].target, rate[i])
                stack["point"].force = push[i]
        both.assert_same(0.001 * k, *both.states(rng))
    with pytest.raises(osc.InputError, match="is a spring and has no gains"):
        pose.set_gains(100.0)


def ways(robot):
    """Ways of a place, a turn and joints, which leave each other motions, and of a pose later."""
    limits = {"max_speed": 0.4, "max_acceleration": 1.5}
    point = osc.PositionTask(robot.frame_names[-3], axes="xz", name="point", **limits)
    turn = osc.OrientationTask(axes="yz", axes_frame="tool", name="turn", **limits)
    down = [0.4, 0.1, 0.2, 0.0, 1.0, 0.0, 0.0]
    pose = osc.PoseTask(target=down, max_speed=(0.5, 1.0), max_acceleration=(2.0, 4.0), name="pose")
    return [point, turn, osc.PostureTask(**limits)], pose


def test_ways_to_new_targets_of_each_robot():
    """From rest, on the way and from its end, with feed-forward, held and found, in and out again."""
    both = Beside(make=ways, torque_limits="report")
    both.fleet.insert(both.later, 0, robots=[])
    rng = np.random.default_rng(21)
    Q, V = both.states(rng, 0.4, 0.1)
    poses = [0, 2]
    for k in range(80):
        if k in (2, 9, 20, 21, 30, 76):
            goals = [0.4, 0.1, 0.3] + rng.uniform(-0.2, 0.2, (both.count, 3))
            turns = rng.normal(size=(both.count, 4))
            turns /= np.linalg.norm(turns, axis=1, keepdims=True)
            wholes, joints = np.hstack([goals, turns]), Q + rng.uniform(-0.5, 0.5, Q.shape)
            told = {"point": goals[:, ::-1], "turn": turns, "posture": joints}
            some = [i for i in range(both.count) if k != 9 or i % 2]
            rates = [0.1, 0.0, 0.2] if k == 21 else None  # followed as it is
            for name, targets in told.items():
                moving = rates if name == "point" else None
                both.fleet[name].set_target(targets[some], moving, moving, robots=some)
                for i in some:
                    both.stacks[i][name].set_target(targets[i], moving, moving)
            if k > 15:
                both.fleet["pose"].set_target(wholes[poses], robots=poses)
                for i in poses:
                    both.others[i].target = wholes[i]
        for when, ask in ((15, "insert"), (40, "remove"), (44, "insert")):
            if k == when:
                given = (0, 0.01) if ask == "insert" else (0.01,)
                getattr(both.fleet, ask)(both.later, *given, robots=poses)
                for i in poses:
                    getattr(both.stacks[i], ask)(both.others[i], *given)
        jump = 5.0 * (k >= 70)  # to the ends of all ways
        both.assert_same(0.01 * k + jump, Q + 0.01 * k * V, V)


def test_a_target_that_is_none_ends_a_way_which_begins_anew_where_the_robot_is():
    both = Beside(2, make=ways, alone=True, torque_limits="report")
    both.fleet.insert(both.later, 0, robots=[])
    point = both.fleet["point"]
    Q, V = both.states(np.random.default_rng(22), 0.3, 0.0)
    both.fleet.step(0.0, Q, V)
    point.set_target([0.3, 0.2, 0.4])
    both.fleet.step(0.1, Q, V)
    both.fleet.step(0.2, Q, V)
    assert (np.abs(point.error.numpy()).max(axis=1) > 1e-3).all(), "both are on their way"
    fair = point.target.numpy().copy()
    point.target.assign([[np.nan] * 3, fair[1]])
    both.fleet.step(0.3, Q, V)
    assert [bool(s & osc.Status.FAULT) for s in both.fleet.status.numpy()] == [True, False]
    point.target.assign(fair)
    both.fleet.step(0.4, Q, V)
    error = np.abs(point.error.numpy()).max(axis=1)
    assert error[0] < 1e-9
    assert error[1] > 1e-2


def presses(robot):
    """A force along an axis with a moment that turns the tool onto what it touches, above motions."""
    press = osc.ForceTask(
        force=12.0, moment_axes="xy", kp=0.2, max_integral=4.0, approach_speed=0.1, name="press"
    )
    slide = osc.PositionTask(axes="xy", axes_frame="tool", name="slide")
    return [osc.JointLimits(), press, slide, osc.PostureTask()], osc.ForceTask(
        robot.frame_names[-3],
        [5.0, 3.0],
        axes="xz",
        axes_frame="world",
        friction=False,
        name="late",
    )


def told_wrenches(both, given):
    """Tell all robots wrenches, or that there is nothing new, by name."""
    for name, (wrench, fresh) in given.items():
        both.fleet[name].wrench.assign(wrench)
        both.fleet[name].fresh.assign(fresh.astype(np.int64))
    return [
        {
            both.fleet[name].task.sensor: wrench[i] if fresh[i] else None
            for name, (wrench, fresh) in given.items()
        }
        for i in range(both.count)
    ]


def test_forces_of_each_robot():
    """In the air, in contact, lost, late wrenches, another force, in and out again."""
    both = Beside(make=presses, torque_limits="report")
    both.fleet.insert(both.later, 0, robots=[])
    with pytest.raises(osc.InputError, match="'late' has its arrays from the next step on"):
        both.fleet["late"].wrench.zero_()
    rng = np.random.default_rng(31)
    Q, V = both.states(rng, 0.3, 0.05)
    both.fleet.step(-1.0, Q, V)
    both.fleet.reset()
    seen, sure = 0, 0.0
    for k in range(90):
        for when, ask in ((20, "insert"), (50, "remove"), (60, "insert")):
            if k == when:
                given = (0, 0.01) if ask == "insert" else (0.01,)
                getattr(both.fleet, ask)(both.later, *given, robots=[0, 2])
                for i in (0, 2):
                    getattr(both.stacks[i], ask)(both.others[i], *given)
        if k == 30:
            both.fleet["press"].set_force([20.0, 0.1, 0.0], robots=[1])
            both.stacks[1]["press"].force, both.stacks[1]["press"].moment = 20.0, [0.1, 0.0]
        touch = 0.0 if k < 10 or 70 < k < 80 else 9.0
        q, t = Q + 0.002 * k * V, 0.002 * k
        press = touch * rng.uniform(-0.1, 0.1, (both.count, 6))
        for i in range(both.count):
            both.robot.update(q[i], V[i])
            press[i, :3] += touch * both.robot.rotation(both.robot.tool)[:, 2]
        fresh = rng.random(both.count) < 0.7
        fresh[:] |= k == 0
        fresh[4] &= not 40 < k < 60  # for so long that it is stale
        given = {"press": (press, fresh), "late": (0.5 * press, np.ones(both.count, bool))}
        wrenches = told_wrenches(both, given)
        tau = both.fleet.step(t, q, V).numpy()
        for i, controller in enumerate(both.controllers):
            command = controller.step(t, q[i], V[i], wrenches=wrenches[i])
            scale = max(1.0, float(np.abs(command.tau).max()))
            np.testing.assert_allclose(tau[i], command.tau, rtol=0, atol=1e-9 * scale)
            assert both.fleet.status.numpy()[i] == int(command.status)
            seen |= int(command.status)
            force = both.fleet["press"]
            np.testing.assert_allclose(
                force.error.numpy()[i], command.tasks["press"].error, rtol=0, atol=1e-9
            )
            found, told = both.stacks[i]["press"].touch, force.confidence.numpy()[i]
            assert abs(found.confidence - told) < 1e-12
            np.testing.assert_allclose(force.measured.numpy()[i], found.measured, atol=1e-10)
            sure = max(sure, found.confidence)
    assert osc.Status.WRENCH_STALE in osc.Status(seen)
    assert sure > 0.3


def test_a_wrench_that_is_no_number_brakes_its_robot_and_is_forgotten():
    both, fair = (Beside(3, make=presses, alone=True, torque_limits="report") for _ in range(2))
    for one in (both, fair):
        one.fleet.insert(one.later, 0, robots=[])
    Q, V = both.states(np.random.default_rng(32), 0.3, 0.0)
    wrench = np.zeros((3, 6)) + [0.0, 0.0, 8.0, 0.0, 0.0, 0.0]
    for k in range(8):
        told = wrench.copy()
        told[1, 2] = np.nan if k == 4 else 8.0
        both.fleet["press"].wrench.assign(told)
        fair.fleet["press"].wrench.assign(wrench)
        tau, want = (x.fleet.step(0.002 * k, Q, V).numpy().copy() for x in (both, fair))
        faults = both.fleet.status.numpy() & int(osc.Status.FAULT) != 0
        assert faults.tolist() == [False, k == 4, False]
        np.testing.assert_array_equal(tau[::2], want[::2])
        if k < 4:
            np.testing.assert_array_equal(tau, want)
        assert np.isfinite(tau).all()


@pytest.mark.parametrize(
    ("name", "value"), [("force", 0.0), ("force", np.nan), ("ki", 30.0), ("kp", -0.1), ("kv", 0.0)]
)
def test_what_a_force_task_would_refuse_is_a_fault_of_its_robot(name, value):
    both, fair = (Beside(3, make=presses, alone=True, torque_limits="report") for _ in range(2))
    for one in (both, fair):
        one.fleet.insert(one.later, 0, robots=[])
    Q, V = both.states(np.random.default_rng(33), 0.3, 0.0)
    told = getattr(both.fleet["press"], name)
    wrong = told.numpy().copy()
    wrong[1] = value
    told.assign(wrong)
    tau, want = (x.fleet.step(0.0, Q, V).numpy().copy() for x in (both, fair))
    faults = both.fleet.status.numpy() & int(osc.Status.FAULT) != 0
    assert faults.tolist() == [False, True, False]
    np.testing.assert_array_equal(tau[::2], want[::2])


def followers(robot):
    """Tasks that follow references, with the axes of the tool and with joints."""
    axes = {"axes_frame": "tool"}
    turn = osc.OrientationTask(axes="yz", name="turn", **axes)
    place = osc.PositionTask(robot.frame_names[-3], axes="xz", name="place")
    return [place, turn, osc.PostureTask(name="joints")], osc.PoseTask(name="pose")


def references(robot, q, phase):
    """A reference of each of them, and of each robot another."""
    robot.update(q, np.zeros(robot.nv))
    frame = robot.frame_id(robot.tool)
    here, R = robot.position(frame).copy(), robot.rotation(frame).copy()
    end = osc.tasks.rotation.exp_rotation(np.array([0.3, -0.5, 0.4])) @ R
    turn = osc.OrientationMinimumJerk(R, end, 0.1 + phase, start_time=0.0)
    circle = osc.Circle(here, 0.1, 0.4 + phase, start_time=0.0)
    return {
        "place": circle,
        "turn": turn,
        "joints": osc.MinimumJerk(q, q + 0.3, 0.1 + phase, start_time=0.0),
        "pose": osc.PoseReference(circle, turn),
    }


def test_references_written_as_arrays_are_those_of_a_controller():
    """Places, velocities and accelerations of every robot at every step."""
    both = Beside(4, make=followers, torque_limits="report")
    both.fleet.insert(both.later, 0, robots=[])
    rng = np.random.default_rng(41)
    Q, V = both.states(rng, 0.4, 0.3)
    followed = [references(both.robot, q, 0.02 * i) for i, q in enumerate(Q)]
    both.fleet.step(-1.0, Q, V)
    both.fleet.reset()
    for i, stack in enumerate(both.stacks):
        for name, reference in followed[i].items():
            (both.others[i] if name == "pose" else stack[name]).target = reference
    for k in range(30):
        if k == 12:
            both.fleet.insert("pose", 0, 0.02, robots=[0, 3])
            for i in (0, 3):
                both.stacks[i].insert(both.others[i], 0, 0.02)
        for i in range(both.count):
            for name, reference in followed[i].items():
                both.fleet[name].set_target(*reference(0.005 * k), robots=[i])
        both.assert_same(0.005 * k, Q + 0.005 * k * V, V)


def test_a_robot_that_is_reset_begins_anew_and_no_other_robot_notices():
    both, alone = (Beside(alone=True).prepare() for _ in range(2))
    rng = np.random.default_rng(4)
    Q, V = both.states(rng, spread=0.4)
    others = np.array([0, 2, 4])
    for k in range(24):
        if k == 4:
            both.fleet.swap("position", "orientation", 0.05, robots=[1, 5])
            both.fleet.remove("posture", 0.02, robots=[3])
            both.fleet["position"].set_target([0.2, 0.3, 0.4], robots=[1])
            both.fleet["posture"].set_gains(400.0, robots=[3])
        if k == 10:
            both.fleet.reset([1, 3])
            fresh = Beside(1, alone=True).prepare()
            fresh.fleet["posture"].set_gains(400.0)
        q = Q + 0.01 * k * V
        tau = both.fleet.step(0.005 * k, q, V).numpy().copy()
        if k == 20:  # numbers that are none stay with their robot
            q = q.copy()
            q[3, 2] = np.nan
            both.fleet["orientation"].set_target(np.zeros((1, 4)) + [1, 0, 0, 0], robots=[5])
            tau = both.fleet.step(0.005 * k, q, V).numpy().copy()
            assert both.fleet.status.numpy()[3] == int(osc.Status.FAULT)
            assert np.isfinite(tau).all()
            q = Q + 0.01 * k * V
        want = alone.fleet.step(0.005 * k, q, V).numpy()
        assert (tau[others] == want[others]).all()
        if 10 <= k < 20:
            one = fresh.fleet.step(0.005 * k, q[3:4], V[3:4]).numpy()
            np.testing.assert_array_equal(tau[3], one[0])


def test_single_precision():
    double, single = (Beside(400, d, alone=True).prepare() for d in ("float64", "float32"))
    rng, lost = np.random.default_rng(5), 0
    for spread in (0.5, 1.0, 3.0):
        Q, V = single.states(rng, spread)
        want = double.fleet.step(0.0, Q.astype(float), V.astype(float)).numpy()
        tau = single.fleet.step(0.0, Q, V).numpy()
        assert np.isfinite(tau).all()
        assert (np.abs(tau) <= single.robot.torque_limit.astype(np.float32)).all()
        error = np.abs(tau - want).max(axis=1) / np.abs(want).max(axis=1)
        kept = double.fleet.status.numpy() & int(osc.Status.LIMIT_LOST) == 0
        lost += int((~kept).sum())
        assert np.median(error) < 1e-6
        assert np.quantile(error[kept], 0.99) < 1e-5
        assert error.max() < 1e-3
        double.fleet.reset()
        single.fleet.reset()
    assert lost > 100, "bounds that contradict each other, as well"


def led(robot):
    """The tasks of all these tests, on ways."""
    stack, later = tasks(robot)
    for task in stack[1:3]:
        task.max_speed, task.max_acceleration = 0.5, 2.0
    return stack, later


def test_ways_in_single_precision():
    double, single = (Beside(200, d, alone=True, make=led) for d in ("float64", "float32"))
    rng, errors = np.random.default_rng(23), []
    Q, V = single.states(rng, 0.5, 0.1)
    for k in range(24):
        if k in (2, 12):  # from rest, and on the way
            goals = ([0.4, 0.1, 0.3] + rng.uniform(-0.2, 0.2, (200, 3))).astype(np.float32)
            for both in (double, single):
                both.fleet["position"].set_target(goals)
                both.fleet["orientation"].set_target([0, 1, 0, 0] if k == 2 else [0, 0, 1, 0])
        q = (Q + np.float32(0.01 * k) * V).astype(np.float32)
        want = double.fleet.step(0.01 * k, q.astype(float), V.astype(float)).numpy()
        tau = single.fleet.step(0.01 * k, q, V).numpy()
        errors.append(np.abs(tau - want).max(axis=1) / np.abs(want).max(axis=1))
    assert np.median(errors) < 1e-6
    assert np.quantile(errors, 0.99) < 1e-5
    assert np.max(errors) < 1e-3


def test_times_on_the_device_and_a_place_for_the_torques():
    wp = pytest.importorskip("warp")
    both = Beside(alone=True).prepare()
    Q, V = both.states(np.random.default_rng(6))
    both.fleet.remove("position", 1.0)
    both.fleet.step(0.0, Q, V)
    want = [
        both.fleet.step(t, Q, V).numpy()[i].copy() for i, t in enumerate(np.linspace(0.1, 0.6, 6))
    ]
    wide = np.zeros((both.count, both.n + 3))
    into = wide[:, 1 : 1 + both.n]
    times = wp.array(np.linspace(0.1, 0.6, 6), dtype=wp.float64, device="cpu")
    assert both.fleet.step(times, wp.array(Q, device="cpu"), V, into) is into
    np.testing.assert_array_equal(into, want)
    assert (wide[:, 0] == 0.0).all()


@pytest.mark.parametrize("what", ["stiffness", "damping_ratio", "kp", "kv"])
def test_a_robot_with_a_negative_gain_brakes_and_the_others_go_on(what):
    both, fair = (Beside(make=springs, alone=True) for _ in range(2))
    Q, V = both.states(np.random.default_rng(13))
    gain = getattr(
        both.fleet["pose" if what in ("stiffness", "damping_ratio") else "posture"], what
    )
    wrong = gain.numpy().copy()
    wrong[2] = -1e-9
    gain.assign(wrong)
    tau, want = both.fleet.step(0.0, Q, V).numpy(), fair.fleet.step(0.0, Q, V).numpy()
    status = both.fleet.status.numpy()
    assert [osc.Status.FAULT in osc.Status(int(s)) for s in status] == [k == 2 for k in range(6)]
    np.testing.assert_array_equal(np.delete(tau, 2, 0), np.delete(want, 2, 0))
    target = fair.fleet["pose"].target.numpy().copy()
    target[2] = np.nan
    fair.fleet["pose"].target.assign(target)
    np.testing.assert_array_equal(tau[2], fair.fleet.step(0.0, Q, V).numpy()[2])


REFUSED = {
    "reference in time": lambda: osc.PositionTask(target=osc.Circle([0.4, 0.0, 0.3], 0.1, 2.0)),
    "activation of its own": lambda: with_activation(osc.PositionTask()),
    "observer_time": lambda: osc.JointLimits(observer_time=0.005),
}


def with_activation(task):
    task.activation = osc.JointBuffer("joint2", -0.2, 0.9)
    return task


@pytest.mark.parametrize("why", REFUSED)
def test_what_a_fleet_cannot_do_is_refused_by_name(why):
    options = {"torque_limits": "priority"}
    stack = osc.Stack([REFUSED[why](), osc.PostureTask()])
    with pytest.raises(osc.InputError, match=why):
        osc.Fleet(osc.load_robot("puma560"), stack, 2, device="cpu", **options)


def test_wrong_input_is_refused_by_name():
    both = Beside(alone=True).prepare()
    fleet, (Q, V) = both.fleet, both.states(np.random.default_rng(8))
    with pytest.raises(osc.InputError, match=r"q must have shape \(6, 6\)"):
        fleet.step(0.0, Q[:3], V)
    with pytest.raises(osc.InputError, match="v must have numbers of float64"):
        fleet.step(0.0, Q, V.astype(np.float32))
    with pytest.raises(osc.InputError, match="time"):
        fleet.step(np.nan, Q, V)
    with pytest.raises(osc.InputError, match="0 to 5"):
        fleet.remove("position", robots=[6])
    with pytest.raises(osc.InputError, match="mask"):
        fleet.remove("position", robots=[True])
    with pytest.raises(osc.UnknownNameError, match="positoin"):
        fleet.remove("positoin")
    with pytest.raises(osc.UnknownNameError, match="'hand'"):
        fleet["hand"]
    with pytest.raises(osc.InputError, match="no task 'elbow'"):
        fleet.move("elbow", 0)
    with pytest.raises(osc.InputError, match="at level 0"):
        fleet.insert("position", 2, robots=[3])
    with pytest.raises(osc.InputError, match="twice"):
        fleet.swap("position", "position")
    with pytest.raises(osc.InputError, match="length 1"):
        fleet["orientation"].set_target(np.zeros((6, 4)))
    with pytest.raises(osc.InputError, match="finite"):
        fleet["position"].set_target([np.nan, 0, 0])
    with pytest.raises(osc.InputError, match="at least 0"):
        fleet["position"].set_gains(-1.0)
    with pytest.raises(osc.UnknownNameError, match="dtype"):
        osc.Fleet(both.robot, osc.Stack([osc.PostureTask()]), 1, dtype="float16", device="cpu")
    with pytest.raises(osc.InputError, match="no device"):
        osc.Fleet(both.robot, osc.Stack([osc.PostureTask()]), 1, device="cuda:9")
    with pytest.raises(osc.InputError, match="at least one robot"):
        osc.Fleet(both.robot, osc.Stack([osc.PostureTask()]), 0, device="cpu")


def with_program(both, **options):
    """Let a fleet that has made a step go on with a program of its own."""
    from opspace.fleet.program import FleetProgram

    fleet = both.fleet
    plan = fleet._controller.plan_apart(fleet._roster.present)
    fleet._program = FleetProgram(
        plan, list(fleet), fleet.dtype, fleet.device, "cpu", ended=fleet._ended, **options
    )
    return fleet


def test_a_workspace_changes_no_bit():
    """Numbers of 32 robots side by side, as on a card, and a part that is not full."""
    local, spread = (Beside(40, "float32", alone=True, make=led) for _ in range(2))
    rng = np.random.default_rng(15)
    Q, V = local.states(rng)
    local.fleet.step(0.0, Q, V), spread.fleet.step(0.0, Q, V)
    fleet = with_program(spread, lanes=32)
    assert fleet._program.workspace.size * 8 == 64 * fleet._program.memory
    for k in range(6):
        Q, V = local.states(rng, spread=0.5 * k, speed=2.0)
        local.fleet["position"].set_target(Q[0, :3])
        fleet["position"].set_target(Q[0, :3])
        want = local.fleet.step(0.01 * k, Q, V).numpy()
        np.testing.assert_array_equal(fleet.step(0.01 * k, Q, V).numpy(), want)
        np.testing.assert_array_equal(fleet.status.numpy(), local.fleet.status.numpy())


def test_a_workspace_that_a_device_has_no_room_for_is_refused_by_name():
    from opspace.fleet.warp_library import device_of, workspace_of

    with pytest.raises(osc.InputError, match=r"1000000000 of these robots .* MiB, which cpu"):
        workspace_of(10**9, 10**6, 32, device_of("cpu"))


@pytest.mark.slow
@pytest.mark.parametrize("make", [tasks, springs, integrals, ways, presses])
def test_nothing_is_read_before_it_is_written(make):
    clean, poisoned = (Beside(64, alone=True, make=make) for _ in range(2))
    if make is tasks:
        clean.prepare()
        poisoned.prepare()
    rng = np.random.default_rng(9)
    Q, V = clean.states(rng)
    clean.fleet.step(0.0, Q, V), poisoned.fleet.step(0.0, Q, V)
    fleet = with_program(poisoned, poison=True)
    for k in range(8):
        Q, V = clean.states(rng, spread=0.4 * k, speed=2.0)
        tau = fleet.step(0.001 * k, Q, V).numpy()
        np.testing.assert_array_equal(tau, clean.fleet.step(0.001 * k, Q, V).numpy())
