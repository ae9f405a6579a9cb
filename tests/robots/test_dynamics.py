"""The dynamics in plain loops against Pinocchio and MuJoCo."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.kernels.dynamics import evaluate
from opspace.robots import Robot, load_robot
from opspace.robots.bodies import make_dynamics
from opspace.robots.rigid_model import rigid_model
from tests.robots.samples import BACKENDS, NAMES, random_state

# Its motors are not alike in both directions, see tests/robots/test_motors.py.
pytestmark = pytest.mark.filterwarnings("ignore:medley. (the motor of|what actuators)")


def assert_same(robot: Robot, seed: int, fast: float = 1.0) -> None:
    """Compare everything at a random state, with velocities up to some times ``fast``."""
    model = robot.rigid_model()  # type: ignore[attr-defined]
    found = make_dynamics(model.bodies, robot.nq)
    q, v = random_state(robot, np.random.default_rng(seed))
    robot.update(q, fast * v)
    evaluate(model.bodies.handle(), np.array(robot.q), np.array(robot.v), found.handle())
    assert_close(found.M, robot.M)
    assert_close(found.bias, robot.bias)
    for frame, place in model.frames.items():
        pose = found.placement[place.body]
        R, p = pose[:9].reshape(3, 3).T, pose[9:]
        local = place.local
        assert_close(R @ local[:9].reshape(3, 3).T, robot.rotation(frame))
        origin = p + R @ local[9:]
        assert_close(origin, robot.position(frame))
        J = np.zeros((6, robot.nv))
        j = place.joint
        while j >= 0:
            linear, angular = found.axes[j, :3], found.axes[j, 3:]
            J[:, j] = [*(linear + np.cross(angular, origin)), *angular]
            j = int(model.bodies.before[j])
        assert_close(J, robot.jacobian(frame))
    links = list(zip(model.masses.place[:, 0], model.masses.points, strict=True))
    total = sum(point[0] for _, point in links)
    centre = sum(
        point[0] * (found.placement[body, :9].reshape(3, 3).T @ point[1:])
        + point[0] * found.placement[body, 9:]
        for body, point in links
    )
    assert_close(centre / total, robot.com_position())


def assert_close(a: np.ndarray, b: np.ndarray) -> None:
    scale = max(1.0, float(np.abs(b).max()))
    np.testing.assert_allclose(a / scale, b / scale, rtol=0.0, atol=1e-10)


@cache
def loaded(name: str, backend: str) -> Robot:
    return load_robot(name, backend=backend)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), fast=st.floats(0.0, 10.0))
@pytest.mark.parametrize("backend", BACKENDS)
def test_equal_on_the_shipped_arm(backend: str, seed: int, fast: float) -> None:
    assert_same(loaded("puma560", backend), seed, fast)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("backend", BACKENDS)
def test_equal_on_named_robots(name: str, backend: str) -> None:
    """Arms, humanoids and quadrupeds; those with a floating base float."""
    for seed in range(3):
        assert_same(loaded(name, backend), seed)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", ["oddity", "medley"])
@pytest.mark.parametrize("floating_base", [False, True])
def test_equal_on_every_feature(
    files: dict[str, Path], name: str, floating_base: bool, backend: str
) -> None:
    """Oblique hinges, slides, balls, several joints on a body, armature, odd gravity."""
    robot = load_robot(files[name], backend=backend, floating_base=floating_base)
    for seed in range(5):
        assert_same(robot, seed)


def test_a_quaternion_may_have_any_length(files: dict[str, Path]) -> None:
    robot = load_robot(files["medley"])
    model = robot.rigid_model()  # type: ignore[attr-defined]
    one, other = (make_dynamics(model.bodies, robot.nq) for _ in range(2))
    q, v = random_state(robot, np.random.default_rng(0))
    evaluate(model.bodies.handle(), q, v, one.handle())
    q[3:7] *= 7.0
    evaluate(model.bodies.handle(), q, v, other.handle())
    assert_close(one.M, other.M)
    assert_close(one.bias, other.bias)


def test_a_second_state_owes_nothing_to_the_first() -> None:
    robot = loaded("puma560", "pinocchio")
    model = robot.rigid_model()  # type: ignore[attr-defined]
    fresh, used = (make_dynamics(model.bodies, robot.nq) for _ in range(2))
    rng = np.random.default_rng(0)
    for _ in range(3):
        evaluate(model.bodies.handle(), *random_state(robot, rng), used.handle())
    q, v = random_state(robot, rng)
    evaluate(model.bodies.handle(), q, v, fresh.handle())
    evaluate(model.bodies.handle(), q, v, used.handle())
    for a, b in zip(fresh, used, strict=True):
        np.testing.assert_array_equal(a, b)


def test_joints_that_are_neither_hinge_nor_slide_nor_ball_are_told() -> None:
    import pinocchio as pin

    for joint in (pin.JointModelPlanar(), pin.JointModelRUBZ(), pin.JointModelHelicalUnaligned()):
        model = pin.Model()
        model.addJoint(0, joint, pin.SE3.Identity(), "odd")
        assert rigid_model(model, []) is None
