"""Torques of a fleet go on without a step: what moves them ten times as finely moves them a tenth."""

import numpy as np
import pytest

import opspace as osc
from tests.fleet.fleets import Beside

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")

COUNT, DURATION = 12, 0.05


def requests(fleet, duration, masks):
    """What happens when: requests that meet each other on the way, each of some robots."""
    return {
        0.01: lambda: fleet.swap("position", "orientation", duration, robots=masks[0]),
        0.03: lambda: fleet.insert("elbow", 2, duration, profile="cubic", robots=masks[1]),
        0.04: lambda: fleet.move("position", 2, duration, robots=masks[2]),
        0.06: lambda: fleet.remove("orientation", duration, robots=masks[3]),
        0.08: lambda: fleet.insert("orientation", 1, duration, robots=masks[3]),
        0.09: lambda: fleet.move("elbow", 0, duration, profile="half-sine", robots=masks[1]),
    }


def largest_steps(dt, duration, seed):
    """Largest step of each robot's torque from tick to tick, and its largest torque, N·m."""
    fleet = Beside(COUNT, alone=True).prepare().fleet
    rng = np.random.default_rng(seed)
    q = fleet.robot.q_reference + rng.uniform(-0.4, 0.4, (COUNT, fleet.robot.nv))
    v = rng.uniform(-0.3, 0.3, q.shape)
    program = requests(fleet, duration, rng.random((4, COUNT)) < 0.6)
    before, step, size = None, np.zeros(COUNT), np.zeros(COUNT)
    for k in range(round(0.16 / dt)):
        t = k * dt
        for at in [at for at in program if t >= at - 1e-9]:
            program.pop(at)()
        tau = fleet.step(t, q + t * v, v).numpy().copy()
        if before is not None:
            step = np.maximum(step, np.abs(tau - before).max(axis=1))
        before, size = tau, np.maximum(size, np.abs(tau).max(axis=1))
    assert not program
    return step, size


def test_torques_do_not_step_while_tasks_come_go_and_move():
    coarse, size = largest_steps(1e-3, DURATION, seed=1)
    fine, _ = largest_steps(1e-4, DURATION, seed=1)
    assert (fine <= 0.13 * coarse).all()
    assert (coarse > 1e-3 * size).any()


def test_without_a_duration_they_step_however_short_the_ticks_are():
    coarse, size = largest_steps(1e-3, 0.0, seed=1)
    fine, _ = largest_steps(1e-4, 0.0, seed=1)
    some = coarse > 0.05 * size
    assert some.sum() > COUNT // 2
    assert (fine[some] > 0.5 * coarse[some]).all()


class Path:
    """States along a way, each of them a robot that has come from nowhere."""

    def __init__(self, points):
        self.fleet = Beside(points, alone=True).prepare().fleet
        self.points, self.seen = points, 0

    def steps(self, way, start, end):
        """Torque steps between neighbours, relative to the largest torque."""
        s = np.linspace(start, end, self.points)
        Q, V = map(np.array, zip(*[way(x) for x in s], strict=True))
        self.fleet.reset()
        tau = self.fleet.step(0.0, Q, V).numpy().copy()
        self.seen |= int(np.bitwise_or.reduce(self.fleet.status.numpy()))
        return np.abs(np.diff(tau, axis=0)).max(axis=1) / np.abs(tau).max()

    def refined(self, way):
        """Largest step on the way, then on the piece where that is, and so on."""
        start, end, found = 0.0, 1.0, []
        for _ in range(5):
            steps = self.steps(way, start, end)
            worst, width = int(np.argmax(steps)), (end - start) / (self.points - 1)
            start, end = start + worst * width, start + (worst + 1) * width
            found.append(steps.max())
        return found


def test_torques_do_not_step_on_the_way_into_limits_and_through_singular_postures():
    path, robot = Path(41), osc.load_robot("puma560")
    rng = np.random.default_rng(2)
    for k in range(12):
        q, v = robot.q_reference + rng.uniform(-0.3, 0.3, robot.nv), rng.uniform(-1, 1, robot.nv)
        goal = q + rng.uniform(-0.3, 0.3, robot.nv)
        if k % 3 == 0:  # past an end, where the joint does not turn back
            j = rng.integers(robot.nv)
            goal[j], v[j] = robot.q_upper[j] + 0.02, 0.5
            q[j] = robot.q_upper[j] - 0.3
        elif k % 3 == 1:  # through a wrist that is straight
            q[4], goal[4] = 0.2, -0.2
        else:  # through an arm that is stretched
            q[2], goal[2] = np.pi / 2 + 0.25, np.pi / 2 - 0.25
        steps = path.refined(lambda s, q=q, v=v, goal=goal: (q + s * (goal - q), v))
        # Before an end of a joint torques may be as steep as bounds are hard, but do not jump.
        assert steps[-1] <= 0.01 * steps[0] + 1e-9, k
    wanted = osc.Status.DIRECTION_OFF | osc.Status.JOINT_LIMIT
    assert wanted in osc.Status(path.seen)
