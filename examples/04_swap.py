"""Exchange the ranks of two tasks that cannot both be fulfilled, and turn round half-way."""

import opspace as osc

robot = osc.load_robot("puma560")
tool = robot.position(robot.frame_id(robot.tool)).copy()
position = osc.PositionTask(target=tool + [0.1, 0.0, 0.0])
posture = osc.PostureTask(robot.q_reference)
stack = osc.Stack([position, posture])
controller = osc.Controller(robot, stack)
plant = osc.Plant(robot, robot.q_reference)

osc.simulate(plant, controller, 1.0)
for text, until in (("swap", 0.25), ("turn round", 0.25), ("swap for good", 1.0)):
    stack.swap(position, posture, duration=0.5)
    osc.simulate(plant, controller, until)
    command = controller.step(plant.t, plant.q, plant.v)
    errors = {name: round(task.error_norm, 3) for name, task in command.tasks.items()}
    levels = [(number, round(weight, 2)) for number, weight in command.tasks["position"].levels]
    print(f"{text}: position is at {levels}, errors {errors}")
