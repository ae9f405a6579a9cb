"""A tick answers one number: what happened, and how many hard torques it took; and more by name."""

import copy
import pickle

import numpy as np
import pytest

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController
from opspace.controller.controller import STATUSES
from opspace.kernels.columns import SOLVE

EVERYTHING = sum(int(flag) for flag in Status)


def test_flags_are_bits_of_their_own():
    assert all(int(flag).bit_count() <= 1 for flag in Status)
    assert len({int(flag) for flag in Status}) == len(list(Status))


@pytest.mark.parametrize("solves", [0, 1, 7, 2**40])
def test_no_flag_is_read_as_hard_torques(solves):
    for status in (Status.OK, *Status, Status(EVERYTHING)):
        answer = int(status) + SOLVE * solves
        assert (STATUSES[answer % SOLVE], answer // SOLVE) == (status, solves), status


def test_every_pair_of_flags_has_its_status():
    assert SOLVE > EVERYTHING
    for a in Status:
        for b in Status:
            assert STATUSES[int(a) | int(b)] == a | b


@pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
@pytest.mark.parametrize("name", ["hand", "posturee", "", "elbow"])
def test_a_name_of_which_a_tick_tells_nothing_is_refused(kind, name):
    robot = osc.load_robot("puma560")
    stack = osc.Stack([osc.PositionTask(), osc.PostureTask()])
    command = kind(robot, stack).step(0.0, robot.q_reference, np.zeros(6))
    for answer in (command, pickle.loads(pickle.dumps(command)), copy.deepcopy(command)):
        assert name not in answer.tasks
        assert answer.tasks.get(name) is None
        with pytest.raises(osc.UnknownNameError, match=rf"'{name}'.*valid: position, posture") as e:
            answer.tasks[name]
        assert e.value.choices == ("position", "posture")
        for told in (answer.contacts, answer.distances):
            with pytest.raises(KeyError, match=rf"'{name}' \(valid: none\)"):
                told[name]
