"""Pinocchio and MuJoCo, each the other's oracle, on every robot that both can load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from opspace.robots import Robot, load_robot
from tests.robots.samples import NAMES, random_state

# Its motors are not alike in both directions, see tests/robots/test_motors.py.
pytestmark = pytest.mark.filterwarnings("ignore:medley. (the motor of|what actuators)")

QUANTITIES = ("M", "bias", "gravity")
OF_FRAMES = ("position", "rotation", "velocity", "jacobian", "drift")
OF_MASS = ("com_position", "com_jacobian", "com_drift")
LABELS = ("joint_names", "frame_names", "tool", "floating_base", "locked_joints")
ARRAYS = ("q_reference", "q_lower", "q_upper", "velocity_limit", "torque_limit", "actuated")


def assert_agree(one: Robot, other: Robot, seed: int, states: int = 3) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(states):
        q, v = random_state(one, rng)
        one.update(q, v)
        other.update(q, v)
        for what in QUANTITIES:
            assert_close(getattr(one, what), getattr(other, what), what)
        for what in OF_MASS:
            assert_close(getattr(one, what)(), getattr(other, what)(), what)
        for frame, name in enumerate(one.frame_names):
            for what in OF_FRAMES:
                label = f"{what} of {name}"
                assert_close(getattr(one, what)(frame), getattr(other, what)(frame), label)
        moved = one.integrate(q, v, 0.3)
        assert_close(moved, other.integrate(q, v, 0.3), "integrate")
        assert_close(one.difference(q, moved), other.difference(q, moved), "difference")


def assert_close(a: np.ndarray, b: np.ndarray, what: str) -> None:
    scale = max(1.0, float(np.abs(a).max()))
    np.testing.assert_allclose(a / scale, b / scale, rtol=0.0, atol=1e-10, err_msg=what)


def assert_same_labels(one: Robot, other: Robot) -> None:
    for name in LABELS:
        assert getattr(one, name) == getattr(other, name)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("name", NAMES)
def test_backends_agree_on_named_robots(name: str) -> None:
    one, other = (load_robot(name, backend=backend) for backend in ("pinocchio", "mujoco"))
    assert_same_labels(one, other)
    assert_agree(one, other, seed=1)


@pytest.mark.parametrize("name", ["oddity", "medley"])
@pytest.mark.parametrize("floating_base", [False, True])
def test_backends_agree_on_every_feature(
    files: dict[str, Path], name: str, floating_base: bool
) -> None:
    one, other = (
        load_robot(files[name], backend=backend, floating_base=floating_base)
        for backend in ("pinocchio", "mujoco")
    )
    assert_same_labels(one, other)
    assert_agree(one, other, seed=2, states=10)


def test_backends_agree_on_an_arm_that_floats() -> None:
    one, other = (
        load_robot("puma560", backend=backend, floating_base=True)
        for backend in ("pinocchio", "mujoco")
    )
    assert one.nv == 12
    assert one.joint_names[:2] == ("floating_base/0", "floating_base/1")
    assert not one.actuated[:6].any()
    assert one.actuated[6:].all()
    assert_agree(one, other, seed=3)


def test_pinocchio_reads_the_shipped_arm_itself_alike() -> None:
    import pinocchio as pin

    robot = load_robot("puma560")
    model = pin.buildModelFromMJCF(str(robot.source))
    data = model.createData()
    q, v = random_state(robot, np.random.default_rng(4))
    robot.update(q, v)
    np.testing.assert_allclose(robot.M, pin.crba(model, data, q), atol=1e-12)
    np.testing.assert_allclose(robot.bias, pin.nonLinearEffects(model, data, q, v), atol=1e-11)
