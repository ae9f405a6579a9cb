"""Distances that are kept: both forms of the tick, true distances, obstacles that come and move."""

import math
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.controller.exported import exported
from opspace.controller.reference import ReferenceController
from opspace.law.scalars import allowed_speed

KINDS = (ReferenceController, osc.Controller)
# One link of the arm, so that the readable form has few rows.
SHAPES = (
    osc.LinkCapsule("link3", (0.0, 0.2, 0.15), (0.0, -0.05, 0.15), 0.07),
    osc.LinkCapsule("link6", (0.0, 0.0, 0.0), (0.0, 0.0, 0.08), 0.04),
    osc.LinkCapsule("link1", (0.0, 0.0, 0.6), (0.0, 0.0, 0.7), 0.25),
)


def arm(kind, *obstacles, tasks=None, pairs=(("link1", "link6"),), **options):
    robot = osc.load_robot("puma560")
    guard = osc.CollisionAvoidance(*obstacles, shapes=SHAPES, pairs=pairs)
    tasks = tasks or [osc.PositionTask(), osc.PostureTask()]
    options = {"torque_limits": "priority", "collisions": guard, **options}
    return kind(robot, osc.Stack([osc.JointLimits(), *tasks]), **options), guard


def reference_tool():
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    return robot.position(robot.tool).copy()


def run(controller, seconds, each=lambda t, command: None):
    """Let the model itself move with the torque, and look at every tick."""
    robot = controller.robot
    q, v = np.array(robot.q_reference), np.zeros(robot.nv)
    for k in range(round(1e3 * seconds)):
        command = controller.step(1e-3 * k, q, v)
        each(1e-3 * k, command)
        robot.update(q, v)
        a = np.linalg.solve(robot.M, command.tau - robot.bias)
        q, v = q + 1e-3 * v + 0.5e-6 * a, v + 1e-3 * a
    return q, v


def cluttered(seed):
    rng = np.random.default_rng(seed)
    place = lambda: reference_tool() + rng.uniform(-0.3, 0.3, 3)  # noqa: E731
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    ball = osc.Ball(rng.uniform(0.02, 0.1), place(), velocity=rng.normal(size=3))
    link = osc.Capsule(0.03, 0.3, place(), turn, velocity=rng.normal(size=6))
    ball.share, link.share = 0.5, 0.3  # of another robot, which keeps away with the rest
    return (
        ball,
        link,
        osc.Box(rng.uniform(0.05, 0.3, 3), place(), turn, velocity=rng.normal(size=6)),
        osc.HalfSpace(place() - [0, 0, 0.3], rng.normal(size=3) + [0, 0, 2.0]),
    )


