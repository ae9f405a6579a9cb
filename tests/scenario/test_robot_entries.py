"""Frames of one's own, a payload and a reference posture, as the constructors take them."""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace import Payload, ScenarioError, load_robot
from opspace.loop import simulate
from opspace.robots.adapter import AdapterBase
from opspace.scenario.build import build, build_robot
from opspace.scenario.load import scenario_from
from opspace.scenario.robot_entries import FrameEntry, PayloadEntry
from tests.robots.samples import BACKENDS
from tests.robots.serial_arms import serial_arm

TASKS = {"hold": {"type": "position", "level": 0}, "rest": {"type": "posture", "level": 1}}
FRAMES = {
    "grip": {"placement": [0.01, 0.0, 0.1]},
    "camera": {"parent": "grip", "placement": [0.0, 0.05, 0.0, 0.8, 0.0, 0.6, 0.0]},
}
LOADS = {
    "a point on the tool": {"mass": 1.5},
    "off the frame's origin": {"mass": 0.8, "centre": [0.02, 0.0, 0.06], "frame": "grip"},
    "a flat plate": {"mass": 2.0, "inertia": [0.01, 0.01, 0.02], "frame": "camera"},
    "turned axes": {
        "mass": 1.0,
        "centre": [0.0, 0.1, 0.0],
        "inertia": [[0.02, 0.003, 0.0], [0.003, 0.03, 0.001], [0.0, 0.001, 0.025]],
        "frame": "camera",
    },
}


def told(**said: object) -> osc.Scenario:
    return scenario_from({"robot": "panda", "duration": 0.5, "tasks": TASKS, **said})


@pytest.mark.parametrize(
    ("entry", "made"), [(PayloadEntry, Payload), (FrameEntry, AdapterBase.add_frame)]
)
def test_keys_and_defaults_are_those_of_the_constructor(entry: type, made: object) -> None:
    arguments = dict(inspect.signature(made).parameters)  # pyright: ignore[reportArgumentType]
    wanted = {
        name: argument.default
        for name, argument in arguments.items()
        if name not in ("self", "name")
    }
    found = {
        name: inspect.Parameter.empty if field.is_required() else field.default
        for name, field in entry.model_fields.items()  # pyright: ignore[reportAttributeAccessIssue]
    }
    assert found == wanted


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
@pytest.mark.parametrize("backend", BACKENDS)
def test_frames_and_payload_are_the_robots(load: dict[str, object], backend: str) -> None:
    robot = build_robot(told(backend=backend, frames=FRAMES, payload=load, tool="camera"))
    other = load_robot("panda", backend=backend)
    other.add_frame("grip", placement=[0.01, 0.0, 0.1])
    other.add_frame("camera", "grip", [0.0, 0.05, 0.0, 0.8, 0.0, 0.6, 0.0])
    other.tool = "camera"
    other.payload = Payload(**load)  # pyright: ignore[reportArgumentType]
    q = robot.q_reference + 0.2
    for one in (robot, other):
        one.update(q, np.ones(robot.nv))
    assert robot.tool == "camera"
    assert isinstance(robot, AdapterBase)
    assert robot.payload == other.payload
    np.testing.assert_array_equal(robot.M, other.M)
    np.testing.assert_array_equal(robot.bias, other.bias)
    np.testing.assert_array_equal(
        robot.position(robot.frame_id("camera")), other.position(other.frame_id("camera"))
    )


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
def test_the_simulated_robot_carries_it(load: dict[str, object]) -> None:
    built = build(told(frames=FRAMES, payload=load))
    robot, plant = built.robot, built.plant
    robot.update(plant.q, np.zeros(robot.nv))
    start, before = robot.position(robot.frame_id(robot.tool)).copy(), robot.bias.copy()
    tau = robot.bias + np.linspace(-2.0, 2.0, robot.nv)
    expected = np.linalg.solve(robot.M, tau - before)
    light = osc.Plant(load_robot("panda"), plant.q, dt=1e-6)
    fine = osc.Plant(robot, plant.q, dt=1e-6)
    for one in (fine, light):
        one.advance(tau)
    np.testing.assert_allclose(fine.v / 1e-6, expected, rtol=1e-4, atol=1e-4)
    assert np.abs(light.v / 1e-6 - expected).max() > 0.1
    simulate(plant, built.controller, 0.5)
    robot.update(plant.q, plant.v)
    assert np.abs(robot.position(robot.frame_id(robot.tool)) - start).max() < 1e-6


