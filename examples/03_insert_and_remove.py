"""Insert a task above all others while the robot moves, and take it out again."""

import numpy as np

import opspace as osc

robot = osc.load_robot("puma560")
stack = osc.Stack([osc.PositionTask(), osc.PostureTask()])
controller = osc.Controller(robot, stack)
plant = osc.Plant(robot, robot.q_reference)
elbow = osc.JointTask("joint3", float(robot.q_reference[2]) + 0.3)

stack.insert(elbow, level=-1, duration=0.5, start_time=0.2)
stack.remove(elbow, duration=0.5, start_time=1.5)


class Watch:
    """Keeps the torque, and prints the activation now and then."""

    def __init__(self):
        self.tau = []

    def observe(self, q, v, command):
        """See one tick."""
        self.tau.append(command.tau)
        if len(self.tau) % 300 == 0 and elbow.name in command.tasks:
            print(f"t = {command.t:.1f} s: activation {command.tasks[elbow.name].activation:.2f}")


watch = Watch()
osc.simulate(plant, controller, 2.5, [watch])
print(f"largest step of the torque: {np.abs(np.diff(watch.tau, axis=0)).max():.3f} N·m per ms")
