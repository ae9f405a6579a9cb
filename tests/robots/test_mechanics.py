"""Laws of mechanics that a robot's answers must obey, by finite differences."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from opspace.robots import Robot, load_robot
from opspace.robots.link_inertia import inertia_of
from opspace.robots.urdf import read_urdf
from tests.robots.samples import BACKENDS, NAMES, random_state

# Its motors are not alike in both directions, see tests/robots/test_motors.py.
pytestmark = pytest.mark.filterwarnings("ignore:(medley|plain). (the motor of|what actuators)")

STEP = 1e-6


def along(robot: Robot, q: np.ndarray, v: np.ndarray, f: Callable[[], np.ndarray]) -> np.ndarray:
    """Return the derivative of f along the motion v, velocity held constant."""
    values = []
    for sign in (1.0, -1.0):
        robot.update(robot.integrate(q, v, sign * STEP), v)
        values.append(np.array(f()))
    robot.update(q, v)
    return (values[0] - values[1]) / (2.0 * STEP)


def axial(matrix: np.ndarray) -> np.ndarray:
    return np.array([matrix[2, 1], matrix[0, 2], matrix[1, 0]])


def kinetic_energy(robot: Robot) -> np.ndarray:
    return 0.5 * robot.v @ robot.M @ robot.v


def potential_energy(robot: Robot, mass: float, gravity: np.ndarray) -> np.ndarray:
    return -mass * (gravity @ robot.com_position())


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(params=["oddity", "medley", "floating"])
def robot(request: pytest.FixtureRequest, files: dict[str, Path], backend: str) -> Robot:
    if request.param == "floating":
        return load_robot(files["oddity"], backend=backend, floating_base=True)
    return load_robot(files[request.param], backend=backend)


def check_frames(robot: Robot, frames: list[int], seed: int) -> None:
    q, v = random_state(robot, np.random.default_rng(seed))
    for frame in frames:
        robot.update(q, v)
        position = along(robot, q, v, lambda f=frame: robot.position(f))
        turning = along(robot, q, v, lambda f=frame: robot.rotation(f)) @ robot.rotation(frame).T
        velocity = robot.velocity(frame)
        np.testing.assert_allclose(velocity[:3], position, atol=1e-7)
        np.testing.assert_allclose(velocity[3:], axial(turning), atol=1e-7)
        np.testing.assert_array_equal(velocity, robot.jacobian(frame) @ robot.v)
        slope = along(robot, q, v, lambda f=frame: robot.jacobian(f) @ robot.v)
        np.testing.assert_allclose(robot.drift(frame), slope, atol=2e-7 * (1 + abs(slope).max()))


def test_velocity_and_drift_are_derivatives(robot: Robot) -> None:
    check_frames(robot, list(range(len(robot.frame_names))), seed=5)


@pytest.mark.parametrize("name", NAMES)
def test_velocity_and_drift_of_named_robots_are_derivatives(name: str) -> None:
    robot = load_robot(name)
    check_frames(robot, [robot.frame_id(robot.tool)], seed=6)


def test_centre_of_mass_moves_as_its_jacobian_says(robot: Robot) -> None:
    q, v = random_state(robot, np.random.default_rng(7))
    velocity = along(robot, q, v, robot.com_position)
    np.testing.assert_allclose(robot.com_jacobian() @ v, velocity, atol=1e-8)
    slope = along(robot, q, v, lambda: robot.com_jacobian() @ robot.v)
    np.testing.assert_allclose(robot.com_drift(), slope, atol=1e-7)


def test_free_motion_keeps_its_energy(robot: Robot, files: dict[str, Path]) -> None:
    """With M a + bias = 0, kinetic plus potential energy does not change."""
    q, v = random_state(robot, np.random.default_rng(8))
    robot.update(q, v)
    a = np.linalg.solve(robot.M, -robot.bias)
    energies = []
    for sign in (1.0, -1.0):
        h = sign * STEP
        robot.update(robot.integrate(q, v + 0.5 * h * a, h), v + h * a)
        energies.append(kinetic_energy(robot))
    robot.update(q, v)
    power = (energies[0] - energies[1]) / (2.0 * STEP)
    assert power == pytest.approx(-robot.gravity @ v, abs=1e-6 * (1 + abs(power)))


def test_gravity_is_the_slope_of_the_potential(files: dict[str, Path], backend: str) -> None:
    robot = load_robot(files["oddity"], backend=backend)
    urdf = read_urdf(files["oddity"])
    mass = sum(inertia_of(urdf.links[link])[0] for link in urdf.links if link != urdf.root)
    q, _ = random_state(robot, np.random.default_rng(9))
    down = np.array([0.0, 0.0, -9.81])
    for j, e in enumerate(np.eye(robot.nv)):
        slope = along(robot, q, e, lambda: potential_energy(robot, mass, down))
        assert robot.gravity[j] == pytest.approx(float(slope), abs=1e-7)


def test_bias_at_rest_is_gravity(robot: Robot) -> None:
    q, v = random_state(robot, np.random.default_rng(10))
    robot.update(q, np.zeros_like(v))
    np.testing.assert_allclose(robot.bias, robot.gravity, atol=1e-10)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", [p for p in NAMES if p.values[0] in ("panda", "kinova", "g1")])
def test_inertia_is_the_sum_over_the_links(name: str, backend: str) -> None:
    """M = sum_i J_i^T diag(m_i, I_i) J_i at each link's centre of mass."""
    robot = load_robot(name, backend=backend)
    assert robot.source is not None
    urdf = read_urdf(robot.source, robot.locked_joints)
    robot.update(*random_state(robot, np.random.default_rng(11)))
    total = np.diag(np.where(robot.actuated, robot.description.armature, 0.0))
    for link in urdf.links:
        mass, center, tensor = inertia_of(urdf.links[link])
        frame = robot.frame_id(link)
        J, R = robot.jacobian(frame), robot.rotation(frame)
        linear = J[:3] - np.cross(R @ center, J[3:], axisa=0, axisb=0, axisc=0)
        total += mass * linear.T @ linear + J[3:].T @ (R @ tensor @ R.T) @ J[3:]
    np.testing.assert_allclose(robot.M, total, atol=1e-10)


def test_armature_adds_to_the_diagonal(
    files: dict[str, Path], tmp_path: Path, backend: str
) -> None:
    plain = tmp_path / "plain.xml"
    plain.write_text(files["medley"].read_text().replace('armature="0.03"', 'armature="0"'))
    with_rotors = load_robot(files["medley"], backend=backend)
    without = load_robot(plain, backend=backend)
    rotors = np.where(with_rotors.actuated, 0.03, 0.0)
    np.testing.assert_allclose(with_rotors.M - without.M, np.diag(rotors), atol=1e-12)
