"""Arms that write a letter each; some swap two tasks meanwhile, and some begin anew.

A number after the command is how many write; 4096 of them take two minutes on one core.
"""

import sys

import numpy as np

import opspace as osc

LETTERS = {
    "o": "12 32 43 45 36 16 05 03 12 12",
    "p": "00 03 05 16 36 45 43 32 12 03",
    "s": "03 12 32 43 34 14 05 16 36 45",
    "a": "45 36 16 05 03 12 32 43 46 42",
    "c": "45 36 16 05 03 12 32 43 43 43",
    "e": "04 44 45 36 16 05 03 12 32 43",
}
TICK, STROKE = 4e-3, 0.16

count = int(sys.argv[1]) if len(sys.argv) > 1 else 84
arms, robot = np.arange(count), osc.load_robot("puma560")
start = robot.position(robot.frame_id(robot.tool)).copy()
tasks = [osc.PositionTask(target=start), osc.OrientationTask(), osc.PostureTask()]
stack = osc.Stack([osc.JointLimits(), *tasks])
fleet = osc.Fleet(robot, stack, count, device="cpu", torque_limits="priority")
fleet.swap("position", "orientation", robots=[])  # room for it in the first kernel

corners = [[(0, int(x), int(y)) for x, y in text.split()] for text in LETTERS.values()]
ways = np.insert(start + 0.03 * (np.array(corners) - [0, 2, 3]), 0, start, axis=1)
ways = ways[[list(LETTERS).index("opspace"[i % 7]) for i in arms]]

swapping, beginning = arms % 3 == 1, arms % 6 == 5
q, v = np.tile(robot.q_reference, (count, 1)), np.zeros((count, robot.nv))
strokes = -2.5 * np.random.default_rng(0).random(count)
traces, errors = np.full((2, 500, count, 3), np.nan)
for k in range(500):
    if k == 250:
        fleet.swap("position", "orientation", duration=0.3, robots=swapping)
    if k == 300:
        q[beginning], v[beginning], strokes[beginning] = robot.q_reference, 0.0, 0.0
        traces[:, beginning] = errors[:, beginning] = np.nan
        fleet.reset(beginning)
    done = np.clip(strokes, 0.0, 9.9999)
    s, way = (done % 1.0)[:, None], np.diff(ways, axis=1)[arms, done.astype(int)]
    goal = ways[arms, done.astype(int)] + way * s**3 * (10 - 15 * s + 6 * s**2)
    fleet["position"].target.assign(goal)
    fleet["position"].velocity.assign(way * 30 * (s - s**2) ** 2 / STROKE)
    fleet["position"].acceleration.assign(way * 60 * (s - 3 * s**2 + 2 * s**3) / STROKE**2)
    for q_, v_, torque in zip(q, v, fleet.step(TICK * k, q, v).numpy(), strict=True):
        robot.update(q_, v_)  # a physics engine would do this
        v_[:] += TICK * np.linalg.solve(robot.M, torque - robot.bias)
        q_[:] += TICK * v_
    pen_down, error = strokes > 1.0, fleet["position"].error.numpy()
    traces[k, pen_down], errors[k, pen_down] = (goal - error)[pen_down], error[pen_down]
    strokes += TICK / STROKE
for name, group in {"ranks kept": ~swapping, "ranks swapped": swapping}.items():
    print(f"{name}: from the letter by {1e3 * np.nanmax(abs(errors[:, group])):.1f} mm at most")
