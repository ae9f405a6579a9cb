"""A robot that stands and keeps distances: both forms of the tick, and what it keeps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.controller.reference import ReferenceController

HAND = "right_wrist_yaw_link"
SHAPES = (
    osc.LinkCapsule("torso_link", (0.0, 0.0, 0.08), (0.0, 0.0, 0.29), 0.115),
    osc.LinkCapsule("right_elbow_link", (0.0, 0.0, -0.01), (0.1, 0.0, -0.01), 0.045),
    osc.LinkCapsule(HAND, (0.0, 0.0, 0.0), (0.12, 0.0, 0.0), 0.045),
)
CUBE = 0.06 * (np.indices((2, 2, 2)).reshape(3, 8).T * 2.0 - 1.0)


def standing(kind, *obstacles):
    soles = [
        osc.SoleContact(
            f"{side}_ankle_roll_link", (0.085, 0.025), offset=(0.035, 0.0, -0.035), name=side
        )
        for side in ("left", "right")
    ]
    tasks = [osc.ComTask(), osc.PositionTask("right_rubber_hand"), osc.PostureTask(kp=25.0)]
    pairs = [("torso_link", "right_elbow_link"), ("torso_link", HAND)]
    guard = osc.CollisionAvoidance(*obstacles, shapes=SHAPES, pairs=pairs)
    robot = osc.load_robot("g1")
    stack = osc.Stack(tasks, osc.JointLimits(), soles)
    return kind(robot, stack, torque_limits="priority", collisions=guard), guard


@pytest.fixture(scope="module")
def both():
    return [
        standing(kind, osc.Ball(0.06, name="ball"), osc.ConvexMesh(CUBE, name="cube"))
        for kind in (ReferenceController, osc.Controller)
    ]


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_both_forms_keep_the_same_distances(both, seed):
    rng = np.random.default_rng(seed)
    (readable, guard), (compiled, same) = both
    robot = readable.robot
    q, v = np.array(robot.q_reference), 0.3 * rng.normal(size=robot.nv)
    q[7:] += 0.05 * rng.normal(size=q.size - 7)
    robot.update(q, v)
    hand = robot.position(robot.frame_id(HAND))
    for name in ("ball", "cube"):
        place, speed = hand + rng.uniform(-0.25, 0.25, 3), 0.3 * rng.normal(size=3)
        for one in (guard, same):
            one[name].place(place, velocity=speed)
    one, two = readable.step(0.0, q, v), compiled.step(0.0, q, v)
    # What softness shares between bounds that contradict each other is known to fewer digits.
    lost = osc.Status.COLLISION_LOST | osc.Status.LIMIT_LOST
    digits = 1e-3 if one.status & lost else 1e-7
    assert np.allclose(one.tau, two.tau, rtol=0.0, atol=digits * (1.0 + np.abs(one.tau).max()))
    assert one.status == two.status
    assert one.distances.keys() == two.distances.keys()
    for pair, there in one.distances.items():
        assert two.distances[pair].distance == pytest.approx(there.distance, abs=1e-12)
        if not one.status & lost:
            assert two.distances[pair].taken == pytest.approx(there.taken, rel=1e-3, abs=1e-3)


def test_what_is_far_away_changes_no_bit():
    (with_, _), (without, guard) = (
        standing(osc.Controller, *far) for far in ((), (osc.Ball(0.1),))
    )
    guard["ball"].place((5.0, 0.0, 0.0))
    q, v = np.array(with_.robot.q_reference), np.zeros(with_.robot.nv)
    one, two = with_.step(0.0, q, v), without.step(0.0, q, v)
    assert one.tau.tobytes() == two.tau.tobytes()
    assert one.status == two.status


def test_obstacles_come_and_go_while_it_stands():
    """More of them than there was memory for: the tick finds more."""
    controller, guard = standing(osc.Controller)
    q, v = np.array(controller.robot.q_reference), np.zeros(controller.robot.nv)
    before = controller.step(0.0, q, v)
    hand = controller.robot.position(controller.robot.frame_id(HAND)).copy()
    guard.add(*(osc.Ball(0.05, hand + [0.2 + 0.1 * k, 0.0, 0.0], name=str(k)) for k in range(9)))
    guard["0"].place(hand + [0.2, 0.0, 0.0], velocity=(-0.5, 0.0, 0.0))
    near = controller.step(1e-3, q, v)
    assert osc.Status.COLLISION in near.status
    assert near.distances[f"{HAND}/0"].taken > 0.0
    guard.remove(*(str(k) for k in range(9)))
    after = controller.step(2e-3, q, v)
    assert after.distances.keys() == before.distances.keys()
    assert after.tau == pytest.approx(before.tau, abs=1e-9)
