"""What an update promises: the same answers again, nothing changed, bad states refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from opspace.errors import InputError, UnknownNameError
from opspace.robots import Robot, load_robot
from tests.robots.samples import BACKENDS, random_state

# Its motors are not alike in both directions, see tests/robots/test_motors.py.
pytestmark = pytest.mark.filterwarnings("ignore:medley. (the motor of|what actuators)")


@pytest.fixture(params=BACKENDS)
def robot(request: pytest.FixtureRequest, files: dict[str, Path]) -> Robot:
    return load_robot(files["medley"], backend=request.param)


def answers(robot: Robot) -> list[np.ndarray]:
    values = [robot.M, robot.bias, robot.gravity, robot.q, robot.v]
    values += [robot.com_position(), robot.com_jacobian(), robot.com_drift()]
    for frame in range(len(robot.frame_names)):
        values += [robot.position(frame), robot.rotation(frame), robot.jacobian(frame)]
        values += [robot.velocity(frame), robot.drift(frame)]
    return [np.array(value) for value in values]


def test_an_update_depends_on_its_state_alone(robot: Robot) -> None:
    rng = np.random.default_rng(20)
    q, v = random_state(robot, rng)
    robot.update(q, v)
    first = answers(robot)
    robot.update(*random_state(robot, rng))
    answers(robot)
    robot.update(q, v)
    # In another order, which must not matter either.
    robot.com_drift()
    _ = robot.gravity
    for a, b in zip(first, answers(robot), strict=True):
        np.testing.assert_array_equal(a, b)


def test_no_question_changes_the_model(robot: Robot) -> None:
    model = robot._model  # type: ignore[attr-defined]
    before = fingerprint(model)
    robot.update(*random_state(robot, np.random.default_rng(21)))
    answers(robot)
    robot.difference(robot.q_reference, robot.integrate(robot.q, robot.v, 1.0))
    assert fingerprint(model) == before


def fingerprint(model: object) -> object:
    import mujoco
    import pinocchio as pin

    if isinstance(model, pin.Model):
        return model.saveToString()
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def test_answers_are_read_only(robot: Robot) -> None:
    frame = robot.frame_id(robot.tool)
    given_out = [robot.q, robot.v, robot.M, robot.bias, robot.gravity, robot.q_reference]
    given_out += [robot.q_lower, robot.torque_limit, robot.jacobian(frame), robot.drift(frame)]
    given_out += [robot.com_position(), robot.rotation(frame), *robot.configurations.values()]
    for array in given_out:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


def test_arrays_suit_compiled_code(robot: Robot) -> None:
    frame = robot.frame_id(robot.tool)
    for array in (robot.M, robot.bias, robot.jacobian(frame), robot.com_jacobian()):
        assert array.flags.c_contiguous
        assert array.dtype == np.float64


def test_the_caller_keeps_its_arrays(robot: Robot) -> None:
    q, v = random_state(robot, np.random.default_rng(22))
    kept = q.copy(), v.copy()
    robot.update(q, v)
    M = robot.M.copy()
    q[:], v[:] = 0.0, 0.0
    np.testing.assert_allclose(robot.q, kept[0], atol=1e-15)
    np.testing.assert_array_equal(robot.v, kept[1])
    np.testing.assert_array_equal(robot.M, M)


def test_quaternions_are_normalised(robot: Robot) -> None:
    q, v = random_state(robot, np.random.default_rng(23))
    robot.update(q, v)
    expected = answers(robot)
    stretched = q.copy()
    stretched[3:7] *= 3.0
    stretched[9:13] *= 0.2
    robot.update(stretched, v)
    for a, b in zip(expected, answers(robot), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda q, v: (q[:-1], v), r"q of medley has shape \(13,\), not \(14,\)"),
        (lambda q, v: (q, np.append(v, 0.0)), "v of medley has shape"),
        (lambda q, v: (np.where(np.arange(14) == 7, np.nan, q), v), r"q\[7\].*'turn'.*nan"),
        (lambda q, v: (np.where(np.arange(14) == 13, np.inf, q), v), r"q\[13\].*'wrist'.*inf"),
        (lambda q, v: (q, np.where(np.arange(12) == 7, -np.inf, v)), "'push' is -inf"),
        (lambda q, v: (np.where(np.arange(14) < 7, 0.0, q), v), "length zero"),
    ],
)
def test_a_bad_state_is_refused_and_named(robot: Robot, change, message: str) -> None:
    robot.update(robot.q_reference, np.zeros(robot.nv))
    before = answers(robot)
    with pytest.raises(InputError, match=message):
        robot.update(*change(np.array(robot.q_reference), np.zeros(robot.nv)))
    for a, b in zip(before, answers(robot), strict=True):
        np.testing.assert_array_equal(a, b)


def test_integers_are_numbers() -> None:
    robot = load_robot("puma560")
    robot.update([0, 1, -2, 0, 1, 0], [0] * 6)  # type: ignore[arg-type]
    assert robot.q[2] == -2.0


def test_an_unknown_frame_lists_near_matches(robot: Robot) -> None:
    with pytest.raises(
        UnknownNameError, match="unknown frame of medley 'gripp'; did you mean 'grip'"
    ):
        robot.frame_id("gripp")
    assert robot.frame_names[robot.frame_id("grip")] == "grip"
    assert robot.tool == "grip"


VELOCITY = hnp.arrays(np.float64, 12, elements=st.floats(-1.5, 1.5))


@pytest.mark.parametrize("backend", BACKENDS)
def test_difference_undoes_integrate(backend: str, files: dict[str, Path]) -> None:
    robot = load_robot(files["medley"], backend=backend)

    @settings(max_examples=50, deadline=None)
    @given(v=VELOCITY, w=VELOCITY)
    def check(v: np.ndarray, w: np.ndarray) -> None:
        q0 = robot.integrate(robot.q_reference, w, 1.0)
        q1 = robot.integrate(q0, v, 1.0)
        np.testing.assert_allclose(robot.difference(q0, q1), v, atol=1e-8)
        np.testing.assert_allclose(robot.integrate(q0, 2.0 * v, 0.5), q1, atol=1e-12)

    check()


def test_mjcf_says_limits_and_postures(robot: Robot) -> None:
    names = [f"float/{i}" for i in range(6)] + [
        "turn",
        "push",
        "ball/0",
        "ball/1",
        "ball/2",
        "wrist",
    ]
    assert robot.joint_names == tuple(names)
    np.testing.assert_allclose(robot.q_lower[6:8], [-np.pi / 3, -0.1])
    np.testing.assert_allclose(robot.q_upper[6:8], [np.pi / 2, 0.3])
    assert np.isinf(robot.q_upper[[0, 5, 8, 11]]).all()
    # gear 5 times the smaller side of the control range; the joint's own range; no range.
    np.testing.assert_array_equal(robot.torque_limit[[6, 7, 11]], [15.0, 30.0, np.inf])
    assert list(robot.actuated) == [False] * 6 + [True] * 6
    np.testing.assert_array_equal(robot.q_reference, robot.configurations["home"])
    assert robot.floating_base
    assert robot.frame_names[0] == "world"


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("query", ["position", "rotation", "jacobian", "velocity", "drift"])
def test_frames_are_asked_by_id_or_name_and_others_are_refused(backend, query):
    robot = load_robot("puma560", backend=backend)
    robot.update(robot.q_reference, np.linspace(0.1, 0.6, 6))
    ask, last = getattr(robot, query), len(robot.frame_names) - 1
    np.testing.assert_array_equal(ask(robot.tool), ask(robot.frame_id(robot.tool)))
    np.testing.assert_array_equal(ask(np.int64(last)), ask(last))
    with pytest.raises(UnknownNameError, match=r"frame of puma560 'tol'.*tool"):
        ask("tol")
    for wrong in (-1, last + 1, 1.0, None):
        with pytest.raises(InputError, match=rf"puma560 has frames 0 to {last}, not {wrong}"):
            ask(wrong)
