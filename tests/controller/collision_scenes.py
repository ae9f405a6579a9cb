"""Scenes in which a Panda would touch itself or something else."""

from typing import NamedTuple

import numpy as np

import opspace as osc

SECONDS = 2.5


class Scene(NamedTuple):
    """What a scene gives: the guard's obstacles, where the tool is to go, and what moves."""

    obstacles: tuple
    target: object
    move: object = None
    pairs: object = "none"


def tool_of(robot):
    robot.update(robot.q_reference, np.zeros(robot.nv))
    return robot.position(robot.tool).copy()


def table(x):
    floor = osc.HalfSpace((0.0, 0.0, 0.15), name="table", ignore=["panda_link1", "panda_link2"])
    return Scene((floor,), lambda t: x + [0.1, 0.2 * np.sin(2.0 * t), -0.45])


def self_fold(x):
    return Scene((), lambda t: np.array([0.02, 0.02, 0.35]), pairs="auto")


def moving_ball(x):
    ball = osc.Ball(0.08, name="ball")

    def move(t):
        ball.place((0.25, -0.6 + 0.3 * t, 0.65), velocity=(0.0, 0.3, 0.0))

    return Scene((ball,), lambda t: x, move)


def gap(x):
    sides = [
        osc.Box((0.4, 0.2, 0.5), (0.55, y, 0.35), name=name)
        for name, y in (("left", 0.235), ("right", -0.235))
    ]
    return Scene(tuple(sides), lambda t: np.array([0.5, 0.08 * np.sin(3.0 * t), 0.35]))


def clutter(x):
    rng = np.random.default_rng(3)
    angle, height = rng.uniform((-1.3, 0.1), (1.3, 0.9), (40, 2)).T
    around = np.column_stack([0.55 * np.cos(angle), 0.55 * np.sin(angle), height])
    away = [np.linalg.norm(around - place, axis=1) for place in (x, [0.3, 0.0, 0.6])]
    free = around[(away[0] > 0.22) & (away[1] > 0.25)]
    balls = tuple(osc.Ball(0.07, c, name=f"ball {i}") for i, c in enumerate(free[:9]))

    def way(t):
        turn = np.sin(2.5 * t)
        return np.array([0.5 * np.cos(turn), 0.5 * np.sin(turn), 0.5 + 0.2 * np.sin(4.0 * t)])

    return Scene(balls, way)


SCENES = {s.__name__: s for s in (table, self_fold, moving_ball, gap, clutter)}


def model_step(model, tau, q, v):
    """State a millisecond later, at a constant acceleration."""
    model.update(q, v)
    a = np.linalg.solve(model.M, tau - model.bias)
    return q + 1e-3 * v + 0.5e-6 * a, v + 1e-3 * a


class Seen(NamedTuple):
    """What became of a run: least distance, torque steps, mean error, what happened, the rows."""

    least: float
    steps: np.ndarray
    error: float
    status: osc.Status
    rows: int


def run(name, guarded=True, margin=0.01, seconds=SECONDS):
    robot = osc.load_robot("panda")
    x = tool_of(robot)
    scene = SCENES[name](x)
    guard = osc.CollisionAvoidance(*scene.obstacles, margin=margin, pairs=scene.pairs)
    position = osc.PositionTask(target=x)
    stack = osc.Stack([osc.JointLimits(), osc.OrientationTask(), position, osc.PostureTask()])
    options = {"torque_limits": "priority", "period": 1e-3}
    controller = osc.Controller(robot, stack, collisions=guard if guarded else None, **options)
    model = robot.fresh()
    watch = osc.Controller(
        model,
        osc.Stack([osc.PostureTask()]),
        collisions=osc.CollisionAvoidance(*scene.obstacles, pairs=scene.pairs),
    )
    q, v = np.array(robot.q_reference), np.zeros(7)
    least, status, steps, errors, before = np.inf, osc.Status.OK, [], [], None
    start = x.copy()
    for k in range(round(1e3 * seconds)):
        t = 1e-3 * k
        if scene.move is not None:
            scene.move(t)
        # The reference takes a second for the way, so that it does not step.
        share = min(t, 1.0)
        share = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        position.target = start + share * (scene.target(t) - start)
        command = controller.step(t, q, v)
        seen = command if guarded else watch.step(t, q, v)
        least = min(least, *(d.distance for d in seen.distances.values()))
        status |= command.status
        steps.append(0.0 if before is None else np.max(np.abs(command.tau - before)))
        before = command.tau
        errors.append(command.tasks["position"].error_norm)
        q, v = model_step(model, command.tau, q, v)
    return Seen(
        least,
        np.array(steps[1:]),
        np.mean(errors),
        status,
        len(guard.layout().rows) if guarded else 0,
    )
