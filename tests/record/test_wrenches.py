"""Wrenches in recordings and black boxes, and runs that come out of them again."""

from __future__ import annotations

import numpy as np
import pytest

import opspace as osc
from opspace.errors import InputError
from opspace.sim import Disturbances

DT = 1e-3
WRONG = Disturbances(wrench_noise=0.3, wrench_delay=2e-3, seed=4)


def pressing():
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    x = robot.position(robot.frame_id(robot.tool)).copy()
    press = osc.ForceTask(
        force=-10.0, axes_frame="world", moment_axes="x", approach_speed=0.1, name="press"
    )
    press.activation = osc.Contact(press)
    hand = osc.PositionTask(target=osc.GiveWay(x - [0.0, 0.0, 0.02], press), kp=200.0)
    stack = osc.Stack([press, osc.OrientationTask(kp=200.0), hand, osc.PostureTask()])
    controller = osc.Controller(robot, stack)
    surface = osc.Surface([0.0, 0.0, float(x[2]) - 0.005], stiffness=1e4)
    plant = osc.Plant(robot, robot.q_reference, surfaces=[surface], disturbances=WRONG)
    return controller, plant, press


def test_a_recording_holds_wrenches_and_what_was_made_of_them_and_replays(tmp_path):
    controller, plant, press = pressing()
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    osc.simulate(plant, controller, 0.4, [recorder])
    recorder.close()
    found = osc.load(tmp_path / "run")
    tool = controller.robot.tool
    assert found.units[f"wrench/{tool}/z"] == "N"
    assert found.units[f"wrench/{tool}/rx"] == "N·m"
    assert [found.units[f"tasks/press/error/{i}"] for i in (0, 1)] == ["N", "N·m"]
    np.testing.assert_array_equal(found.group(f"wrench/{tool}")[-1], controller.wrenches[tool])
    assert found["touch/press/confidence"][-1] == press.touch.confidence > 0.9
    np.testing.assert_array_equal(found.group("touch/press/commanded")[-1], press.touch.commanded)
    again = osc.replay(found, pressing()[0])
    assert again.gap == 0.0
    assert again.repeated


def test_a_black_box_keeps_wrenches_and_what_it_wrote_replays(tmp_path):
    controller, plant, _ = pressing()
    box = osc.BlackBox(controller, tmp_path, ticks=50)
    osc.simulate(plant, box, 0.2)
    with pytest.raises(InputError, match="needs the wrench"):
        box.step(0.2, plant.q, plant.v)
    box.wait()
    (written,) = box.written
    found = osc.load(written)
    assert np.isnan(found[f"wrench/{controller.robot.tool}/z"][-1])
    assert np.isfinite(found.group(f"wrench/{controller.robot.tool}")[:-1]).all()
    whole = osc.BlackBox(pressing()[0], tmp_path / "whole", ticks=500)
    osc.simulate(pressing()[1], whole, 0.2)
    with pytest.raises(InputError):
        whole.step(0.2, plant.q, np.full(6, np.nan), wrenches={controller.robot.tool: np.zeros(6)})
    whole.wait()
    assert osc.replay(whole.written[0], pressing()[0]).gap == 0.0