def test_sites_that_angles_turn_carry_it_where_they_are(tmp_path: Path) -> None:
    """A site in a frame of the file, turned by angles, and one that is named like a body."""
    path = tmp_path / "turned.xml"
    path.write_text(
        '<mujoco><worldbody><body name="fore" pos="0 0 1"><joint name="a" axis="0 1 0"/>'
        '<geom size=".05" mass="2" pos=".1 0 0"/><frame pos=".2 .1 0" euler="20 30 0">'
        '<site name="fore" pos=".1 0 .1" euler="40 -10 60"/></frame></body></worldbody></mujoco>'
    )
    with pytest.warns(osc.ModelWarning, match="a body and a site"):
        robot = load_robot(path)
    robot.payload = Payload(1.0, [0.3, 0.1, -0.2], [0.01, 0.02, 0.02], frame="site:fore")
    q, v = np.array([0.4]), np.array([2.0])
    robot.update(q, v)
    plant = osc.Plant(robot, q, v, dt=1e-6)
    plant.advance(np.zeros(1))
    expected = np.linalg.solve(robot.M, -robot.bias)
    np.testing.assert_allclose((plant.v - v) / 1e-6, expected, rtol=1e-4)


def test_quaternions_with_three_decimals_are_made_exact() -> None:
    robot = build_robot(told(frames={"seen": {"placement": [0, 0, 0, 0.707, 0, 0.707, 0]}}))
    R = robot.rotation(robot.frame_id("seen"))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)


def test_a_plant_keeps_what_it_was_made_with() -> None:
    robot = load_robot("panda")
    robot.payload = Payload(1.0)
    heavy = osc.Plant(robot, robot.q_reference)
    robot.payload = None
    assert heavy.model.body_mass.sum() == pytest.approx(
        1.0 + osc.Plant(robot, robot.q_reference).model.body_mass.sum()
    )


def test_a_reference_posture_by_joint(tmp_path: Path) -> None:
    path = serial_arm(tmp_path / "arm.urdf", "zyzyzyz")
    bent = build_robot(told(robot=str(path), reference={"j4": 0.8, "j6": -0.5}))
    np.testing.assert_array_equal(bent.q_reference, [0, 0, 0, 0.8, 0, -0.5, 0])
    started = build(told(robot=str(path), reference={"j2": 0.3}))
    assert started.plant.q[1] == 0.3


@pytest.mark.parametrize(
    ("said", "key", "words"),
    [
        ({"frames": {"grip": {"parent": "hnad"}}}, "frames.grip", "panda_hand"),
        ({"frames": {"panda_hand": {}}}, "frames.panda_hand", "has a frame 'panda_hand' already"),
        ({"payload": {"mass": 1.0, "frame": "grip"}}, "payload", "unknown frame"),
        ({"payload": {"mass": 1.0, "frame": "panda_link0"}}, "payload", "does not move"),
        ({"payload": {"mass": 1.0, "inertia": [1.0, 0.1, 0.1]}}, "payload", "a body can have"),
        ({"reference": {"panda_joint9": 0.1}}, "reference", "panda_joint7"),
        ({"tool": "grip"}, "tool", "unknown frame"),
    ],
)
def test_what_does_not_fit_the_robot_is_refused_by_key(
    said: dict[str, object], key: str, words: str
) -> None:
    with pytest.raises(ScenarioError) as refused:
        build(told(**said))
    assert refused.value.key == key
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"payload": {"mass": -1.0}}, "mass: must be a number at least 0 [kg], not -1.0"),
        ({"payload": {"mass": 1.0, "inertia": [1.0]}}, "must be a list of 3 numbers"),
        ({"payload": {"centre": [0, 0, 0]}}, "mass: is missing"),
        ({"frames": {"grip": {"placement": [1, 2]}}}, "must be [x, y, z] or"),
        ({"frames": {"grip": {"placement": [0, 0, 0, 2, 0, 0, 0]}}}, "of norm 1"),
        ({"reference": {"panda_joint1": "far"}}, "must be a number"),
    ],
)
def test_values_that_are_none_are_refused_when_read(said: dict[str, object], words: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        told(**said)
    assert words in str(refused.value)
