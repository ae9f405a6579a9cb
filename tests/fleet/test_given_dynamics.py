"""A fleet that is given the dynamics does what one does that computes them."""

import numpy as np
import pytest

import opspace as osc

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")

COUNT = 8
OPTIONS = {"torque_limits": "priority", "blending": "idv"}


def levels(robot):
    target = np.eye(4)
    target[:3, 3] = [0.4, 0.1, 0.3]
    return [
        osc.JointLimits(),
        osc.PoseTask(target=target, name="pose"),
        osc.PositionTask(robot.frame_names[-2], target=[0.2, 0.1, 0.3], axes="z", name="elbow"),
        osc.ImpedanceTask(robot.frame_names[-3], target=[0.2, 0.2, 0.2], name="spring"),
        osc.PostureTask(target=robot.q_reference),
    ]


def write(fleet, Q, V):
    """Be the simulator: write what it knows."""
    robot, rows = fleet.robot, {}
    frames = {"pose": robot.tool, "elbow": robot.frame_names[-2]}
    frames["spring"] = robot.frame_names[-3]
    for q, v in zip(Q, V, strict=True):
        robot.update(q, v)
        rows.setdefault("M", []).append(robot.M.copy())
        rows.setdefault("bias", []).append(robot.bias.copy())
        for name, frame in frames.items():
            i = robot.frame_id(frame)
            turn = osc.tasks.rotation.quaternion_from_matrix(robot.rotation(i))
            rows.setdefault((name, "pose"), []).append([*robot.position(i), *turn])
            rows.setdefault((name, "jacobian"), []).append(robot.jacobian(i).copy())
            rows.setdefault((name, "drift"), []).append(robot.drift(i).copy())
    fleet.M.assign(np.array(rows.pop("M")))
    fleet.bias.assign(np.array(rows.pop("bias")))
    for (name, what), value in rows.items():
        getattr(fleet[name], what).assign(np.array(value))


def test_torques_are_those_of_a_controller_for_the_same_arrays():
    robot = osc.load_robot("puma560")
    fleet = osc.Fleet(
        robot, osc.Stack(levels(robot)), COUNT, device="cpu", dynamics="given", **OPTIONS
    )
    own = osc.load_robot("puma560")
    controller = osc.Controller(own, osc.Stack(levels(own)), **OPTIONS)
    rng = np.random.default_rng(1)
    for k in range(6):
        Q = robot.q_reference + rng.uniform(-1, 1, (COUNT, 6)) * (0.2 + 0.3 * k)
        V = rng.uniform(-1, 1, Q.shape)
        write(fleet, Q, V)
        fleet.reset()
        tau = fleet.step(0.0, Q, V).numpy()
        want = controller.torque_batch(Q, V)
        scale = np.maximum(1.0, np.abs(want).max(axis=1, keepdims=True))
        lost = fleet.status.numpy() & int(osc.Status.LIMIT_LOST) != 0
        np.testing.assert_allclose((tau / scale)[~lost], (want / scale)[~lost], atol=1e-9)
        np.testing.assert_allclose(tau / scale, want / scale, atol=1e-6)


def test_another_inertia_is_another_torque_and_none_is_a_fault():
    robot = osc.load_robot("puma560")
    stack = osc.Stack(levels(robot))
    fleet = osc.Fleet(robot, stack, COUNT, device="cpu", dynamics="given", **OPTIONS)
    Q, V = np.tile(robot.q_reference, (COUNT, 1)), np.zeros((COUNT, 6))
    assert (fleet.step(0.0, Q, V).numpy() == 0.0).all()
    assert (fleet.status.numpy() == int(osc.Status.FAULT)).all()
    write(fleet, Q, V)
    heavy = fleet.M.numpy().copy()
    heavy[3] *= 2.0
    fleet.bias.assign(np.zeros((COUNT, 6)))
    fleet["pose"].target.assign(fleet["pose"].pose.numpy() + 0.01 * np.eye(7)[0])
    fleet["elbow"].activation.assign(np.zeros(COUNT))
    fleet.M.assign(heavy)
    tau = fleet.step(0.0, Q, V).numpy()
    np.testing.assert_array_equal(tau[2], tau[1])
    np.testing.assert_allclose(tau[3], 2.0 * tau[1], rtol=1e-9, atol=1e-12)


def test_what_needs_dynamics_of_ones_own_is_refused_by_name():
    robot = osc.load_robot("puma560")
    with pytest.raises(osc.InputError, match="period"):
        osc.Fleet(robot, osc.Stack(levels(robot)), 1, dynamics="given", period=0.001)
    with pytest.raises(osc.UnknownNameError, match="'taken'"):
        osc.Fleet(robot, osc.Stack(levels(robot)), 1, dynamics="taken")


def test_a_force_is_the_same_with_dynamics_of_ones_own_and_given():
    robot = osc.load_robot("puma560")

    def stack():
        press = osc.ForceTask(force=[9, 0, 6], axes="xyz", axes_frame="world", name="pose")
        point = osc.PositionTask(robot.frame_names[-2], axes="z", target=[0, 0, 0.3], name="elbow")
        spring = osc.ImpedanceTask(robot.frame_names[-3], target=[0.2] * 3, name="spring")
        return osc.Stack([press, point, spring, osc.PostureTask(target=robot.q_reference)])

    own, given = (
        osc.Fleet(robot, stack(), COUNT, device="cpu", dynamics=d) for d in ("own", "given")
    )
    rng = np.random.default_rng(4)
    Q = robot.q_reference + rng.uniform(-0.3, 0.3, (COUNT, 6))
    V = rng.uniform(-0.1, 0.1, Q.shape)
    for k in range(8):
        q = Q + 0.002 * k * V
        write(given, q, V)
        wrench = 8.0 * rng.uniform(0.8, 1.2, (COUNT, 6)) * (k > 2)
        for fleet in (own, given):
            fleet["pose"].wrench.assign(wrench)
        want, tau = (fleet.step(0.002 * k, q, V).numpy() for fleet in (own, given))
        np.testing.assert_allclose(tau, want, rtol=0, atol=1e-9 * np.abs(want).max())
    assert given["pose"].confidence.numpy().min() > 0.01
