"""Robots by name and by file, and what is said when that fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from opspace.errors import MissingExtraError, ModelError, UnknownNameError
from opspace.robots import Robot, available_robots, catalogue, load_robot
from tests.robots.samples import BACKENDS, MJCF, NAMES, URDF


@pytest.mark.parametrize("name", NAMES)
def test_a_named_robot_is_what_the_list_says(name: str) -> None:
    info = next(robot for robot in available_robots() if robot.name == name)
    robot = load_robot(name)
    assert isinstance(robot, Robot)
    assert (robot.name, robot.nv) == (name, info.dof)
    assert robot.floating_base == (info.kind != "arm") == (robot.nq == robot.nv + 1)
    assert robot.source is not None
    assert robot.source.is_file()
    assert info.description
    assert "\n" not in info.description


@pytest.mark.parametrize("name", NAMES)
def test_the_reference_posture_is_inside_the_limits_and_not_singular(name: str) -> None:
    robot = load_robot(name)
    joints = robot.q_reference[-int(robot.actuated.sum()) :]
    assert (joints > robot.q_lower[robot.actuated]).all()
    assert (joints < robot.q_upper[robot.actuated]).all()
    np.testing.assert_array_equal(robot.q, robot.q_reference)
    J = robot.jacobian(robot.frame_id(robot.tool))
    assert np.linalg.svd(J, compute_uv=False)[min(J.shape) - 1] > 0.07


@pytest.mark.parametrize(
    "name", [p for p in NAMES if p.values[0] in ("talos", "g1", "go2", "solo12")]
)
def test_a_legged_robot_stands_on_the_floor(name: str) -> None:
    robot = load_robot(name)
    heights = [robot.position(i)[2] for i in range(1, len(robot.frame_names))]
    assert -0.05 < min(heights) < 0.05
    assert robot.com_position()[2] > 0.15


def test_a_posture_names_joints_that_exist() -> None:
    for name, entry in catalogue.CATALOGUE.items():
        if catalogue.locate(entry) is None:
            continue
        robot = load_robot(name)
        assert set(entry.posture) <= set(robot.joint_names), name


def test_the_fingers_of_the_panda_are_locked() -> None:
    if "panda" not in {robot.name for robot in available_robots() if robot.installed}:
        pytest.skip("example-robot-data is not installed")
    robot = load_robot("panda")
    assert robot.locked_joints == ("panda_finger_joint1", "panda_finger_joint2")
    assert robot.joint_names[-1] == "panda_joint7"
    assert robot.source is not None
    free = load_robot(robot.source)
    # The second finger follows the first one, and neither is a tool.
    assert free.nv == 8
    assert free.tool == "panda_hand_tcp"
    q = np.append(robot.q_reference, 0.0)
    free.update(q, np.zeros(8))
    np.testing.assert_allclose(free.M[:7, :7], robot.M, atol=1e-12)


def test_names_are_listed_without_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", ["/nowhere"])
    robots = {robot.name: robot for robot in available_robots()}
    assert robots["puma560"].installed
    assert not robots["panda"].installed
    assert robots["panda"].package == "example-robot-data"
    with pytest.raises(MissingExtraError, match=r"example-robot-data.*opspace\[robots\]"):
        load_robot("panda")
    assert load_robot("puma560").nv == 6


@pytest.mark.parametrize("place", ["user/lib/python3.11/site-packages", "target", "dist-packages"])
def test_files_are_found_wherever_python_finds_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    robots = tmp_path / place / "cmeel.prefix/share/example-robot-data/robots"
    file = robots / catalogue.CATALOGUE["ur5"].file
    file.parent.mkdir(parents=True)
    file.write_text(URDF)
    monkeypatch.setattr(sys, "path", ["/nowhere", str(tmp_path / place)])
    assert catalogue.locate(catalogue.CATALOGUE["ur5"]) == file
    assert {robot.name for robot in available_robots() if robot.installed} == {"puma560", "ur5"}


def test_listing_robots_imports_no_dynamics_library() -> None:
    code = (
        "import sys; from opspace.robots import available_robots; available_robots();"
        "assert not {'pinocchio', 'mujoco'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_unknown_name_lists_near_matches() -> None:
    with pytest.raises(UnknownNameError, match=r"robot 'puma650'; did you mean 'puma560'.*\.urdf"):
        load_robot("puma650")
    with pytest.raises(UnknownNameError, match="backend 'mujoko'; did you mean 'mujoco'"):
        load_robot("puma560", backend="mujoko")


def message_of(path: Path, backend: str, **options: bool) -> str:
    with pytest.raises(ModelError) as caught:
        load_robot(path, backend=backend, **options)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(str(path))
    return text


BROKEN = {
    "not XML": URDF.replace("</robot>", ""),
    "<mujoco>, not <robot>": "<mujoco/>",
    "no <link>": "<robot name='x'/>",
    "child link 'flap' of joint 'alpha' does not exist": URDF.replace(
        '<child link="fin"/>', '<child link="flap"/>'
    ),
    "joint 'alpha' has type 'planar'": URDF.replace('"revolute"', '"planar"'),
    "joint 'zeta' occurs twice": URDF.replace('name="alpha"', 'name="zeta"'),
    "2 root links": URDF.replace('<robot name="oddity">', '<robot name="x"><link name="lost"/>'),
    "not connect the links to one tree": URDF.replace(
        '<parent link="trunk"/><child link="fin"/>', '<parent link="fin"/><child link="fin"/>'
    ),
    "joint 'slider' has no <limit>": URDF.replace(
        '<limit lower="-0.2" upper="0.4" effort="0" velocity="0"/>', ""
    ),
    "xyz='0.1 0.2' of <origin> is not 3": URDF.replace('xyz="0.1 0.2 0.3"', 'xyz="0.1 0.2"'),
    "value='heavy' of <mass>": URDF.replace('value="1.2"', 'value="heavy"'),
    "lower limit of joint 'alpha' is above": URDF.replace('upper="0.5"', 'upper="-1.5"'),
    "axis of joint 'zeta' has length zero": URDF.replace('xyz="0 2 1"', 'xyz="0 0 0"'),
}


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("reason", BROKEN)
def test_a_broken_urdf_is_refused_with_the_reason(
    tmp_path: Path, reason: str, backend: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "broken.urdf"
    path.write_text(BROKEN[reason])
    text = message_of(path, backend)
    assert reason in text
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_broken_mjcf_is_refused_with_the_reason(tmp_path: Path, backend: str) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(MJCF.replace('axis="1 0 0"/>', 'axle="1 0 0"/>'))
    assert "axle" in message_of(path, backend)
    path.write_text("<mujoco><worldbody/></mujoco>")
    assert "no joint that moves" in message_of(path, backend)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_file_that_cannot_be_used_is_named(tmp_path: Path, backend: str) -> None:
    assert "no such file" in message_of(tmp_path / "none.urdf", backend)
    assert "no such file" in message_of(tmp_path / "none.xml", backend)
    sdf = tmp_path / "robot.sdf"
    sdf.write_text("<sdf/>")
    assert "ends in .urdf or .xml" in message_of(sdf, backend)
    rooted = tmp_path / "rooted.urdf"
    rooted.write_text(URDF.replace('"trunk"', '"world"'))
    assert load_robot(rooted, backend=backend).nv == 3
    assert "cannot float" in message_of(rooted, backend, floating_base=True)


@pytest.mark.parametrize("backend", BACKENDS)
def test_urdf_limits(files: dict[str, Path], backend: str) -> None:
    robot = load_robot(files["oddity"], backend=backend)
    assert robot.joint_names == ("alpha", "zeta", "slider")
    np.testing.assert_array_equal(robot.q_lower, [-1.0, -np.inf, -0.2])
    np.testing.assert_array_equal(robot.q_upper, [0.5, np.inf, 0.4])
    # Zero effort or velocity means that the file does not know.
    np.testing.assert_array_equal(robot.torque_limit, [5.0, 12.0, np.inf])
    np.testing.assert_array_equal(robot.velocity_limit, [7.0, 3.0, np.inf])
    np.testing.assert_allclose(robot.q_reference, [-0.25, 0.0, 0.1])
    assert robot.tool == "lump"
    assert robot.frame_names[:2] == ("world", "trunk")
