"""An environment for learning: arrays in, arrays out, and actions in operational space."""

import numpy as np

import opspace as osc

MIDDLE = np.array([0.4, 0.1, 0.3])


class Reach:
    """Arms that reach for points, each for its own, in steps of 20 ms.

    An action is five numbers from -1 to 1: where the hand goes (3), how stiff it is, and how much
    the task of its orientation is there. An observation is q, v and the goal.
    """

    def __init__(self, count: int) -> None:
        self.robot, self.rng = osc.load_robot("puma560"), np.random.default_rng(0)
        tasks = [osc.PositionTask(target=MIDDLE), osc.OrientationTask(), osc.PostureTask()]
        stack = osc.Stack([osc.JointLimits(), *tasks])
        self.fleet = osc.Fleet(self.robot, stack, count, device="cpu", torque_limits="priority")
        self.fleet.swap("position", "orientation", robots=[])  # one kernel with the next example
        self.q, self.v = np.zeros((2, count, self.robot.nv))
        self.goal, self.age, self.t = np.zeros((count, 3)), np.zeros(count), 0.0

    def reset(self, which: np.ndarray) -> np.ndarray:
        """Let these arms begin anew, each with another goal, and return what is seen of all."""
        self.q[which], self.v[which], self.age[which] = self.robot.q_reference, 0.0, 0
        self.goal[which] = MIDDLE + self.rng.uniform(-0.1, 0.1, (which.sum(), 3))
        self.fleet.reset(which)
        return np.hstack([self.q, self.v, self.goal])

    def step(self, action: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what is seen, the reward, and which arms were done, which have begun anew."""
        hand = self.fleet["position"]
        hand.target.assign(MIDDLE + 0.15 * action[:, :3])
        hand.set_gains(100.0 * 4.0 ** action[:, 3:4])
        self.fleet["orientation"].activation.assign(0.5 + 0.5 * action[:, 4])
        for _ in range(10):
            tau = self.fleet.step(self.t, self.q, self.v).numpy()
            for q, v, torque in zip(self.q, self.v, tau, strict=True):
                self.robot.update(q, v)  # a physics engine would do this
                v[:] += 2e-3 * np.linalg.solve(self.robot.M, torque - self.robot.bias)
                q[:] += 2e-3 * v
            self.t, self.age = self.t + 2e-3, self.age + 2e-3
        distance = np.linalg.norm(self.goal - hand.target.numpy() + hand.error.numpy(), axis=1)
        arrived, late = distance < 0.02, self.age > 0.99
        return self.reset(arrived | late), 10.0 * arrived - distance, arrived | late


rng, rewards, arms = np.random.default_rng(0), {"drawn": [], "straight": []}, Reach(32)
for policy, found in rewards.items():
    seen = arms.reset(np.full(32, True))
    for _ in range(50):
        drawn = rng.uniform(-1.0, 1.0, (32, 5))
        straight = np.hstack([(seen[:, -3:] - MIDDLE) / 0.15, np.ones((32, 2))])
        seen, reward, _ = arms.step(drawn if policy == "drawn" else straight)
        found.append(reward.mean())
    print(f"{policy}: mean reward {np.mean(found):.3f}")
