"""Bad input is refused before any torque, by name and with what was expected."""

import numpy as np
import pytest

from opspace.errors import InputError, OpspaceError, UnknownNameError
from opspace.law import SigmaBuffer, TaskSet, intermediate_values, task_torque

J, F = np.ones((1, 3)), np.ones(1)
GOOD = TaskSet(J, F)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.ones(3), F), r"task set 'reach': J must have shape \(m, n\), got \(3,\)"),
        ((J, np.ones(2)), r"task set 'reach': f must have shape \(1,\) like J's rows, got \(2,\)"),
        ((J * np.nan, F), "task set 'reach': J has entries that are not finite"),
        ((J, F * np.inf), "task set 'reach': f has entries that are not finite"),
        (([["a"]], F), "task set 'reach': J is not an array of numbers"),
        ((J, F, True), "task set 'reach': priority must be a whole number, got True"),
        ((J, F, 0, 1.5), r"task set 'reach': activation must be in \[0, 1\], got 1.5"),
        ((J, F, 0, -0.1), r"task set 'reach': activation must be in \[0, 1\], got -0.1"),
        ((J, F, 0, np.nan), r"task set 'reach': activation must be in \[0, 1\], got nan"),
    ],
)
def test_task_sets(arguments, message):
    with pytest.raises(InputError, match=message):
        TaskSet(*arguments, name="reach")


@pytest.mark.parametrize("reference", [0.0, -1.0, [1.0, 2.0], [np.nan]])
def test_sigma_references(reference):
    with pytest.raises(InputError, match="task set: sigma_reference"):
        TaskSet(J, F, sigma_reference=reference)


@pytest.mark.parametrize(
    ("M", "message"),
    [
        (np.ones(3), r"inertia M must have shape \(n, n\)"),
        (np.ones((2, 3)), r"inertia M must have shape \(n, n\)"),
        (np.zeros((0, 0)), r"with n >= 1"),
        (-np.eye(3), "positive definite; its smallest eigenvalue is -1"),
        (np.diag([1.0, 1.0, 0.0]), "positive definite"),
        (np.eye(3) + np.triu(np.ones((3, 3)), 1), "symmetric"),
        (np.full((3, 3), np.nan), "inertia M has entries that are not finite"),
    ],
)
@pytest.mark.parametrize("function", [task_torque, intermediate_values])
def test_inertias(function, M, message):
    with pytest.raises(InputError, match=message):
        function(M, [GOOD])


def test_columns_that_do_not_fit_name_the_task_set():
    with pytest.raises(InputError, match=r"task set 1 \('hand'\): J must have 3 columns"):
        task_torque(np.eye(3), [GOOD, TaskSet(np.ones((1, 4)), F, name="hand")])


def test_unknown_choices_are_listed():
    with pytest.raises(
        UnknownNameError, match=r"unknown blending 'ivd'; did you mean 'idv'.*chain"
    ):
        task_torque(np.eye(3), [GOOD], "ivd")
    with pytest.raises(UnknownNameError, match=r"unknown coupling 'printed'.*as-printed"):
        task_torque(np.eye(3), [GOOD], coupling="printed")


def test_options_that_exclude_each_other():
    with pytest.raises(InputError, match="blending='idv'"):
        task_torque(np.eye(3), [GOOD], "chain", coupling="as-printed")
    with pytest.raises(InputError, match="without a sigma buffer"):
        task_torque(np.eye(3), [GOOD], coupling="as-printed", singular=SigmaBuffer(0.1, 0.2))


def test_the_adapter_says_what_it_needs():
    moving = [GOOD.replace(activation=0.5)]
    with pytest.raises(InputError, match="the inertia M is needed"):
        intermediate_values(lambda tasks: np.zeros(3), moving)
    with pytest.raises(InputError, match=r"finite torque of shape \(3,\), got shape \(2,\)"):
        intermediate_values(lambda tasks: np.zeros(2), moving, np.eye(3))
    with pytest.raises(InputError, match="not finite"):
        intermediate_values(lambda tasks: np.full(3, np.nan), moving, np.eye(3))
    with pytest.raises(InputError, match="takes the inertia once"):
        intermediate_values(np.eye(3), moving, np.eye(3))


def test_every_error_is_an_opspace_error():
    assert issubclass(InputError, OpspaceError)
    assert issubclass(InputError, ValueError)
    assert issubclass(UnknownNameError, OpspaceError)


def test_too_many_task_sets_moving_at_once_point_to_the_chain():
    many = [GOOD.replace(activation=0.5)] * 17
    with pytest.raises(InputError, match=r"2\^17 hard torques, use blending='chain'"):
        task_torque(np.eye(3), many)
    assert np.all(np.isfinite(task_torque(np.eye(3), many, "chain")))
