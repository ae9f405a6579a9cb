"""Obstacles in recordings: where every tick found them, and replays that find them there again."""

import json

import numpy as np
import pytest

import opspace as osc
from opspace.controller.reference import ReferenceController
from opspace.loop.requests import Changes, RequestDesk, RunRequest
from opspace.record.obstacle_columns import about_collisions, recorded_obstacle
from opspace.tasks.obstacles import LED

SHAPES = (
    osc.LinkCapsule("link3", (0.0, 0.2, 0.15), (0.0, -0.05, 0.15), 0.07),
    osc.LinkCapsule("link6", (0.0, 0.0, 0.0), (0.0, 0.0, 0.08), 0.04),
)
KINDS = (ReferenceController, osc.Controller)


def arm(kind=osc.Controller):
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    tool = robot.position(robot.tool).copy()
    guard = osc.CollisionAvoidance(
        osc.Ball(0.05, tool + [0.0, -0.3, 0.0]),
        osc.HalfSpace(tool - [0.0, 0.0, 0.2], ignore=["link3"]),
        osc.Box((0.1, 0.2, 0.3), tool + [0.0, 0.3, 0.0]),
        shapes=SHAPES,
        pairs="none",
    )
    tasks = [osc.PositionTask(target=tool), osc.PostureTask(target=robot.q_reference)]
    stack = osc.Stack([osc.JointLimits(), *tasks])
    return kind(robot, stack, torque_limits="priority", collisions=guard)


def moved(controller, ticks, each, observers):
    """Let the model move with the torque, and somebody else with the obstacles."""
    robot, model = controller.robot, controller.robot.fresh()
    q, v = np.array(robot.q_reference), np.zeros(6)
    for k in range(ticks):
        each(k)
        command = controller.step(1e-3 * k, q, v)
        # The other thread may come between a tick and its record.
        each(k + 0.5)
        for observe in observers:
            observe(q, v, command)
        model.update(q, v)
        a = np.linalg.solve(model.M, command.tau - model.bias)
        q, v = q + 1e-3 * v + 0.5e-6 * a, v + 1e-3 * a


def pushing(guard, seed):
    """Somebody who pushes the ball, turns the box, takes the floor away and brings it back."""
    rng = np.random.default_rng(seed)
    floor = guard["floor"]
    start = guard["ball"].position

    def each(k):
        if k % 1 == 0.5 or rng.uniform() < 0.3:
            turn = rng.normal(size=4)
            way = [0.0, 0.004 * k, 0.0]
            guard["ball"].place(start + way, velocity=(0.0, 4.0, 0.0))
            guard["box"].place(rotation=turn / np.linalg.norm(turn), velocity=rng.normal(size=6))
        if k == 20:
            guard.remove("floor")
        if k == 40:
            guard.add(floor)

    return each


@pytest.mark.parametrize("kind", KINDS)
def test_a_replay_finds_obstacles_where_every_tick_found_them(tmp_path, kind):
    controller = arm(kind)
    guard = controller.collisions
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    seen = []
    observers = [recorder.observe, lambda q, v, c: seen.append(c.distances)]
    moved(controller, 60, pushing(guard, 1), observers)
    recorder.close()
    run = osc.load(tmp_path / "run")
    again = osc.replay(run, arm(kind))
    assert again.gap == 0.0
    assert again.repeated
    pair = "link6/ball"
    assert np.array_equal(run[f"distances/{pair}"], [d[pair].distance for d in seen])
    there = ~np.isnan(run["obstacles/floor/position/x"])
    assert there[19] and not there[25] and there[45]  # noqa: PT018 - one course
    assert np.ptp(run["obstacles/ball/position/y"]) > 0.1


def test_the_box_that_remembers_failures_remembers_obstacles(tmp_path):
    controller = arm()
    guard = controller.collisions
    box = osc.BlackBox(controller, tmp_path / "box", ticks=40, on=osc.Status.COLLISION)
    late = osc.Ball(0.03, (0.0, 0.0, 1.5), name="late")
    push = pushing(guard, 2)

    def each(k):
        push(k)
        if k == 30:
            guard.add(late)

    moved(box, 60, each, [])
    box.wait()
    assert box.written
    run = osc.load(box.written[0])
    fresh = arm()
    found = osc.replay(run, fresh)
    assert found.last_gap == 0.0
    assert found.repeated


