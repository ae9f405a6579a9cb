"""An arm whose file says no posture gets one from which its tool can be moved and turned every way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace import load_robot
from opspace.robots.adapter import AdapterBase
from opspace.runs.check import check_robot
from tests.robots.samples import BACKENDS
from tests.robots.serial_arms import fixed, serial_arm

STRETCHED = {
    "seven joints in a line": "zyzyzyz",
    "shoulder, elbow, wrist": "zyyyzy",
    "wrist of three axes": "zyyzyz",
    "eight joints": "zyxyzyzy",
}
WAY = 0.05


def loaded(tmp_path: Path, axes: str, **options: object) -> AdapterBase:
    path = serial_arm(tmp_path / "arm.urdf", axes, fixed(f"l{len(axes)}", "tip", "0 0 .1"))
    return load_robot(path, **options)  # pyright: ignore[reportArgumentType]


def left_over(robot: AdapterBase, way: np.ndarray) -> float:
    """Ask the tool to go somewhere, and return how far it is from there in the end, m."""
    plant = osc.Plant(robot, robot.q_reference)
    robot.update(plant.q, plant.v)
    start = robot.position(robot.tool).copy()
    hand = osc.PositionTask(target=osc.MinimumJerk(start, start + way, 1.0))
    stack = osc.Stack([osc.JointLimits(), osc.OrientationTask(), hand, osc.PostureTask(kp=25.0)])
    controller = osc.Controller(robot, stack)
    osc.simulate(plant, controller, 2.5)
    return controller.step(plant.t, plant.q, plant.v).tasks["position"].error_norm


@pytest.mark.parametrize("axes", STRETCHED.values(), ids=STRETCHED)
def test_a_stretched_arm_is_bent_a_little(tmp_path: Path, axes: str) -> None:
    robot = loaded(tmp_path, axes)
    bent = np.flatnonzero(robot.q_reference)
    assert 1 <= len(bent) <= 2
    assert np.all(np.abs(robot.q_reference) <= 1.5)
    assert not any("keep an error" in words for words in check_robot(robot).warnings)


@pytest.mark.parametrize(
    "axes",
    [
        pytest.param(axes, id=name, marks=[pytest.mark.slow] * (k > 1))
        for k, (name, axes) in enumerate(STRETCHED.items())
    ],
)
def test_a_bent_arm_goes_where_it_is_told(tmp_path: Path, axes: str) -> None:
    robot = loaded(tmp_path, axes)
    for k in range(3):
        for sign in (WAY, -WAY):
            assert left_over(robot, sign * np.eye(3)[k]) < 1e-3
    straight = loaded(tmp_path, axes, reference=np.zeros(len(axes)))
    assert left_over(straight, np.array([0.0, 0.0, -WAY])) > 0.5 * WAY


@pytest.mark.parametrize("axes", STRETCHED.values(), ids=STRETCHED)
def test_both_libraries_bend_alike(tmp_path: Path, axes: str) -> None:
    first, second = (loaded(tmp_path, axes, backend=backend) for backend in BACKENDS)
    np.testing.assert_array_equal(first.q_reference, second.q_reference)


@pytest.mark.parametrize("axes", ["yyy", "zyy", "zz", "zyyyz"])
def test_what_no_posture_has_bends_nothing(tmp_path: Path, axes: str) -> None:
    """A tool that cannot be turned every way anywhere is left where the file has it."""
    robot = loaded(tmp_path, axes)
    lost = [w for w in check_robot(robot).warnings if "cannot be moved at all" in w]
    assert not np.any(robot.q_reference) or not lost


def test_a_posture_that_somebody_chose_stays(tmp_path: Path) -> None:
    chosen = loaded(tmp_path, "zyzyzyz", reference={"j4": 0.1})
    np.testing.assert_array_equal(chosen.q_reference, [0, 0, 0, 0.1, 0, 0, 0])
    assert any("singularity" in words for words in check_robot(chosen).warnings)
    model = tmp_path / "keyed.xml"
    path = serial_arm(tmp_path / "arm.urdf", "zyzyzyz")
    import mujoco

    text = mujoco.MjSpec.from_file(str(path)).to_xml()
    model.write_text(
        text.replace("</mujoco>", '<keyframe><key qpos="0 0 0 0 0 0 0"/></keyframe></mujoco>')
    )
    assert not np.any(load_robot(model).q_reference)


def test_bending_keeps_within_the_ranges(tmp_path: Path) -> None:
    path = serial_arm(tmp_path / "arm.urdf", "zyzyzyz")
    text = path.read_text().replace('lower="-2.5" upper="2.5"', 'lower="-1.2" upper="0.4"')
    path.write_text(text)
    robot = load_robot(path)
    assert np.all((robot.q_lower < robot.q_reference) & (robot.q_reference < robot.q_upper))
