"""What files are shipped with and no body has: it is computed with as it is, and said."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace import ModelError, ModelWarning, load_robot
from opspace.robots.adapter import AdapterBase
from tests.robots.samples import BACKENDS, random_state
from tests.robots.serial_arms import fixed, part, serial_arm


def changed(tmp_path: Path, link: str, inertia: str, *parts: str, axes: str = "zyyzyz") -> Path:
    """Write an arm one of whose links has the given moments."""
    path = serial_arm(tmp_path / "arm.urdf", axes, *parts)
    text = path.read_text()
    start = text.index("<inertia ", text.index(f'<link name="{link}">'))
    end = text.index("/>", start) + 2
    path.write_text(text[:start] + inertia + text[end:])
    return path


def moments(xx: float, yy: float, zz: float, xy: float = 0.0) -> str:
    return f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="0" iyz="0"/>'


def told(path: Path, **options: str) -> tuple[AdapterBase, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ModelWarning)
        robot = load_robot(path, **options)  # pyright: ignore[reportArgumentType]
    return robot, [str(w.message) for w in caught]


@pytest.mark.parametrize(
    ("link", "inertia"),
    [
        ("l2", moments(0.001, 0.001, 0.5)),
        ("l3", moments(0.4, 0.1, 0.1)),
        ("l5", moments(0.01, 0.01, 0.01, xy=0.009)),
        ("l6", moments(0.0, 0.0, 0.03)),
    ],
)
def test_an_impossible_inertia_is_said_and_simulated_as_it_is(
    tmp_path: Path, link: str, inertia: str
) -> None:
    path = changed(tmp_path, link, inertia)
    robot, said = told(path)
    other, _ = told(path, backend="mujoco")
    assert len(said) == 1
    assert f"no body has the inertia of {link}," in said[0]
    q, v = random_state(robot, np.random.default_rng(3))
    for one in (robot, other):
        one.update(q, v)
    np.testing.assert_allclose(robot.M, other.M, atol=1e-11)
    np.testing.assert_allclose(robot.bias, other.bias, atol=1e-10)
    plant = osc.Plant(robot, q, v, dt=1e-6, torque_limits=False)
    tau = np.linspace(-3.0, 5.0, robot.nv)
    expected = np.linalg.solve(robot.M, tau - robot.bias)
    plant.advance(tau)
    np.testing.assert_allclose((plant.v - v) / plant.dt, expected, rtol=1e-3, atol=1e-2)


@pytest.mark.parametrize(
    ("link", "inertia"),
    [
        ("l0", moments(0.001, 0.001, 0.5)),  # it stands still
        ("l3", moments(0.01, 0.01, 0.0201)),  # rounding in the file
        ("l4", moments(0.02, 0.01, 0.01)),
        ("l4", moments(0.0, 0.0, 0.0)),
    ],
)
def test_what_makes_no_difference_is_not_said(tmp_path: Path, link: str, inertia: str) -> None:
    robot, said = told(changed(tmp_path, link, inertia))
    assert not said
    osc.Plant(robot, robot.q_reference)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("joint", ["j6", "j5"])
def test_a_joint_that_moves_nothing_of_its_own_is_refused(
    tmp_path: Path, joint: str, backend: str
) -> None:
    """Without mass beyond it, or with a point of mass that the joint before moves alike."""
    path = serial_arm(tmp_path / "arm.urdf", "zyyzyy")
    text, links = path.read_text(), ("l5", "l6") if joint == "j5" else ("l6",)
    for link in links:
        text = text.replace(part(link, 2.0 / int(link[1])), f'<link name="{link}"/>')
    path.write_text(text)
    with pytest.raises(ModelError) as refused:
        osc.Controller(load_robot(path, backend=backend), osc.Stack([osc.PostureTask()]))
    assert f"'{joint}'" in str(refused.value)
    assert "moves no mass of its own" in str(refused.value)
    assert "<inertial>" in str(refused.value)


def test_points_of_mass_move_alike_about_two_axes_in_a_line(tmp_path: Path) -> None:
    """Both joints have inertia, but no torque tells one from the other."""
    path = serial_arm(tmp_path / "arm.urdf", "zzy")
    text = path.read_text().replace(part("l1", 2.0), '<link name="l1"/>')
    path.write_text(text)
    with pytest.raises(ModelError, match="'j2' moves no mass of its own"):
        osc.Controller(load_robot(path), osc.Stack([osc.PostureTask()]))


def test_a_held_link_has_what_inertia_it_likes(tmp_path: Path) -> None:
    path = changed(
        tmp_path, "camera", moments(0, 0, 1.0), fixed("l0", "camera", link=part("camera"))
    )
    assert not told(path)[1]
