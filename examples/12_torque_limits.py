"""Motors that are too weak: a drive that clips spoils the first task, levels that give way do not."""

import numpy as np

import opspace as osc


class Watch:
    """Keeps the error of the orientation, and what is asked of the motors."""

    def __init__(self, robot):
        self.limit = robot.torque_limit
        self.turned, self.used, self.scales = [], [], []

    def observe(self, q, v, command):
        """See one tick."""
        self.turned.append(command.tasks["orientation"].error_norm)
        self.used.append(np.max(np.abs(command.tau) / self.limit))
        self.scales.append([level.scale for level in command.levels])


def swing(torque_limits):
    """Ask for a fast motion of the tool that must not turn."""
    robot = osc.load_robot("puma560")
    here = robot.position(robot.frame_id(robot.tool)).copy()
    target = osc.MinimumJerk(here, here + [-0.3, 0.5, 0.3], 0.35)
    stack = osc.Stack([osc.OrientationTask(), osc.PositionTask(target=target), osc.PostureTask()])
    controller = osc.Controller(robot, stack, torque_limits=torque_limits)
    plant = osc.Plant(robot, robot.q_reference)  # its motors clip at their limits
    watch = Watch(robot)
    osc.simulate(plant, controller, 2.0, [watch])
    return watch


watches = {way: swing(way) for way in ("report", "priority")}
for way, watch in watches.items():
    print(
        f"{way}: asked for {max(watch.used):.1f} times the motors' torque, "
        f"the tool turned by {max(watch.turned):.4f} rad, "
        f"least part of each level {np.min(watch.scales, axis=0).round(2)}"
    )
