"""A task of one's own: keep the tool on a cylinder around the robot's axis."""

import numpy as np

import opspace as osc


class OnCylinder(osc.Task):
    """Distance of the tool from the vertical axis, x = √(px² + py²)."""

    def __init__(self, radius: float) -> None:
        super().__init__("cylinder", rows=1, units=("m",), kp=100.0)
        self.radius = radius

    def bind(self, robot):
        """Look up the tool."""
        self.tool = robot.frame_id(robot.tool)

    def evaluate(self, robot, t):
        """J = pᵀJ_xy / x, and its drift from the derivative of p / x."""
        p = robot.position(self.tool)[:2]
        x = float(np.hypot(*p))
        normal = p / x
        J, velocity = robot.jacobian(self.tool)[:2], robot.velocity(self.tool)[:2]
        rate = normal @ velocity
        drift = normal @ robot.drift(self.tool)[:2] + (velocity @ velocity - rate**2) / x
        error = self.radius - x
        wanted = self.kp * error - self.kv * rate
        return osc.TaskTerms(
            J=(normal @ J)[None], drift=np.array([drift]), acceleration=np.array([wanted]),
            error=np.array([error]),
        )  # fmt: skip


robot = osc.load_robot("puma560")
turn = osc.JointTask(robot.joint_names[0], float(robot.q_reference[0]) + 0.8, max_speed=1.0)
stack = osc.Stack([OnCylinder(0.6), turn, osc.PostureTask()])
controller = osc.Controller(robot, stack)
plant = osc.Plant(robot, robot.q_reference)
osc.simulate(plant, controller, 2.0)
robot.update(plant.q, plant.v)
print(f"radius {np.hypot(*robot.position(robot.frame_id(robot.tool))[:2]):.5f} m after turning")
