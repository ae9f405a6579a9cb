"""Another robot's links as obstacles: where they are, how fast, and two arms that avoid each other."""

import numpy as np
import pytest

import opspace as osc
from tests.controller.collision_scenes import model_step

SHAPES = (
    osc.LinkCapsule("link3", (0.0, 0.2, 0.15), (0.0, -0.05, 0.15), 0.07),
    osc.LinkCapsule("link6", (0.0, 0.0, 0.0), (0.0, 0.0, 0.08), 0.04),
    osc.LinkCapsule("link6", (0.0, 0.0, 0.1), (0.0, 0.0, 0.1), 0.03),
)


def turned():
    turn = np.array([0.3, -0.2, 0.5, 0.6])
    return turn / np.linalg.norm(turn)


def test_links_are_where_the_robot_is_and_move_as_it_does():
    robot = osc.load_robot("puma560")
    other = osc.OtherRobot(robot, (0.5, -0.3, 0.2), turned(), shapes=SHAPES, name="right")
    assert [o.name for o in other.obstacles] == ["right:link3", "right:link6:1", "right:link6:2"]
    rng = np.random.default_rng(0)
    q, v, h = robot.q_reference + 0.3 * rng.normal(size=6), rng.normal(size=6), 1e-6

    def places(at):
        other.follow(at, v)
        return [(np.array(o.position), np.array(o.rotation)) for o in other.obstacles]

    before, after = places(q - h * v), places(q + h * v)
    now = places(q)
    base = osc.Box((1, 1, 1), rotation=turned()).rotation
    robot.update(q, v)
    for shape, obstacle, (x0, R0), (x1, R1), (x, R) in zip(
        SHAPES, other.obstacles, before, after, now, strict=True
    ):
        frame = robot.frame_id(shape.frame)
        ends = [
            np.array([0.5, -0.3, 0.2])
            + base @ (robot.position(frame) + robot.rotation(frame) @ np.array(end))
            for end in (shape.start, shape.end)
        ]
        half = 0.5 * np.linalg.norm(ends[1] - ends[0])
        assert x == pytest.approx(0.5 * (ends[0] + ends[1]), abs=1e-12)
        assert x + half * R[:, 2] == pytest.approx(ends[1], abs=1e-9)
        assert (x1 - x0) / (2 * h) == pytest.approx(obstacle.velocity[:3], abs=1e-5)
        spin = (R1 - R0) / (2 * h) @ R.T
        assert [spin[2, 1], spin[0, 2], spin[1, 0]] == pytest.approx(
            obstacle.velocity[3:], abs=1e-5
        )


def test_a_robot_that_plays_a_course_is_where_it_says():
    robot = osc.load_robot("puma560")
    played, told = (osc.OtherRobot(robot, (0.5, -0.3, 0.2), turned(), shapes=SHAPES) for _ in "ab")
    goal = robot.q_reference + 0.3
    course = osc.MinimumJerk(np.array(robot.q_reference), goal, duration=2.0)
    played.play(course)
    for t in (0.0, 0.7, 1.2):
        told.follow(course(t).x, course(t).v)
        for one, two in zip(played.obstacles, told.obstacles, strict=True):
            assert one.moving
            found = one.placing(t)
            for here, there in zip(found, two.placing(t), strict=True):
                assert here == pytest.approx(there, abs=1e-12)
    played.follow(goal, np.zeros(6))
    assert not played.obstacles[0].moving


def test_wrong_states_are_refused():
    other = osc.OtherRobot(osc.load_robot("puma560"), shapes=SHAPES)
    for q in (np.zeros(5), np.full(6, np.nan)):
        with pytest.raises(osc.InputError):
            other.follow(q, np.zeros(6))
    with pytest.raises(osc.InputError, match="no shapes"):
        osc.OtherRobot(osc.load_robot("puma560"), shapes=[])
    for share in (0.0, 1.0, np.nan):
        with pytest.raises(osc.InputError, match="share of 'other'"):
            osc.OtherRobot(osc.load_robot("puma560"), shapes=SHAPES, share=share)


APART = 0.9


def reached(seed, seconds=1.5, guarded=True):
    """Two arms that want to be where the other one is; the least distance between them."""
    rng = np.random.default_rng(seed)
    bases = np.array([[0.0, 0.0, 0.0], [0.0, APART, 0.0]])
    arms = []
    for _ in range(2):
        robot = osc.load_robot("puma560")
        arms.append((robot, robot.fresh()))
    others = [
        osc.OtherRobot(arms[1 - i][0], bases[1 - i] - bases[i], shapes=SHAPES, share=0.5)
        for i in (0, 1)
    ]
    controllers = []
    for (robot, model), other in zip(arms, others, strict=True):
        guard = osc.CollisionAvoidance(*other.obstacles, shapes=SHAPES, pairs="none")
        model.update(robot.q_reference, np.zeros(6))
        way = 1.0 if other is others[0] else -1.0
        goal = model.position(robot.tool) + [
            0.0,
            way * rng.uniform(0.4, 0.8),
            rng.uniform(-0.1, 0.1),
        ]
        position = osc.PositionTask(target=goal, kp=float(rng.uniform(50, 300)), max_speed=0.8)
        stack = osc.Stack([osc.JointLimits(), position, osc.PostureTask()])
        options = {"torque_limits": "priority", "collisions": guard if guarded else None}
        controllers.append(osc.Controller(robot, stack, **options))
    watch = osc.Controller(
        arms[0][0].fresh(),
        osc.Stack([osc.PostureTask()]),
        collisions=osc.CollisionAvoidance(*others[0].obstacles, shapes=SHAPES, pairs="none"),
    )
    states = [(np.array(robot.q_reference), np.zeros(6)) for robot, _ in arms]
    least, lost = np.inf, False
    for k in range(round(1e3 * seconds)):
        for i in (0, 1):
            others[i].follow(*states[1 - i])
        commands = [c.step(1e-3 * k, *s) for c, s in zip(controllers, states, strict=True)]
        seen = watch.step(1e-3 * k, *states[0]).distances.values()
        lost |= any(osc.Status.COLLISION_LOST in c.status for c in commands)
        if lost:
            break
        least = min(least, *(d.distance for d in seen))
        states = [
            model_step(model, c.tau, *s)
            for (_, model), c, s in zip(arms, commands, states, strict=True)
        ]
    return least, lost


def test_two_arms_that_want_to_be_in_the_same_place_stay_apart():
    least, lost = reached(0)
    assert not lost
    # Balls of one against capsules of the other are not the rows that the other keeps.
    assert least >= 0.01 - 1e-3
    assert least <= 0.05
    assert reached(0, guarded=False)[0] < 0.0
