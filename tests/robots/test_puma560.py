"""The shipped arm against an independent computation from the published table."""

from __future__ import annotations

import numpy as np
import pytest

from opspace.robots import load_robot
from opspace.robots.mujoco_model import mujoco_model
from tests.robots.samples import BACKENDS

# Standard Denavit-Hartenberg rows and the link's dynamics as published: d, a, alpha, mass, centre
# of mass and (Ixx, Iyy, Izz) about it in the row's frame, rotor inertia, gear ratio, viscous and
# Coulomb friction at the motor, range in degrees, peak torque at the joint.
H = np.pi / 2
D = [0.67183, 0.0, 0.15005, 0.4318, 0.0, 0.0]
A = [0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0]
ALPHA = [H, 0.0, -H, H, -H, 0.0]
MASS = [0.0, 17.4, 4.8, 0.82, 0.34, 0.09]
CENTRE = [
    [0, 0, 0],
    [-0.3638, 0.006, 0.2275],
    [-0.0203, -0.0141, 0.070],
    [0, 0.019, 0],
    [0, 0, 0],
    [0, 0, 0.032],
]
MOMENTS = [
    [0, 0.35, 0],
    [0.13, 0.524, 0.539],
    [0.066, 0.086, 0.0125],
    [1.8e-3, 1.3e-3, 1.8e-3],
    [0.3e-3, 0.4e-3, 0.3e-3],
    [0.15e-3, 0.15e-3, 0.04e-3],
]
ROTOR = np.array([200e-6, 200e-6, 200e-6, 33e-6, 33e-6, 33e-6])
GEAR = np.array([62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686])
VISCOUS = np.array([1.48e-3, 0.817e-3, 1.38e-3, 71.2e-6, 82.6e-6, 36.7e-6])
COULOMB = [
    [0.395, 0.435],
    [0.126, 0.071],
    [0.132, 0.105],
    [11.2e-3, 16.9e-3],
    [9.26e-3, 14.5e-3],
    [3.96e-3, 10.5e-3],
]
LOWER = [-160, -45, -225, -110, -100, -266]
UPPER = [160, 225, 45, 170, 100, 266]
TORQUE = [97.6, 186.4, 89.4, 24.2, 20.1, 21.3]
G = np.array([0.0, 0.0, -9.81])
CONFIGURATIONS = {
    "vertical": [0, H, -H, 0, 0, 0],
    "nominal": [0, H / 2, -np.pi, 0, H / 2, 0],
    "stretched": [0, 0, -H, 0, 0, 0],
}