def test_an_obstacle_that_comes_late_is_told(tmp_path):
    controller = arm(ReferenceController)
    late = osc.Ball(0.03, (0.0, 0.0, 1.5), name="late")
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    controller.collisions.add(late)
    with pytest.warns(UserWarning, match="'late' came after the recording began"):
        moved(controller, 2, lambda k: None, [recorder.observe])
    controller.robot.add_frame("cup", parent="link6")
    controller.collisions.carry(osc.LinkCapsule("cup", (0, 0, 0), (0, 0, 0.1), 0.03))
    with pytest.warns(UserWarning, match="what is carried on 'cup' came after"):
        moved(controller, 2, lambda k: None, [recorder.observe])
    recorder.close()


def test_a_header_describes_an_obstacle_as_it_is(tmp_path):
    controller = arm(ReferenceController)
    controller.collisions["ball"].share = 0.4
    osc.TickRecorder(tmp_path / "run", controller, {}).close()
    about = osc.load(tmp_path / "run").header["collisions"]
    for one in controller.collisions.obstacles:
        two = recorded_obstacle(one.name, about["obstacles"][one.name])
        assert np.array_equal(one.lower, two.lower)
        assert np.array_equal(one.upper, two.upper)
        assert (one.radius, one.ignore, one.share) == (two.radius, two.ignore, two.share)


def test_who_replays_without_a_guard_is_told(tmp_path):
    controller = arm(ReferenceController)
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    moved(controller, 2, lambda k: None, [recorder.observe])
    recorder.close()
    bare = ReferenceController(osc.load_robot("puma560"), osc.Stack([osc.PostureTask()]))
    with pytest.raises(osc.RecordingError, match="the controller has none"):
        osc.replay(tmp_path / "run", bare)


def test_an_obstacle_is_dragged_without_a_jump(tmp_path):
    controller = arm()
    ball = controller.collisions["ball"]
    desk = RequestDesk(Changes(controller), tmp_path / "asked.jsonl")
    start, places = ball.position, []

    def each(k):
        if k in (5, 100, 200):
            goal = tuple(start + [0.0, 0.05 * (-1) ** k, 0.001 * k])
            desk.ask(RunRequest("place", obstacle="ball", position=goal))
        if k % 1 == 0.0:
            places.append(np.array(ball.placing(1e-3 * k).position))

    moved(controller, 1500, each, [desk.observe])
    desk.close()
    # The limits hold along the way and along each of two axes across it.
    speed = np.diff(places, axis=0) * 1e3
    assert np.max(np.linalg.norm(speed, axis=1)) <= np.sqrt(3.0) * LED.speed
    assert np.max(np.linalg.norm(np.diff(speed, axis=0), axis=1)) <= 1e-3 * 2.0 * LED.acceleration
    assert np.allclose(places[-1], start + [0.0, 0.05, 0.2], atol=1e-12)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"kind": "place", "position": [0, 0, 0]}, "needs obstacle"),
        ({"kind": "place", "obstacle": "ball"}, "needs position"),
        ({"kind": "place", "obstacle": 3, "position": [0, 0, 0]}, "must be a name"),
        ({"kind": "place", "obstacle": "ball", "position": [0, 0, np.nan]}, "finite"),
        ({"kind": "gain", "tasks": ["a"], "kp": 1, "obstacle": "ball"}, "does not take obstacle"),
        ({"kind": "place", "tasks": ["a"], "obstacle": "b", "position": [0, 0, 0]}, "0 task"),
    ],
)
def test_wrong_places_are_refused(asked, words):
    with pytest.raises(osc.InputError, match=words):
        RunRequest.read(asked)


def test_a_mesh_is_described_so_that_it_can_be_made_again():
    points = np.random.default_rng(0).normal(size=(20, 3))
    guard = osc.CollisionAvoidance(osc.ConvexMesh(points, radius=0.02), shapes=SHAPES, pairs="none")
    about = json.loads(json.dumps(about_collisions(guard)))["obstacles"]["mesh"]
    again = recorded_obstacle("mesh", about)
    assert again.faces.tobytes() == guard["mesh"].faces.tobytes()
    assert again.radius == 0.02
