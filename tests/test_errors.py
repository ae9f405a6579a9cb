"""What an error tells a program, and that it survives the way to another process."""

import copy
import pickle
from typing import Any

import pytest

import opspace as osc
from opspace import errors
from opspace.pictures.offscreen import SnapshotUnavailableError
from opspace.scenario import load_scenario

NOT_FOUND = errors.unknown_name("frame", "tol", ["tool", "base"], listed=["tool"])
IN_A_FILE = osc.ScenarioError("is missing", file="my.yaml", line=3, key="tasks.position.kp")


def test_an_unknown_name_carries_the_name_and_every_choice():
    assert (NOT_FOUND.name, NOT_FOUND.kind) == ("tol", "frame")
    assert NOT_FOUND.choices == ("tool", "base")


def test_a_number_is_no_name():
    number: Any = 2
    robot = osc.load_robot("puma560")
    for task, kind in ((osc.PositionTask(number), "frame"), (osc.JointTask(number), "joint")):
        with pytest.raises(osc.UnknownNameError, match=rf"unknown {kind}.* 2 \(valid: "):
            task.bind(robot)


def test_choices_are_kept_where_the_context_is_told():
    robot = osc.load_robot("puma560")
    with pytest.raises(osc.UnknownNameError, match=r"task 'position': .*'tol'") as caught:
        osc.PositionTask("tol").bind(robot)
    assert caught.value.name == "tol"
    assert set(caught.value.choices) == set(robot.frame_names)
    for load in (osc.load_robot, load_scenario):
        with pytest.raises(osc.UnknownNameError) as caught:
            load("pumma")
        assert caught.value.name == "pumma"
        assert caught.value.choices


@pytest.mark.parametrize(
    "error",
    [
        NOT_FOUND,
        IN_A_FILE,
        osc.ScenarioError("is missing"),
        errors.missing_extra("viser", "view"),
        *(
            kind("a message")
            for kind in (
                osc.OpspaceError,
                osc.InputError,
                osc.ModelError,
                osc.RecordingError,
                SnapshotUnavailableError,
            )
        ),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_survives_pickling_and_copying(error):
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)
