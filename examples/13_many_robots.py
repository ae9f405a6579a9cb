"""An environment of many arms, whose actions are where the hand goes and how stiff it is.

A policy would write the actions; here they are drawn. Arms that are slow to arrive begin anew.
"""

import numpy as np

import opspace as osc


class Reach:
    """Arms that reach for points, in steps of 20 ms."""

    def __init__(self, count: int) -> None:
        self.robot = osc.load_robot("puma560")
        stack = osc.Stack(
            [
                osc.JointLimits(),
                osc.PositionTask(target=[0.4, 0.1, 0.3], name="hand"),
                osc.OrientationTask(name="turn"),
                osc.PostureTask(),
            ]
        )
        self.fleet = osc.Fleet(self.robot, stack, count, device="cpu", torque_limits="priority")
        self.fleet.swap("hand", "turn", robots=[])  # the stack of the page on fleets: one kernel
        self.q = np.tile(self.robot.q_reference, (count, 1))
        self.v, self.t = np.zeros(self.q.shape), 0.0

    def step(self, targets: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Do what the actions say, and return how far each hand is from its target, m."""
        self.fleet["hand"].target.assign(targets)
        self.fleet["hand"].set_gains(stiffness[:, None])
        for _ in range(10):
            tau = self.fleet.step(self.t, self.q, self.v).numpy()
            for q, v, torque in zip(self.q, self.v, tau, strict=True):
                self.robot.update(q, v)  # a physics engine would do this
                v[:] += 2e-3 * np.linalg.solve(self.robot.M, torque - self.robot.bias)
                q[:] += 2e-3 * v
            self.t += 2e-3
        return np.linalg.norm(self.fleet["hand"].error.numpy(), axis=1)

    def reset(self, robots: np.ndarray) -> None:
        """Let these arms begin anew."""
        self.q[robots], self.v[robots] = self.robot.q_reference, 0.0
        self.fleet.reset(robots)


rng = np.random.default_rng(0)
arms = Reach(8)
goals = np.array([0.4, 0.1, 0.3]) + rng.uniform(-0.1, 0.1, (8, 3))
distances = []
for k in range(20):
    distances.append(arms.step(goals, np.linspace(50.0, 400.0, 8)))
    if k == 12:
        arms.reset(distances[-1] > np.median(distances[-1]))
print("distance of the hands [mm]:", np.round(1e3 * distances[-1], 1))
