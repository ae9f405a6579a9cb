"""Hold the orientation of a tool and bring it to a point."""

import numpy as np

import opspace as osc

robot = osc.load_robot("puma560")
position = osc.PositionTask(kp=100.0)
stack = osc.Stack([osc.OrientationTask(), position, osc.PostureTask()])
controller = osc.Controller(robot, stack)
plant = osc.Plant(robot, robot.q_reference)

here = robot.position(robot.frame_id(robot.tool)).copy()
position.target = osc.MinimumJerk(here, here + [0.0, 0.2, 0.1], 1.0)
osc.simulate(plant, controller, 2.0)

robot.update(plant.q, plant.v)
moved = robot.position(robot.frame_id(robot.tool)) - here
print(f"moved by {moved.round(4)} m, at rest within {np.abs(plant.v).max():.1e} rad/s")
