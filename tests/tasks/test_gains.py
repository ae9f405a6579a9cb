"""The tracking law, Eq. 24, its gains and its velocity saturation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import InputError
from opspace.tasks import OrientationTask, PoseTask, PositionTask, PostureTask
from tests.tasks.harness import random_state, terms_at

gains = st.floats(0.0, 1e4)


@given(gains, gains)
def test_damping_follows_stiffness_until_it_is_given(kp, later):
    task = PositionTask(kp=kp)
    assert task.kv == 2.0 * math.sqrt(kp)
    task.kp = later
    assert task.kv == 2.0 * math.sqrt(later)
    task.kv = 3.0
    task.kp = kp
    assert task.kv == 3.0
    task.kv = None
    assert task.kv == 2.0 * math.sqrt(kp)


def test_gains_may_differ_from_row_to_row():
    task = PositionTask(kp=[1.0, 4.0, 9.0])
    np.testing.assert_array_equal(task.kv, [2.0, 4.0, 6.0])


def test_separate_gains_of_a_pose():
    np.testing.assert_array_equal(
        PoseTask(kp_linear=4.0, kp_angular=9.0).kp, [4.0, 4.0, 4.0, 9.0, 9.0, 9.0]
    )
    np.testing.assert_array_equal(PoseTask(kp=1.0, kp_angular=9.0).kp, [1.0] * 3 + [9.0] * 3)


@pytest.mark.parametrize("gain", ["kp", "kv"])
@pytest.mark.parametrize(
    "value", [-1.0, math.nan, math.inf, [1.0, 2.0], [1.0, 2.0, -3.0], "stiff", [[1.0, 1.0, 1.0]]]
)
def test_unusable_gains_name_the_task_and_the_gain(gain, value):
    with pytest.raises(InputError, match=f"'gripper'.*{gain}"):
        PositionTask(name="gripper", **{gain: value})
    task = PositionTask(name="gripper", kp=50.0)
    with pytest.raises(InputError, match=f"'gripper'.*{gain}"):
        setattr(task, gain, value)
    assert task.kp == 50.0


def test_gain_size_counts_selected_rows():
    assert PositionTask(axes="xz", kp=[1.0, 2.0]).rows == 2
    with pytest.raises(InputError, match="'position': kp"):
        PositionTask(axes="xz", kp=[1.0, 2.0, 3.0])


def test_posture_gains_are_checked_when_the_joints_are_known(arm):
    task = PostureTask(kp=np.arange(1.0, 1.0 + arm.nv))
    task.bind(arm)
    with pytest.raises(InputError, match="'posture': kp"):
        PostureTask(kp=[1.0, 2.0]).bind(arm)


@pytest.mark.parametrize("kp_kv", [(100.0, None), ([10.0, 20.0, 30.0], [1.0, 0.0, 5.0])])
def test_command_is_equation_24(arm, rng, kp_kv):
    task = PositionTask(kp=kp_kv[0], kv=kp_kv[1])
    task.bind(arm)
    x_d, v_d, a_d = rng.normal(size=(3, 3))
    task.set_target(x_d, v_d, a_d)
    q, v = random_state(arm, rng)
    terms = terms_at(task, arm, q, v)
    tool = arm.frame_id(arm.tool)
    expected = a_d + task.kv * (v_d - arm.velocity(tool)[:3]) + task.kp * (x_d - arm.position(tool))
    np.testing.assert_array_equal(terms.acceleration, expected)


def test_saturation_that_does_not_bind_changes_nothing(arm, rng):
    q, v = random_state(arm, rng)
    free, limited = PositionTask(target=[0.3, 0.2, 0.1]), PositionTask(target=[0.3, 0.2, 0.1])
    limited.max_speed = 1e3
    for task in (free, limited):
        task.bind(arm)
    np.testing.assert_array_equal(
        terms_at(free, arm, q, v).acceleration, terms_at(limited, arm, q, v).acceleration
    )


@given(st.floats(0.01, 1.0), st.floats(0.01, 10.0))
def test_error_asks_for_no_more_than_the_speed_limit(arm, speed, distance):
    task = PositionTask(kp=100.0, max_speed=speed)
    task.bind(arm)
    arm.update(arm.q_reference, np.zeros(arm.nv))
    direction = np.array([0.6, 0.0, -0.8])
    task.target = arm.position(arm.frame_id(arm.tool)) + distance * direction
    asked = terms_at(task, arm, arm.q_reference, np.zeros(arm.nv)).acceleration / task.kv
    expected = min(speed, task.kp / task.kv * distance)
    np.testing.assert_allclose(asked, expected * direction, rtol=1e-9, atol=1e-9)


def test_moving_at_the_speed_limit_needs_no_acceleration(arm, rng):
    q, v = random_state(arm, rng)
    arm.update(q, v)
    tool = arm.frame_id(arm.tool)
    velocity = arm.velocity(tool)[:3]
    task = PositionTask(max_speed=np.linalg.norm(velocity))
    task.bind(arm)
    task.target = arm.position(tool) + 3.0 * velocity
    np.testing.assert_allclose(terms_at(task, arm, q, v).acceleration, 0.0, atol=1e-9)


def test_pose_limits_linear_and_angular_speed_separately(arm, rng):
    q, still = random_state(arm, rng)[0], np.zeros(arm.nv)
    task = PoseTask(kp=[100.0] * 3 + [25.0] * 3, max_speed=(0.3, 0.7))
    task.bind(arm)
    task.target = ([9.0, 8.0, 7.0], [0.0, 1.0, 0.0, 0.0])
    asked = terms_at(task, arm, q, still).acceleration / task.kv
    np.testing.assert_allclose(np.linalg.norm(asked[:3]), 0.3, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(asked[3:]), 0.7, rtol=1e-12)
    task.max_speed = (0.3, math.inf)
    free = PoseTask(kp=task.kp)
    free.bind(arm)
    free.target = task.target
    np.testing.assert_array_equal(
        terms_at(task, arm, q, still).acceleration[3:],
        terms_at(free, arm, q, still).acceleration[3:],
    )


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, (1.0, 2.0), "fast"])
def test_unusable_speed_limits_name_the_task(speed):
    with pytest.raises(InputError, match=r"'wrist'.*max_speed"):
        OrientationTask(max_speed=speed, name="wrist")


def test_speed_limit_needs_damping():
    with pytest.raises(InputError, match=r"'position'.*max_speed needs kv"):
        PositionTask(kv=0.0, max_speed=1.0)
    task = PositionTask(kp=[100.0, 0.0, 0.0], kv=[20.0, 0.0, 0.0], max_speed=1.0)
    with pytest.raises(InputError, match=r"'position'.*max_speed needs kv"):
        task.kp = 100.0
