"""A Panda in scenes where it would touch itself or something else, and from random starts."""

import numpy as np
import pytest

import opspace as osc
from tests.controller.collision_scenes import SCENES, model_step, run

pytestmark = pytest.mark.slow
# N·m per ms: the largest, and 99 of 100. A link's balls take over from each other with a kink.
STEPS = {
    "table": (0.5, 0.3),
    "self_fold": (0.5, 0.3),
    "moving_ball": (0.8, 0.3),
    "gap": (0.9, 0.5),
    "clutter": (3.0, 0.8),
}


@pytest.mark.parametrize("name", SCENES)
def test_nothing_comes_nearer_than_the_margin(name):
    free, kept = run(name, guarded=False), run(name)
    assert free.least < 0.0
    assert kept.least >= 0.01 - 1e-5
    assert osc.Status.COLLISION in kept.status
    assert osc.Status.COLLISION_LOST not in kept.status
    largest, most = STEPS[name]
    assert np.max(kept.steps) <= largest
    assert np.quantile(kept.steps, 0.99) <= most


STARTS = 100


def random_obstacles(rng):
    for i in range(rng.integers(2, 7)):
        place = rng.uniform((-0.8, -0.8, 0.1), (0.8, 0.8, 1.0))
        turn = rng.normal(size=4)
        turn /= np.linalg.norm(turn)
        kind = rng.integers(3)
        if kind == 0:
            yield osc.Ball(rng.uniform(0.03, 0.12), place, name=str(i))
        elif kind == 1:
            yield osc.Box(rng.uniform(0.05, 0.3, 3), place, turn, name=str(i))
        else:
            size = rng.uniform((0.02, 0.1), (0.08, 0.4))
            yield osc.Capsule(*size, place, turn, name=str(i))


def one_start(seed, shapes, pairs):
    """Least distance before anything is said to be lost, and whether it is."""
    rng = np.random.default_rng(seed)
    robot = osc.load_robot("panda")
    guard = osc.CollisionAvoidance(*random_obstacles(rng), shapes=shapes, pairs=pairs)
    kp = float(rng.uniform(50.0, 400.0))
    position = osc.PositionTask(target=rng.uniform((-0.7, -0.7, 0.0), (0.7, 0.7, 0.9)), kp=kp)
    stack = osc.Stack([osc.JointLimits(), osc.OrientationTask(), position, osc.PostureTask()])
    controller = osc.Controller(robot, stack, torque_limits="priority", collisions=guard)
    model, v = robot.fresh(), np.zeros(7)
    probe = osc.Controller(model, osc.Stack([osc.PostureTask()]), collisions=osc.CollisionAvoidance(
        *guard.obstacles, shapes=shapes, pairs=pairs))  # fmt: skip
    for k in range(200):
        q = rng.uniform(robot.q_lower + 0.05, robot.q_upper - 0.05)
        found = probe.step(1e-3 * k, q, v)
        if min(d.distance for d in found.distances.values()) > guard.margin:
            break
    else:
        return None
    stack.swap(position, stack["orientation"], duration=0.5, start_time=0.2)
    least = np.inf
    for k in range(800):
        command = controller.step(1e-3 * k, q, v)
        if osc.Status.COLLISION_LOST in command.status:
            return least, True
        least = min(least, *(d.distance for d in command.distances.values()))
        q, v = model_step(model, command.tau, q, v)
    return least, False


def test_from_random_starts_nothing_comes_nearer_unless_it_is_said():
    first = osc.CollisionAvoidance()
    first.bind(osc.load_robot("panda"))
    runs = [one_start(seed, first.shapes, first.pairs) for seed in range(STARTS)]
    runs = [found for found in runs if found is not None]
    assert len(runs) >= 0.8 * STARTS
    assert min(least for least, _ in runs) >= first.margin - 1e-4
    assert sum(lost for _, lost in runs) <= 0.05 * len(runs)
