"""Which rows a task has: masks, tool axes, joints."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from opspace.errors import InputError, UnknownNameError
from opspace.tasks import (
    ComTask,
    JointTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    RelativeOrientationTask,
    RelativePoseTask,
    RelativePositionTask,
)
from tests.tasks.harness import random_state, terms_at

SUBSETS = ["".join(c) for size in (1, 2, 3) for c in combinations("xyz", size)]
PARTS = ("J", "drift", "acceleration", "error")


def evaluated(task, robot, q, v):
    task.bind(robot)
    return terms_at(task, robot, q, v)


@pytest.mark.parametrize("axes", SUBSETS)
@pytest.mark.parametrize("kind", [PositionTask, OrientationTask])
@pytest.mark.parametrize("axes_frame", ["world", "tool"])
def test_a_mask_selects_rows_of_the_whole_task(arm, rng, axes, kind, axes_frame):
    q, v = random_state(arm, rng)
    target = [0.1, 0.2, 0.3] if kind is PositionTask else [0.6, 0.0, 0.8, 0.0]
    whole = evaluated(kind(target=target, axes_frame=axes_frame), arm, q, v)
    # The order of the letters does not matter.
    masked = evaluated(kind(target=target, axes=axes[::-1], axes_frame=axes_frame), arm, q, v)
    rows = ["xyz".index(letter) for letter in axes]
    for part in PARTS:
        np.testing.assert_allclose(
            getattr(masked, part), getattr(whole, part)[rows], rtol=1e-12, atol=1e-12
        )


@pytest.mark.parametrize("axes", SUBSETS)
def test_masks_of_com_and_relative_tasks(tree, rng, axes):
    q, v = random_state(tree, rng)
    rows = ["xyz".index(letter) for letter in axes]
    frames = ("hand", "arm")
    for kind in (ComTask, RelativePositionTask, RelativeOrientationTask):
        args = () if kind is ComTask else frames
        whole = evaluated(kind(*args), tree, q, v)
        masked = evaluated(kind(*args, axes=axes), tree, q, v)
        for part in PARTS:
            np.testing.assert_array_equal(getattr(masked, part), getattr(whole, part)[rows])


@pytest.mark.parametrize("kind", [PositionTask, OrientationTask])
def test_tool_axes_ask_for_the_same_motion(robot, rng, kind):
    """f* − J̇v, what the law must realise, is the same vector in other axes."""
    q, v = random_state(robot, rng)
    target = [0.1, 0.2, 0.3] if kind is PositionTask else [0.6, 0.0, 0.8, 0.0]
    world = evaluated(kind(target=target), robot, q, v)
    tool = evaluated(kind(target=target, axes_frame="tool"), robot, q, v)
    R = robot.rotation(robot.frame_id(robot.tool))
    np.testing.assert_allclose(
        tool.acceleration - tool.drift, R.T @ (world.acceleration - world.drift), atol=1e-9
    )
    np.testing.assert_allclose(tool.error, R.T @ world.error, atol=1e-12)


def test_a_pose_is_a_position_above_an_orientation(robot, rng):
    q, v = random_state(robot, rng)
    position, orientation = [0.1, 0.2, 0.3], [0.6, 0.0, 0.8, 0.0]
    for frame in ("world", "tool"):
        parts = [
            evaluated(PositionTask(target=position, axes_frame=frame), robot, q, v),
            evaluated(OrientationTask(target=orientation, axes_frame=frame), robot, q, v),
        ]
        pose = PoseTask(target=(position, orientation), axes_frame=frame)
        whole = evaluated(pose, robot, q, v)
        for part in PARTS:
            stacked = np.concatenate([getattr(p, part) for p in parts])
            np.testing.assert_allclose(getattr(whole, part), stacked, rtol=1e-12, atol=1e-12)


def test_a_pose_relative_to_the_world_frame_is_the_pose(robot, rng):
    q, v = random_state(robot, rng)
    target = ([0.1, 0.2, 0.3], [0.6, 0.0, 0.8, 0.0])
    plain = evaluated(PoseTask(target=target), robot, q, v)
    relative = evaluated(RelativePoseTask(None, "world", target), robot, q, v)
    for part in PARTS:
        np.testing.assert_allclose(
            getattr(relative, part), getattr(plain, part), rtol=1e-12, atol=1e-9
        )


def test_a_frame_relative_to_itself_does_not_move(robot, rng):
    q, v = random_state(robot, rng)
    terms = evaluated(RelativePoseTask(None, robot.tool), robot, q, v)
    np.testing.assert_allclose(terms.J, 0.0, atol=1e-12)
    np.testing.assert_allclose(terms.drift, 0.0, atol=1e-12)


def test_an_offset_of_zero_is_the_frame_itself(robot, rng):
    q, v = random_state(robot, rng)
    plain = evaluated(PoseTask(target=np.eye(4)), robot, q, v)
    offset = evaluated(PoseTask(target=np.eye(4), offset=[0.0, 0.0, 0.0]), robot, q, v)
    for part in PARTS:
        np.testing.assert_array_equal(getattr(offset, part), getattr(plain, part))


def test_posture_leaves_a_floating_base_alone(tree, rng):
    task = PostureTask(target=tree.q_reference)
    q, v = random_state(tree, rng)
    terms = evaluated(task, tree, q, v)
    assert task.rows == int(tree.actuated.sum()) == tree.nv - 6
    np.testing.assert_array_equal(terms.J[:, ~tree.actuated], 0.0)
    np.testing.assert_array_equal(terms.J @ terms.J.T, np.eye(task.rows))
    expected = tree.difference(q, tree.q_reference)[tree.actuated]
    np.testing.assert_allclose(terms.error, expected, atol=1e-12)


def test_posture_of_some_joints_keeps_their_order(arm, rng):
    names = [arm.joint_names[i] for i in (4, 0, 2)]
    task = PostureTask([0.4, 0.0, 0.2], joints=names)
    q, v = random_state(arm, rng)
    terms = evaluated(task, arm, q, v)
    np.testing.assert_array_equal(terms.J, np.eye(arm.nv)[[4, 0, 2]])
    np.testing.assert_allclose(terms.error, [0.4, 0.0, 0.2] - q[[4, 0, 2]], atol=1e-12)
    task.target = np.arange(arm.nq) * 0.1
    np.testing.assert_allclose(
        terms_at(task, arm, q, v).error, [0.4, 0.0, 0.2] - q[[4, 0, 2]], atol=1e-12
    )


def test_posture_takes_joints_of_several_coordinates_whole_or_in_part(tree, rng):
    q, v = random_state(tree, rng)
    turned = tree.integrate(q, np.arange(tree.nv) * 0.02, 1.0)
    whole = evaluated(PostureTask(turned, joints=["wrist"]), tree, q, v)
    np.testing.assert_allclose(whole.error, tree.difference(q, turned)[-3:], atol=1e-12)
    short = evaluated(PostureTask(turned[-4:], joints=["wrist"]), tree, q, v)
    np.testing.assert_allclose(short.error, whole.error, atol=1e-12)
    part = evaluated(PostureTask(turned, joints=["wrist/1"]), tree, q, v)
    np.testing.assert_allclose(part.error, whole.error[1:2], atol=1e-12)


def test_posture_normalises_quaternions_and_refuses_bad_ones(tree, rng):
    q, _ = random_state(tree, rng)
    task = PostureTask(q, joints=["wrist"])
    scaled = q.copy()
    scaled[-4:] *= 1.0 + 5e-4
    task.bind(tree)
    task.target = scaled
    np.testing.assert_allclose(task.target, q[-4:], atol=1e-12)
    scaled[-4:] *= 1.1
    with pytest.raises(InputError, match=r"'posture': target.*quaternion"):
        task.target = scaled


def test_a_posture_given_before_the_robot_is_checked_when_bound(arm):
    for target in (np.zeros(arm.nq + 1), np.zeros(2)):
        with pytest.raises(InputError, match=r"'posture': target.*whole configuration"):
            PostureTask(target).bind(arm)
    task = PostureTask(arm.q_reference)
    task.target_velocity = [1.0, 2.0]
    with pytest.raises(InputError, match="'posture': target_velocity"):
        task.bind(arm)


def test_unknown_and_unusable_joints_are_named(arm, tree):
    with pytest.raises(UnknownNameError, match=f"'posture'.*'elbov'.*{arm.joint_names[0]}"):
        PostureTask(joints=["elbov"]).bind(arm)
    with pytest.raises(InputError, match=f"{arm.joint_names[0]}.*twice"):
        PostureTask(joints=[arm.joint_names[0]] * 2).bind(arm)
    with pytest.raises(InputError, match="joints"):
        PostureTask(joints=[])
    with pytest.raises(InputError, match="joints"):
        PostureTask(joints="shoulder")
    with pytest.raises(InputError, match=r"'wrist'.*one degree of freedom"):
        JointTask("wrist").bind(tree)


def test_a_joint_task_is_named_after_its_joint(arm):
    task = JointTask(arm.joint_names[2], 0.3)
    assert task.name == arm.joint_names[2]
    terms = evaluated(task, arm, arm.q_reference, np.zeros(arm.nv))
    np.testing.assert_allclose(terms.error, [0.3 - arm.q_reference[2]])
