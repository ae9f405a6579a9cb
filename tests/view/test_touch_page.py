"""What the page shows of force tasks: arrows as long as forces, bars of confidence, what is touched."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.loop.requests import Changes, RunRequest
from opspace.record.growing import GrowingRecording
from opspace.record.observer import TickRecorder
from opspace.scenario.load import load_scenario
from opspace.view.frame import Frame, FrameReader, TouchFrame
from opspace.view.touch_panel import touches
from opspace.view.touch_scene import pushed
from opspace.view.touched_shapes import touched_mesh

NONE = np.zeros(0)
PARTS = st.floats(0.0, 1.0)


def touch(name="press", confidence=1.0, activation=1.0, measured=10.0):
    wrench = np.array([0.0, 0.0, -measured])
    push = np.array([-10.0, 0.3])
    return TouchFrame(name, activation, confidence, push, push, wrench)


def shown(*found):
    frame = Frame(0.0, NONE, NONE, NONE, (), (), {}, 0, touches=found)
    return touches(frame, {one.name: {"force": [-10.0]} for one in found})


@given(PARTS, PARTS)
def test_a_task_pushes_as_far_as_it_is_there_and_touches(c, h):
    axes = np.array([[0.6, 0.0, 0.8]])
    found = pushed(touch(confidence=c, activation=h), axes)
    np.testing.assert_allclose(found, c * h * -10.0 * axes[0])


@given(st.text(min_size=1, max_size=8), PARTS)
def test_a_bar_is_as_long_as_the_confidence(name, c):
    text = shown(touch(name, c, measured=12.34))
    assert f'data-opspace-c="{c:.3f}"' in text
    assert f"width:{100.0 * c:.1f}%" in text
    assert "10.0 N" in text
    assert "12.3 N" in text
    assert text.count("<div") == text.count("</div")


def test_what_is_not_there_or_not_measured_has_no_number():
    text = shown(touch(confidence=math.nan, measured=math.nan))
    assert "N<" not in text
    assert "width:0.0%" in text
    assert shown() == ""


@pytest.mark.parametrize("name", ["wipe", "edge", "button", "push", "peg"])
def test_what_is_touched_is_drawn_where_it_is(name):
    """Its middle is on the drawn shape, and outwards of it is nothing but the rim of a hole."""
    plant = load_scenario(name).model_dump(mode="json")["plant"]
    (about,) = [*plant["surfaces"], *plant["holes"]]
    mesh = touched_mesh(about)
    assert mesh.is_watertight
    point, normal = np.array(about["point"]), np.array(about["normal"])
    normal = normal / np.linalg.norm(normal)
    depth = about.get("depth", 0.0)
    assert np.min(np.linalg.norm(mesh.vertices - (point - depth * normal), axis=1)) < 1e-9
    assert np.max((mesh.vertices - point) @ normal) < 1e-9
    if about.get("bevel"):
        # The depth of the rim is that which pushes.
        surface = osc.Surface(**{k: v for k, v in about.items() if v is not None})
        out = np.linalg.norm(mesh.vertices[:, :2] - point[:2], axis=1)
        upper = mesh.vertices[(mesh.vertices[:, 2] > point[2] - about["bevel"]) & (out > 0.0)]
        for vertex in upper:
            assert not surface.force(vertex + [0.0, 0.0, 1e-9], np.zeros(3)).any()
            inner = vertex - 1e-6 * (vertex - point)
            assert surface.force(inner - [0.0, 0.0, 1e-5], np.zeros(3))[2] > 0.0


class Pressing:
    """An arm above a table that is told wrenches by hand."""

    def __init__(self, directory):
        self.robot = osc.load_robot("puma560")
        self.press = osc.ForceTask(force=-10.0, axes_frame="world", name="press")
        self.spring = osc.ImpedanceTask(stiffness=[100.0, 200.0, 0.0], name="spring")
        stack = osc.Stack([self.press, self.spring, osc.PostureTask()])
        self.controller = osc.Controller(self.robot, stack, period=0.001)
        self.recorder = TickRecorder(directory, self.controller, {})
        self.changes = Changes(self.controller)
        self.t = 0.0

    def go(self, wrench):
        q, v = self.robot.q_reference, np.zeros(6)
        command = self.controller.step(self.t, q, v, wrenches={self.robot.tool: wrench})
        self.recorder.observe(q, v, command)
        self.changes.follow(self.t)
        self.t += 0.001
        return command


def test_touches_are_read_from_a_recording(tmp_path):
    run = Pressing(tmp_path)
    wrench = np.array([1.0, 0.0, -8.0, 0.0, 0.0, 0.0])
    for _ in range(30):
        run.go(wrench)
    for _ in range(15):
        run.go(None)
    run.controller.stack.remove(run.press, 0.005)
    for _ in range(10):
        run.go(None)
    reader = FrameReader(GrowingRecording(tmp_path))
    (found,) = reader.at(29).touches
    assert found.confidence == pytest.approx(float(reader.recording.data[29][
        reader.recording.index["touch/press/confidence"]
    ]))  # fmt: skip
    np.testing.assert_allclose(found.wanted, [-10.0])
    np.testing.assert_array_equal(found.wrench, wrench[:3])
    assert np.all(np.isfinite(reader.at(35).touches[0].wrench))
    # None has come for longer than a wrench is shown, and then the task is gone.
    assert np.isnan(reader.at(44).touches[0].wrench).all()
    assert math.isnan(reader.at(54).touches[0].confidence)


def test_forces_and_springs_change_when_they_are_asked_to(tmp_path):
    run = Pressing(tmp_path)
    run.go(np.zeros(6))
    run.changes.apply(RunRequest("press", ("press",), force=(-20.0,)), run.t)
    run.changes.apply(
        RunRequest("spring", ("spring",), stiffness=(50.0, 100.0, 0.0), duration=0.01), run.t
    )
    assert run.spring.stiffness[0] == 100.0
    for _ in range(20):
        run.go(np.zeros(6))
    assert run.press.force.tolist() == [-20.0]
    assert run.spring.stiffness.tolist() == [50.0, 100.0, 0.0]
    for _ in range(100):
        run.go(np.zeros(6))
    assert run.press.touch.commanded.tolist() == [-20.0]


@pytest.mark.parametrize(
    ("request_", "says"),
    [
        (RunRequest("press", ("spring",), force=(5.0, 0.0, 0.0)), "no ForceTask"),
        (RunRequest("press", ("press",), force=(5.0, 0.0)), "shape"),
        (RunRequest("press", ("press",), force=(0.0,)), "force of zero"),
        (RunRequest("spring", ("press",), stiffness=(5.0,)), "no ImpedanceTask"),
        (RunRequest("spring", ("spring",), stiffness=(-5.0, 0.0, 0.0)), "at least zero"),
        (RunRequest("spring", ("spring",), stiffness=(5.0,)), "shape"),
    ],
)
def test_what_a_task_cannot_do_is_refused_and_changes_nothing(tmp_path, request_, says):
    run = Pressing(tmp_path)
    with pytest.raises(osc.InputError, match=says):
        run.changes.apply(request_, 0.0)
    assert run.press.force.tolist() == [-10.0]
    assert run.spring.stiffness.tolist() == [100.0, 200.0, 0.0]
