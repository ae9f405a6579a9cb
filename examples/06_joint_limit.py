"""Ask a joint to go past its limit: it stops there, and comes back by itself."""

import opspace as osc

robot = osc.load_robot("puma560")
joint = robot.joint_names[0]
start = float(robot.q_reference[0])
limits = osc.JointLimits(joints={joint: (start - 1.0, start + 0.5)})
swing = osc.JointTask(joint, start)
controller = osc.Controller(robot, osc.Stack([limits, swing, osc.PostureTask()]))
plant = osc.Plant(robot, robot.q_reference)

motions = [
    osc.MinimumJerk([start], [start + 0.9], 1.0),
    osc.MinimumJerk([start + 0.9], [start], 1.0, start_time=1.5),
]
for motion in motions:
    swing.target = motion
    osc.simulate(plant, controller, 1.5)
    command = controller.step(plant.t, plant.q, plant.v)
    print(
        f"asked for {motion(plant.t).x[0] - start:+.2f} rad, is at {plant.q[0] - start:+.4f} rad, "
        f"limits at work: {dict(command.limits)}"
    )
