"""Ask for changes from another thread while the loop runs."""

import threading
import time

import opspace as osc

robot = osc.load_robot("puma560")
stack = osc.Stack([osc.PositionTask(), osc.PostureTask()])
controller = osc.Controller(robot, stack)
controller.warm_up()
elbow = osc.JointTask("joint3", float(robot.q_reference[2]) + 0.2)
stack.prepare(elbow)  # what takes long, before the loop
plant = osc.Plant(robot, robot.q_reference)
asked = []


def operator():
    """Insert and remove, over and over, at no particular time."""
    for k in range(10):
        if k % 2 == 0:
            stack.insert(elbow, level=-1, duration=0.05)
        else:
            stack.remove(elbow, duration=0.05)
        asked.append(k)
        time.sleep(0.01)


thread = threading.Thread(target=operator)
thread.start()
while thread.is_alive():
    osc.simulate(plant, controller, 0.05)
thread.join()
osc.simulate(plant, controller, 0.2)
print(f"{len(asked)} requests, stack settled: {stack.settled}, tasks: {[t.name for t in stack]}")
