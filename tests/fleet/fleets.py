"""Fleets beside controllers: every robot of a fleet has a controller of its own that does the same."""

import numpy as np

import opspace as osc

COUNT = 6
LEVELS = {"position": (0, 1, 2), "orientation": (1, 0), "elbow": (2, 0)}


def tasks(robot):
    """Levels of a stack, and the task that comes later."""
    stack = [
        osc.JointLimits(),
        osc.PositionTask(target=[0.4, 0.1, 0.3]),
        osc.OrientationTask(target=np.eye(3), max_speed=2.0),
        osc.PostureTask(),
    ]
    return stack, osc.JointTask(robot.joint_names[2], 0.3, name="elbow")


class Beside:
    """A fleet and its controllers.

    Args:
        count: Number of robots.
        dtype: Of the fleet.
        alone: Whether there are no controllers, which take most of the time.
        options: Of both.
    """

    def __init__(self, count=COUNT, dtype="float64", alone=False, make=tasks, **options):
        options = {"torque_limits": "priority", "blending": "idv", **options}
        robot = osc.load_robot("puma560")
        self.n, self.count, self.robot = robot.nv, count, robot
        stack, self.later = make(robot)
        self.fleet = osc.Fleet(robot, osc.Stack(stack), count, device="cpu", dtype=dtype, **options)
        self.stacks, self.controllers, self.others = [], [], []
        for _ in range(0 if alone else count):
            own = osc.load_robot("puma560")
            levels, later = make(own)
            self.stacks.append(osc.Stack(levels))
            self.controllers.append(osc.Controller(own, self.stacks[-1], **options))
            self.others.append(later)
        self.first = [{task.name: task for task in stack} for stack in self.stacks]
        self.dtype = np.dtype(dtype)

    def prepare(self):
        """Lay out whatever programs ask for, so that all of them need one kernel."""
        fleet = self.fleet
        fleet.insert(self.later, 2, robots=[])
        fleet.move("elbow", 0, robots=[])
        for name in ("position", "orientation"):
            for level in LEVELS[name]:
                fleet.move(name, level, robots=[])
        fleet.swap("position", "orientation", robots=[])
        return self

    def states(self, rng, spread=1.0, speed=1.0):
        shape = (self.count, self.n)
        Q = self.robot.q_reference + rng.uniform(-spread, spread, shape)
        return Q.astype(self.dtype), rng.uniform(-speed, speed, shape).astype(self.dtype)

    def step(self, t, Q, V):
        """Step both, and return the torques of the fleet with the controllers' commands."""
        tau = self.fleet.step(t, Q, V).numpy()
        return tau, [c.step(t, q, v) for c, q, v in zip(self.controllers, Q, V, strict=True)]

    def assert_same(self, t, Q, V):
        tau, commands = self.step(t, Q, V)
        for i, command in enumerate(commands):
            scale = max(1.0, float(np.max(np.abs(command.tau))))
            # Where bounds contradict, their softness multiplies rounding by its inverse.
            part = 1e-7 if osc.Status.LIMIT_LOST in command.status else 1e-9
            np.testing.assert_allclose(tau[i], command.tau, rtol=0, atol=part * scale)
        assert self.fleet.status.numpy().tolist() == [int(c.status) for c in commands]
        for arrays in self.fleet:
            h, error = arrays.presence.numpy(), arrays.error.numpy()
            for i, command in enumerate(commands):
                task = command.tasks.get(arrays.name)
                assert abs(h[i] - (0.0 if task is None else task.activation)) < 1e-13
                if task is not None:
                    np.testing.assert_allclose(error[i], task.error, rtol=0, atol=1e-10)
        for k, name in enumerate(self.fleet.limit_names):
            want = [c.limits.get(name, 0.0) for c in commands]
            np.testing.assert_allclose(self.fleet.limits.numpy()[:, k], want, rtol=0, atol=1e-7)
        return commands
