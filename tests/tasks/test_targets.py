"""Targets: what they accept, when they take effect, and what is held without one."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from opspace.errors import InputError, UnknownNameError
from opspace.tasks import (
    ComTask,
    Constant,
    JointTask,
    MinimumJerk,
    OrientationMinimumJerk,
    OrientationTask,
    PoseReference,
    PoseTask,
    PositionTask,
    RelativePoseTask,
    Sample,
)
from opspace.tasks.rotation import exp_rotation, quaternion_from_matrix
from tests.tasks.harness import TASKS, bound, random_state, terms_at

BAD_VECTORS = [[1.0, 2.0], [1.0, 2.0, math.nan], [math.inf, 0.0, 0.0], "there", 1.0, np.eye(3)]


@pytest.mark.parametrize("value", BAD_VECTORS)
@pytest.mark.parametrize("attribute", ["target", "target_velocity", "target_acceleration"])
def test_unusable_vectors_are_refused_at_once_and_change_nothing(value, attribute):
    task = PositionTask(target=[1.0, 2.0, 3.0], name="gripper")
    with pytest.raises(InputError, match=f"'gripper'.*{attribute}"):
        setattr(task, attribute, value)
    np.testing.assert_array_equal(task.target, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(task.target_velocity, np.zeros(3))


@pytest.mark.parametrize("value", [[1.0, 1.0, 0.0, 0.0], 1.1 * np.eye(3), [0.0, 0.0, 1.0]])
def test_unusable_orientations_name_the_task(value):
    with pytest.raises(InputError, match=r"'wrist'.*target"):
        OrientationTask(target=value, name="wrist")


@pytest.mark.parametrize(
    "value",
    [
        np.zeros(6),
        [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0],
        2.0 * np.eye(4),
        ([0.0, 0.0], np.eye(3)),
        (np.zeros(3), np.zeros((3, 3))),
        "upright",
    ],
)
def test_unusable_poses_name_the_task(value):
    with pytest.raises(InputError, match="'pose': target"):
        PoseTask(target=value)


def test_all_forms_of_a_pose_mean_the_same(rng):
    position, R = rng.normal(size=3), exp_rotation(rng.normal(size=3))
    quaternion = quaternion_from_matrix(R)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, position
    forms = [matrix, np.concatenate((position, quaternion)), (position, R), [position, quaternion]]
    for form in forms:
        np.testing.assert_allclose(PoseTask(target=form).target, matrix, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", list(TASKS))
def test_without_a_target_the_first_value_is_held_until_reset(name, arm, rng):
    task = bound(name, arm)
    q, v = random_state(arm, rng)
    away = arm.integrate(q, v, 0.1)
    np.testing.assert_allclose(terms_at(task, arm, q, v).error, 0.0, atol=1e-15)
    assert np.abs(terms_at(task, arm, away, v).error).max() > 1e-3
    task.bind(arm)
    assert np.abs(terms_at(task, arm, away, v).error).max() > 1e-3
    task.reset()
    np.testing.assert_allclose(terms_at(task, arm, away, v).error, 0.0, atol=1e-15)


def test_assigning_none_holds_the_value_found_next(arm, rng):
    task = PositionTask(target=[9.0, 9.0, 9.0])
    task.bind(arm)
    q, v = random_state(arm, rng)
    assert np.abs(terms_at(task, arm, q, v).error).max() > 1.0
    task.target = None
    assert task.target is None
    np.testing.assert_array_equal(terms_at(task, arm, q, v).error, np.zeros(3))
    task.target_velocity = [0.1, 0.0, 0.0]
    away = arm.integrate(q, v, 0.1)
    held = terms_at(task, arm, away, v).error
    assert np.abs(held).max() > 1e-3


def test_each_none_holds_anew(arm, rng):
    task = PositionTask()
    task.bind(arm)
    q, v = random_state(arm, rng)
    terms_at(task, arm, q, v)
    away = arm.integrate(q, v, 0.1)
    assert np.abs(terms_at(task, arm, away, v).error).max() > 1e-3
    task.target = None
    np.testing.assert_array_equal(terms_at(task, arm, away, v).error, np.zeros(3))


def test_a_held_value_does_not_follow_a_robot_that_reuses_its_arrays(arm, rng):
    class Reusing:
        buffer = np.zeros(3)

        def __getattr__(self, name):
            return getattr(arm, name)

        def position(self, frame):
            self.buffer[:] = arm.position(frame)
            return self.buffer

    robot, task = Reusing(), PositionTask()
    task.bind(robot)
    q, v = random_state(arm, rng)
    terms_at(task, robot, q, v)
    assert np.abs(terms_at(task, robot, arm.integrate(q, v, 0.1), v).error).max() > 1e-3


def test_a_target_takes_effect_at_the_next_evaluation(arm, rng):
    task = PositionTask()
    task.bind(arm)
    q, v = random_state(arm, rng)
    terms_at(task, arm, q, v)
    position = arm.position(arm.frame_id(arm.tool)).copy()
    for goal in rng.normal(size=(3, 3)):
        task.target = goal
        np.testing.assert_array_equal(task.evaluate(arm, 0.0).error, goal - position)


def test_a_target_is_copied(arm):
    goal = np.array([1.0, 2.0, 3.0])
    task = PositionTask(target=goal)
    goal[:] = 0.0
    np.testing.assert_array_equal(task.target, [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="read-only"):
        task.target[0] = 5.0


def test_a_reference_gives_value_velocity_and_acceleration(arm, rng):
    q, v = random_state(arm, rng)
    reference = MinimumJerk([0.1, 0.2, 0.3], [0.5, 0.4, 0.1], 2.0, start_time=0.0)
    followed, fixed = PositionTask(target=reference), PositionTask()
    for t in (-1.0, 0.0, 0.7, 1.9, 5.0):
        fixed.set_target(*reference(t))
        for task in (followed, fixed):
            task.bind(arm)
        one, two = terms_at(followed, arm, q, v, t), terms_at(fixed, arm, q, v, t)
        np.testing.assert_array_equal(one.acceleration, two.acceleration)
        np.testing.assert_array_equal(one.error, two.error)


def test_pose_reference_drives_position_and_orientation_rows(arm, rng):
    q, v = random_state(arm, rng)
    position = MinimumJerk([0.1, 0.2, 0.3], [0.5, 0.4, 0.1], 2.0, start_time=0.0)
    R = exp_rotation(np.array([0.1, 1.0, -0.5]))
    orientation = OrientationMinimumJerk(np.eye(3), R, 1.0, start_time=0.0)
    parts = [PositionTask(target=position), OrientationTask(target=orientation)]
    whole = PoseTask(target=PoseReference(position, orientation))
    for task in (*parts, whole):
        task.bind(arm)
    expected = [terms_at(task, arm, q, v, 0.6).acceleration for task in parts]
    found = terms_at(whole, arm, q, v, 0.6).acceleration
    np.testing.assert_allclose(found, np.concatenate(expected), rtol=1e-12, atol=1e-12)


def test_a_reference_brings_its_own_feed_forward():
    task = PositionTask(target=[0.0, 0.0, 0.0])
    task.target_velocity = [1.0, 0.0, 0.0]
    task.target = Constant([0.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"target_velocity.*reference"):
        task.target_velocity = [1.0, 0.0, 0.0]
    task.target = [0.0, 0.0, 0.0]
    np.testing.assert_array_equal(task.target_velocity, np.zeros(3))


@pytest.mark.parametrize(
    ("sample", "reason"),
    [
        (Sample(np.array([0.0, 0.0, np.nan]), np.zeros(3), np.zeros(3)), "x must be finite"),
        (Sample(np.zeros(3), np.array([np.inf, 0.0, 0.0]), np.zeros(3)), "v must be finite"),
        (Sample(np.zeros(3), np.zeros(3), np.zeros(2)), "a must have shape"),
        (np.zeros(3), "must give a Sample"),
    ],
)
def test_a_reference_that_fails_is_refused_by_name_and_time(arm, sample, reason):
    task = PositionTask(target=lambda _: sample, name="gripper")
    task.bind(arm)
    with pytest.raises(InputError, match=f"'gripper'.*t = 1.5 s.*{reason}"):
        task.evaluate(arm, 1.5)


def test_unbound_tasks_and_unknown_names_are_refused(arm, tree):
    task = PositionTask("gripper", name="reach")
    with pytest.raises(InputError, match="'reach' is not bound"):
        task.evaluate(arm, 0.0)
    with pytest.raises(UnknownNameError, match=f"'reach'.*frame.*'gripper'.*{arm.tool}"):
        task.bind(arm)
    with pytest.raises(UnknownNameError, match=r"'relative_pose'.*'elbow joint'"):
        RelativePoseTask(None, "elbow joint").bind(arm)
    other = ComTask()
    other.bind(arm)
    with pytest.raises(InputError, match="not bound to this robot"):
        other.evaluate(tree, 0.0)


@pytest.mark.parametrize("axes", ["", "xx", "w", "xyzx", ["x", "x"]])
def test_unusable_axes_name_the_task(axes):
    with pytest.raises(InputError, match=r"'reach'.*axes"):
        PositionTask(axes=axes, name="reach")


def test_unusable_options_name_the_task():
    with pytest.raises(InputError, match=r"'reach'.*axes_frame"):
        PositionTask(axes_frame="base", name="reach")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match=r"'reach'.*offset"):
        PositionTask(offset=[0.0, 1.0], name="reach")
    with pytest.raises(InputError, match="name"):
        PositionTask(name="")
    with pytest.raises(TypeError, match="stiffness"):
        PositionTask(stiffness=3.0)  # pyright: ignore[reportCallIssue]


def test_a_tick_never_sees_half_of_a_target(arm):
    """A second thread sets x_d = v_d = a_d = s while the first evaluates."""
    task = PositionTask(kp=0.0, kv=1.0)
    task.set_target(np.zeros(3))
    task.bind(arm)
    arm.update(arm.q_reference, np.zeros(arm.nv))
    position = arm.position(arm.frame_id(arm.tool))
    stop = threading.Event()

    def stream():
        s = 0.0
        while not stop.is_set():
            s += 1.0
            task.set_target(np.full(3, s), np.full(3, s), np.full(3, s))

    thread = threading.Thread(target=stream)
    thread.start()
    try:
        seen = set()
        for _ in range(2000):
            terms = task.evaluate(arm, 0.0)
            x_d = terms.error + position
            seen.add(x_d[0])
            np.testing.assert_allclose(terms.acceleration, 2.0 * x_d, rtol=1e-9, atol=1e-9)
    finally:
        stop.set()
        thread.join()
    assert len(seen) > 1


def test_a_joint_reference_may_be_a_number(arm):
    task = JointTask(arm.joint_names[1], MinimumJerk(0.0, 1.0, 2.0, start_time=0.0))
    task.bind(arm)
    still = np.zeros(arm.nv)
    expected = 0.5 - arm.q_reference[1]
    np.testing.assert_allclose(terms_at(task, arm, arm.q_reference, still, 1.0).error, [expected])
