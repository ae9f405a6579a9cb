"""A payload is the body that would be welded on, and comes and goes without a step."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import opspace as osc
from opspace import InputError, Payload, UnknownNameError, load_robot
from opspace.controller.reference import ReferenceController
from opspace.robots.adapter import AdapterBase
from tests.robots.hands_and_scenes import GRIPPER, MOTORS, arm_on_a_table
from tests.robots.samples import BACKENDS, random_state

TENSOR = np.array([[0.03, 0.004, -0.002], [0.004, 0.02, 0.001], [-0.002, 0.001, 0.025]])
CENTRE = np.array([0.02, -0.03, 0.08])


def welded(text: str, site: str, share: float = 1.0) -> str:
    """Write the payload into a file, as a body where a site is."""
    start = text.index(f'<site name="{site}"')
    end = text.index("/>", start) + 2
    place = "".join(re.findall(r' (?:pos|quat|euler)="[^"]*"', text[start:end]))
    numbers = share * TENSOR[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    body = (
        f"<body{place}><inertial pos='{' '.join(map(str, CENTRE))}' mass='{3.0 * share}' "
        f"fullinertia='{' '.join(map(str, numbers))}'/></body>"
    )
    return text[:end] + body + text[end:]


def files(folder: Path) -> dict[str, tuple[Path, str]]:
    """Give files by what is odd about them, each with a site."""
    puma = Path(load_robot("puma560").source)
    lead = '<equality><joint joint1="left_driver" joint2="right_driver"/></equality>'
    hand = arm_on_a_table(
        folder / "hand.xml",
        hand=GRIPPER,
        more=lead,
        motors=MOTORS + '<motor joint="right_driver"/>',
    )
    turned = folder / "turned.xml"
    turned.write_text(
        arm_on_a_table(turned)
        .read_text()
        .replace('pos=".3 0 0"/>', 'pos=".3 0 .1" euler="20 40 -70"/>')
    )
    lifted = arm_on_a_table(folder / "lifted.xml")
    lifted.write_text(
        lifted.read_text().replace('<body name="upper"', '<body name="upper" gravcomp=".4"')
    )
    return {"puma": (puma, "tool"), **{p.stem: (p, "wrist") for p in (hand, turned, lifted)}}


def load_of(site: str) -> Payload:
    return Payload(3.0, CENTRE, TENSOR, frame=site)


def read(path: Path, **options: Any) -> AdapterBase:
    return load_robot(path, **options)


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize("backend", BACKENDS)
def test_the_robot_is_the_one_with_the_body_welded_on(tmp_path: Path, backend: str) -> None:
    rng = np.random.default_rng(11)
    for what, (path, site) in files(tmp_path).items():
        heavy = tmp_path / f"heavy_{path.name}"
        heavy.write_text(welded(path.read_text(), site))
        robot, other = (read(p, backend=backend) for p in (path, heavy))
        light = read(path, backend=backend)
        for state in (random_state(robot, rng), random_state(robot, rng)):
            robot.payload = load_of(site)
            robot.update(*state)
            other.update(*state)
            for question in ("M", "bias", "gravity"):
                given, expected = getattr(robot, question), getattr(other, question)
                np.testing.assert_allclose(
                    given, expected, atol=1e-10, err_msg=f"{what} {question}"
                )
            for question in ("com_position", "com_jacobian", "com_drift"):
                given, expected = getattr(robot, question)(), getattr(other, question)()
                np.testing.assert_allclose(
                    given, expected, atol=1e-11, err_msg=f"{what} {question}"
                )
            for copied in (robot.fresh(), copy.deepcopy(robot)):
                copied.place(*state)
                np.testing.assert_allclose(copied.bias, other.bias, atol=1e-10)
            robot.payload = None
            light.update(*state)
            np.testing.assert_array_equal(robot.M, light.M)
            np.testing.assert_array_equal(robot.bias, light.bias)


@pytest.mark.parametrize("own", ["compiled", "library"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_compiled_code_computes_the_same(
    tmp_path: Path, backend: str, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(load_robot("puma560").source)
    heavy = tmp_path / "puma560.xml"
    heavy.write_text(welded(path.read_text(), "tool"))
    robot, other = (read(p, backend=backend) for p in (path, heavy))
    if own == "library":
        monkeypatch.setattr(type(robot), "rigid_model", lambda self: None)
    stacks = [
        osc.Stack([[osc.OrientationTask()], [osc.ComTask(axes="xy")], [osc.PostureTask()]])
        for _ in range(3)
    ]
    fast, slow = osc.Controller(robot, stacks[0]), ReferenceController(robot, stacks[1])
    oracle = ReferenceController(other, stacks[2])
    rng = np.random.default_rng(5)
    fast.carry(load_of("tool"), duration=0.0)
    for k in range(3):
        q, v = robot.q_reference + rng.uniform(-0.2, 0.2, 6), rng.uniform(-1.0, 1.0, 6)
        taus = [c.step(0.001 * k, q, v).tau for c in (fast, slow)]
        np.testing.assert_allclose(*taus, atol=1e-9)
        # References of σ are those without the payload: the torque of the law is nearly the same.
        robot.update(q, v)
        np.testing.assert_allclose(oracle.step(0.001 * k, q, v).tau, taus[0], rtol=0.02, atol=0.2)
        np.testing.assert_allclose(robot.bias, other.bias, atol=1e-9)
    if own == "compiled":
        batch = fast.torque_batch(np.array([q, q]), np.array([v, v]))
        np.testing.assert_allclose(batch[1], taus[0], atol=1e-9)


def torques(controller: Any, q: np.ndarray, v: np.ndarray, times: np.ndarray) -> np.ndarray:
    return np.array([controller.step(t, q, v).tau for t in times])


@pytest.mark.parametrize(("kind", "n"), [(osc.Controller, 400), (ReferenceController, 80)])
def test_it_comes_and_goes_without_a_step(tmp_path: Path, kind: Any, n: int) -> None:
    """Half way the model is the one that carries half, and no tick moves the torque by more than
    the profile's steepest slope does."""
    path = Path(load_robot("puma560").source)
    half = tmp_path / "half.xml"
    half.write_text(welded(path.read_text(), "tool", 0.5))
    robot, with_half = load_robot("puma560"), load_robot(half)
    q, v = robot.q_reference, np.linspace(-0.5, 0.5, 6)
    controller = kind(robot, osc.Stack([osc.PostureTask(q)]))
    before = controller.step(0.0, q, v).tau
    controller.carry(load_of("tool"), duration=0.4)
    dt = 0.4 / n
    times = dt * np.arange(1, n + n // 4)
    coming = torques(controller, q, v, times)
    np.testing.assert_array_equal(coming[0], before)
    np.testing.assert_array_equal(coming[-1], coming[n + 1])
    change = np.abs(coming[-1] - before).max()
    assert change > 5.0
    steps = np.abs(np.diff(np.vstack([before, coming]), axis=0)).max()
    assert steps < 1.05 * change * 1.875 / n
    oracle = ReferenceController(with_half, osc.Stack([osc.PostureTask(q)]))
    np.testing.assert_allclose(coming[n // 2], oracle.step(0.0, q, v).tau, atol=1e-9)
    # Out again, thought better of half way, after a pause.
    controller.carry(None, duration=0.4)
    out = torques(controller, q, v, 0.6 + dt * np.arange(n // 2))
    np.testing.assert_array_equal(out[0], coming[-1])
    controller.restart()
    on = torques(controller, q, v, 7.0 + dt * np.arange(10))
    assert np.abs(on[0] - out[-1]).max() < 2.0 * steps
    controller.carry(load_of("tool"), duration=0.2)
    back = torques(controller, q, v, 7.0 + dt * np.arange(10, n))
    assert np.abs(np.diff(np.vstack([on[-1], back]), axis=0)).max() < 2.0 * steps
    np.testing.assert_allclose(back[-1], coming[-1], atol=1e-9)
    assert robot.payload == load_of("tool")


def test_a_regrasp_moves_it_from_frame_to_frame() -> None:
    robot = load_robot("puma560")
    robot.add_frame("tcp", placement=[0.0, 0.1, 0.1])
    q, v = robot.q_reference, np.zeros(6)
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask(q)]))
    controller.carry(Payload(2.0), duration=0.0)
    first = controller.step(0.0, q, v).tau
    controller.carry(Payload(2.0, frame="tcp"), duration=0.1)
    tau = torques(controller, q, v, 0.001 * np.arange(1, 150))
    np.testing.assert_allclose(tau[0], first, atol=1e-12)
    robot.payload = Payload(2.0, centre=[0.0, 0.1, 0.1])
    np.testing.assert_allclose(tau[-1], controller.step(0.2, q, v).tau, atol=1e-9)


def test_an_arm_that_knows_its_payload_holds_it(tmp_path: Path) -> None:
    """3 kg that appear in the simulator, known or not."""
    path = Path(load_robot("puma560").source)
    heavy = tmp_path / "heavy.xml"
    heavy.write_text(welded(path.read_text(), "tool"))
    off = []
    for payload in (None, load_of("tool")):
        robot, plant = load_robot(path), osc.Plant(load_robot(heavy), load_robot(path).q_reference)
        robot.payload = payload
        start = robot.position("tool").copy()
        controller = osc.Controller(robot, osc.Stack([osc.PoseTask(), osc.PostureTask()]))
        osc.simulate(plant, controller, 0.4)
        robot.update(plant.q, plant.v)
        off.append(np.abs(robot.position("tool") - start).max())
    assert off[0] > 0.01
    assert off[1] < 1e-5


def test_what_cannot_be_carried_is_refused() -> None:
    robot = load_robot("puma560")
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask()]))
    for wrong, sentence in (
        ({"mass": -1.0}, "must be >= 0 kg"),
        ({"mass": "heavy"}, "the mass of a payload must be finite"),
        ({"mass": 1.0, "centre": [0.1]}, "the centre of a payload must be finite"),
        ({"mass": 1.0, "inertia": [1.0, 1.0, 3.0]}, "one that a body can have"),
        ({"mass": 1.0, "inertia": -np.eye(3)}, "symmetric and positive"),
    ):
        with pytest.raises(InputError, match=sentence):
            Payload(**wrong)
    for carry in (controller.carry, lambda p: setattr(robot, "payload", p)):
        with pytest.raises(UnknownNameError, match="frame of puma560 'hnad'"):
            carry(Payload(1.0, frame="hnad"))
        with pytest.raises(InputError, match="'world' of puma560 does not move"):
            carry(Payload(1.0, frame="world"))
        with pytest.raises(InputError, match="a Payload or None, not a float"):
            carry(2.0)
    with pytest.raises(InputError, match="duration in which a payload changes"):
        controller.carry(Payload(1.0), duration=-1.0)