def frames(q: np.ndarray) -> list[np.ndarray]:
    """Return the seven Denavit-Hartenberg frames, the world first."""
    transforms = [np.eye(4)]
    for theta, d, a, alpha in zip(q, D, A, ALPHA, strict=True):
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        row = [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        transforms.append(transforms[-1] @ np.array(row))
    return transforms


def point_jacobian(transforms: list[np.ndarray], link: int, point: np.ndarray) -> np.ndarray:
    J = np.zeros((6, 6))
    for j in range(link + 1):
        axis, origin = transforms[j][:3, 2], transforms[j][:3, 3]
        J[:3, j], J[3:, j] = np.cross(axis, point - origin), axis
    return J


def dynamics(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return M (armature included) and the gravity torque from the published numbers."""
    transforms = frames(q)
    M, gravity = np.diag(ROTOR * GEAR**2), np.zeros(6)
    for i in range(6):
        T = transforms[i + 1]
        J = point_jacobian(transforms, i, T[:3, :3] @ CENTRE[i] + T[:3, 3])
        tensor = T[:3, :3] @ np.diag(MOMENTS[i]) @ T[:3, :3].T
        M += MASS[i] * J[:3].T @ J[:3] + J[3:].T @ tensor @ J[3:]
        gravity -= MASS[i] * J[:3].T @ G
    return M, gravity


@pytest.fixture(params=BACKENDS)
def puma(request: pytest.FixtureRequest):
    return load_robot("puma560", backend=request.param)


def postures() -> list[np.ndarray]:
    rng = np.random.default_rng(30)
    random = [np.radians(rng.uniform(LOWER, UPPER)) for _ in range(5)]
    return random + [np.array(q) for q in CONFIGURATIONS.values()]


def test_kinematics_follow_the_table(puma) -> None:
    tool = puma.frame_id("tool")
    for q in postures():
        puma.update(q, np.zeros(6))
        transforms = frames(q)
        T = transforms[6]
        point = T[:3, 3] + 0.1 * T[:3, 2]
        np.testing.assert_allclose(puma.position(tool), point, atol=1e-12)
        np.testing.assert_allclose(puma.rotation(tool), T[:3, :3], atol=1e-12)
        J = point_jacobian(transforms, 5, point)
        np.testing.assert_allclose(puma.jacobian(tool), J, atol=1e-12)


def test_dynamics_follow_the_table(puma) -> None:
    for q in postures():
        puma.update(q, np.zeros(6))
        M, gravity = dynamics(q)
        # The one link whose mass is not published weighs a milligram here.
        np.testing.assert_allclose(puma.M, M, atol=1e-9)
        np.testing.assert_allclose(puma.gravity, gravity, atol=1e-9)


def test_coriolis_torque_follows_the_table(puma) -> None:
    """b = dM/dt v − ½ ∂(vᵀ M v)/∂q, by central differences of the published M."""
    h = 1e-6
    for q in postures():
        v = np.random.default_rng(31).uniform(-1, 1, 6)
        puma.update(q, v)
        rate = (dynamics(q + h * v)[0] - dynamics(q - h * v)[0]) / (2 * h) @ v
        slope = [
            v @ (dynamics(q + h * e)[0] - dynamics(q - h * e)[0]) @ v / (2 * h) for e in np.eye(6)
        ]
        coriolis = puma.bias - puma.gravity
        np.testing.assert_allclose(coriolis, rate - 0.5 * np.array(slope), atol=1e-7)


def test_limits_and_configurations_are_the_published_ones(puma) -> None:
    np.testing.assert_allclose(puma.q_lower, np.radians(LOWER), atol=1e-12)
    np.testing.assert_allclose(puma.q_upper, np.radians(UPPER), atol=1e-12)
    np.testing.assert_allclose(puma.torque_limit, TORQUE)
    for name, q in CONFIGURATIONS.items():
        np.testing.assert_allclose(puma.configurations[name], q, atol=1e-12)
    assert puma.joint_names == tuple(f"joint{i}" for i in range(1, 7))
    assert puma.tool == "tool"
    assert puma.nv == 6


def test_home_is_away_from_singularities_and_limits(puma) -> None:
    J = puma.jacobian(puma.frame_id("tool"))
    assert np.linalg.svd(J, compute_uv=False)[-1] > 0.15
    np.testing.assert_array_equal(puma.q, puma.configurations["home"])
    assert np.min(puma.q_upper - puma.q) > 0.4
    assert np.min(puma.q - puma.q_lower) > 0.4
    puma.update(puma.configurations["stretched"], np.zeros(6))
    assert np.linalg.svd(puma.jacobian(puma.frame_id("tool")), compute_uv=False)[-1] < 1e-9


def test_the_plant_has_the_published_friction_and_motors() -> None:
    model = mujoco_model(load_robot("puma560").source)
    np.testing.assert_allclose(model.dof_damping, VISCOUS * GEAR**2, rtol=2e-4)
    np.testing.assert_allclose(model.dof_frictionloss, np.mean(COULOMB, axis=1) * GEAR, rtol=2e-4)
    np.testing.assert_allclose(model.actuator_ctrlrange[:, 1], TORQUE)
    assert list(model.actuator_trnid[:, 0]) == list(range(6))