@pytest.fixture(scope="module")
def both():
    """Both forms with the same obstacles."""
    found = []
    for kind in KINDS:
        tasks = [osc.PositionTask(target=reference_tool()), osc.PostureTask(target=np.zeros(6))]
        found.append(arm(kind, *cluttered(0), tasks=tasks))
    return found


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_compiled_tick_keeps_the_same_distances(both, seed):
    rng = np.random.default_rng(seed)
    (readable, guard), (compiled, same) = both
    for one, two, place in zip(guard.obstacles, same.obstacles, cluttered(seed), strict=True):
        for obstacle in (one, two):
            obstacle.place(place.position, place.rotation, place.velocity)
    q = readable.robot.q_reference + 0.3 * rng.normal(size=6)
    v = rng.normal(size=6)
    one, two = readable.step(0.0, q, v), compiled.step(0.0, q, v)
    # What softness shares between bounds that contradict each other is known to fewer digits.
    lost = osc.Status.COLLISION_LOST | osc.Status.LIMIT_LOST
    digits = 1e-6 if one.status & lost else 1e-9
    assert np.allclose(one.tau, two.tau, rtol=0.0, atol=digits * (1.0 + np.abs(one.tau).max()))
    assert one.status == two.status
    assert set(one.distances) == set(two.distances)
    for pair, there in one.distances.items():
        assert two.distances[pair].distance == pytest.approx(there.distance, abs=1e-12)
        if not one.status & lost:
            assert two.distances[pair].taken == pytest.approx(there.taken, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_far_away_changes_no_bit(kind):
    far = osc.Ball(0.1, (5.0, 0.0, 0.0))
    with_, without = arm(kind, far)[0], arm(kind, collisions=None)[0]
    rng = np.random.default_rng(2)
    for k in range(20):
        q, v = with_.robot.q_reference + 0.05 * rng.normal(size=6), 0.05 * rng.normal(size=6)
        one, two = with_.step(1e-3 * k, q, v), without.step(1e-3 * k, q, v)
        assert one.tau.tobytes() == two.tau.tobytes()
        assert one.status == two.status


def test_a_target_below_a_table_is_approached_up_to_the_margin():
    tool = reference_tool()
    table = osc.HalfSpace(tool - [0.0, 0.0, 0.15], name="table", ignore=["link1"])
    below = osc.PositionTask(target=tool - [0.0, 0.0, 0.4], max_speed=0.5)
    controller, guard = arm(osc.Controller, table, tasks=[below, osc.PostureTask()])
    least, seen, steps, last = [], osc.Status.OK, [], []

    def look(t, command):
        nonlocal seen
        near = next(iter(command.distances.values()))
        least.append(near.distance)
        seen |= command.status
        if last:
            steps.append(np.max(np.abs(command.tau - last[-1])))
        last.append(command.tau)
        assert near.distance == min(d.distance for d in command.distances.values())

    run(controller, 1.5, look)
    assert min(least) >= guard.margin - 1e-5
    assert least[-1] == pytest.approx(guard.margin, abs=1e-3)
    assert max(steps[200:]) <= 0.5  # before, it speeds up
    assert osc.Status.COLLISION in seen
    assert osc.Status.COLLISION_LOST not in seen


def test_an_obstacle_that_tells_its_speed_never_comes_nearer_than_the_margin():
    tool = reference_tool()
    ball = osc.Ball(0.06, tool + [0.0, -0.5, 0.0], name="ball")
    controller, guard = arm(osc.Controller, ball)
    least = []

    def look(t, command):
        least.append(min(d.distance for d in command.distances.values()))
        ball.place(tool + [0.0, -0.5 + 0.3 * (t + 1e-3), 0.0], velocity=(0.0, 0.3, 0.0))
        assert osc.Status.COLLISION_LOST not in command.status

    run(controller, 2.0, look)
    assert min(least) >= guard.margin - 1e-4
    assert min(least) < guard.margin + 0.02


def test_an_obstacle_that_hides_its_speed_costs_what_the_formula_says():
    tool, u = reference_tool(), 0.3
    ball = osc.Ball(0.06, tool + [0.0, -0.5, 0.0], name="ball")
    controller, guard = arm(osc.Controller, ball)
    least = []

    def look(t, command):
        least.append(min(d.distance for d in command.distances.values()))
        ball.place(tool + [0.0, -0.5 + u * (t + 1e-3), 0.0])

    run(controller, 2.0, look)
    assert guard.margin - guard.clearance_lost(u) <= min(least) < guard.margin


def test_the_clearance_that_an_unknown_speed_costs_is_where_the_arm_retreats_as_fast():
    guard = osc.CollisionAvoidance()
    for u in (0.01, 0.1, 0.3, 0.49):
        allowed, slope = allowed_speed(-guard.clearance_lost(u), guard.brake, guard.k1)
        assert u * slope + guard.k2 * (allowed + u) == pytest.approx(0.0, abs=1e-9)
    assert guard.clearance_lost(0.5) == math.inf


def test_a_pair_of_links_is_kept_apart():
    fold = osc.PostureTask(target=np.radians([0.0, -35.0, -225.0, 63.0, -77.0, 0.0]), kp=20.0)
    controller, guard = arm(osc.Controller, tasks=[fold])
    least = []
    run(controller, 2.0, lambda _, c: least.append(c.distances["link1/link6"].distance))
    free, _ = arm(osc.Controller, tasks=[osc.PostureTask(target=fold.target, kp=20.0)], pairs=())
    watch, _ = arm(osc.Controller)
    q, v = run(free, 2.0)
    assert watch.step(0.0, q, v).distances["link1/link6"].distance < guard.margin
    assert min(least) >= guard.margin - 1e-4


@pytest.mark.parametrize("kind", KINDS)
def test_obstacles_come_move_and_go_at_the_next_tick(kind):
    tool = reference_tool()
    near = osc.Ball(0.05, tool + [0.0, 0.0, 0.12], velocity=(0.0, 0.0, -0.4))
    controller, guard = arm(kind, osc.Ball(0.05, tool + [0.0, 2.0, 0.0], name="far"))
    q, v = controller.robot.q_reference, np.zeros(6)
    free = controller.step(0.0, q, v)
    guard.add(near)
    there = controller.step(0.001, q, v)
    assert "link6/ball" in there.distances
    expected = arm(kind, near)[0].step(0.0, q, v)
    assert np.allclose(there.tau, expected.tau, rtol=0.0, atol=1e-9)
    assert not np.allclose(there.tau, free.tau)
    other = threading.Thread(target=near.place, args=(tool + [0.0, 0.0, 3.0],))
    other.start()
    other.join()
    assert controller.step(0.002, q, v).tau.tobytes() == free.tau.tobytes()
    near.place(tool + [0.0, 0.0, 0.12], velocity=(0.0, 0.0, -0.4))
    assert np.allclose(controller.step(0.003, q, v).tau, there.tau, rtol=0.0, atol=1e-9)
    guard.remove("ball")
    gone = controller.step(0.004, q, v)
    assert gone.tau.tobytes() == free.tau.tobytes()
    assert set(gone.distances) == set(free.distances)


def test_squeezed_from_both_sides_the_tick_says_that_it_is_lost():
    tool = reference_tool()
    sides = [
        osc.Box((0.3, 0.02, 0.3), tool + [0, y, 0], velocity=(0, -20 * y, 0), name=name)
        for name, y in (("left", 0.08), ("right", -0.08))
    ]
    controller, _ = arm(osc.Controller, *sides)
    command = controller.step(0.0, controller.robot.q_reference, np.zeros(6))
    assert osc.Status.COLLISION_LOST in command.status


def test_a_batch_keeps_the_same_distances():
    tasks = [osc.PositionTask(target=reference_tool()), osc.PostureTask(target=np.zeros(6))]
    controller, guard = arm(osc.Controller, *cluttered(3), tasks=tasks)
    rng = np.random.default_rng(4)
    Q, V = controller.robot.q_reference + 0.2 * rng.normal(size=(4, 6)), rng.normal(size=(4, 6))
    for name in ("one", "two"):
        found = controller.torque_batch(Q, V)
        for q, v, tau in zip(Q, V, found, strict=True):
            fresh = osc.Controller(
                osc.load_robot("puma560"),
                osc.Stack([osc.JointLimits(), *(type(t)(target=t.target) for t in tasks)]),
                torque_limits="priority",
                collisions=osc.CollisionAvoidance(
                    *guard.obstacles, shapes=SHAPES, pairs=guard.pairs
                ),
            )
            expected = fresh.step(0.0, q, v).tau
            assert np.allclose(tau, expected, rtol=0.0, atol=1e-6 * (1 + np.abs(tau).max()))
        guard.add(osc.Ball(0.05, reference_tool() + [0.0, 0.1, 0.1], name=name))


def test_distances_survive_a_copy_of_the_command():
    import pickle

    controller, _ = arm(osc.Controller, osc.Ball(0.05, (0.5, 0.5, 0.5)))
    command = controller.step(0.0, controller.robot.q_reference, np.zeros(6))
    assert pickle.loads(pickle.dumps(command)).distances == command.distances


def test_what_cannot_be_used_is_refused_by_name():
    with pytest.raises(osc.InputError, match="radius of 'cup'"):
        osc.Ball(0.0, name="cup")
    with pytest.raises(osc.InputError, match="size of 'box'"):
        osc.Box((1.0, 0.0, 1.0))
    with pytest.raises(osc.InputError, match="normal of 'floor'"):
        osc.HalfSpace(normal=(0.0, 0.0, 0.0))
    with pytest.raises(osc.InputError, match="velocity of 'ball'"):
        osc.Ball(0.1).place(velocity=(1.0, 2.0))
    with pytest.raises(osc.InputError, match="already"):
        osc.CollisionAvoidance(osc.Ball(0.1), osc.Ball(0.2))
    with pytest.raises(osc.UnknownNameError, match="valid: auto, none"):
        osc.CollisionAvoidance(pairs="all")
    with pytest.raises(osc.UnknownNameError, match="link9"):
        arm(osc.Controller, pairs=(("link1", "link9"),))
    with pytest.raises(osc.UnknownNameError, match="link that 'ball' ignores"):
        arm(osc.Controller, osc.Ball(0.1, ignore=["hand"]))
    with pytest.raises(osc.UnknownNameError, match="obstacle"):
        osc.CollisionAvoidance().remove("ball")
    with pytest.raises(osc.InputError, match="not Box"):
        arm(osc.Controller, collisions=osc.Box((1, 1, 1)))
    controller, guard = arm(osc.Controller)
    with pytest.raises(osc.InputError, match="cannot have collisions"):
        exported(controller, (), "quintic", (), 0)
    with pytest.raises(osc.InputError, match="puma560"):
        arm(osc.Controller, collisions=guard)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_carried_is_kept_away_until_it_is_released(kind):
    tool = reference_tool()
    table = osc.HalfSpace(tool - [0.0, 0.0, 0.3], name="table", ignore=["link1"])
    controller, guard = arm(kind, table, osc.Ball(0.05, (2.0, 0.0, 1.0)))
    robot = controller.robot
    controller.step(0.0, robot.q_reference, np.zeros(6))
    before = controller.step(0.001, robot.q_reference, np.zeros(6))
    robot.add_frame("cup", parent="link6", placement=(0.0, 0.0, 0.25))
    cup = osc.LinkCapsule("cup", (0.0, 0.0, 0.0), (0.0, 0.0, 0.1), 0.03)
    guard.carry(cup, ignore=["ball"])
    with_ = controller.step(0.002, robot.q_reference, np.zeros(6))
    assert set(with_.distances) - set(before.distances) == {"link1/cup", "link3/cup", "cup/table"}
    robot.update(robot.q_reference, np.zeros(6))
    R, x = robot.rotation(robot.frame_id("cup")), robot.position(robot.frame_id("cup"))
    low = min((x + R @ np.array(end))[2] for end in (cup.start, cup.end)) - cup.radius
    # Balls on the axis stand out by the sag at most.
    apart = with_.distances["cup/table"].distance
    assert low - (tool[2] - 0.3) - 3e-3 <= apart <= low - (tool[2] - 0.3) + 1e-9
    guard.release("cup")
    after = controller.step(0.003, robot.q_reference, np.zeros(6))
    assert set(after.distances) == set(before.distances)
    assert after.tau.tobytes() == before.tau.tobytes()
    guard.carry(cup)
    again = controller.step(0.004, robot.q_reference, np.zeros(6))
    assert "cup/ball" in again.distances


def test_what_cannot_be_carried_is_refused():
    controller, guard = arm(ReferenceController)
    cup = osc.LinkCapsule("cup", (0.0, 0.0, 0.0), (0.0, 0.0, 0.1), 0.03)
    for wrong, error, words in (
        ((), osc.InputError, "on one frame"),
        ((cup, SHAPES[0]), osc.InputError, "on one frame"),
        ((cup,), osc.UnknownNameError, "cup"),
        ((SHAPES[1],), osc.InputError, "has shapes already"),
    ):
        with pytest.raises(error, match=words):
            guard.carry(*wrong)
    controller.robot.add_frame("cup", parent="link6")
    with pytest.raises(osc.UnknownNameError, match="tabel"):
        guard.carry(cup, ignore=["tabel"])
    with pytest.raises(osc.UnknownNameError, match="cup"):
        guard.release("cup")
    with pytest.raises(osc.InputError, match="before a controller"):
        osc.CollisionAvoidance(shapes=SHAPES).carry(cup)
