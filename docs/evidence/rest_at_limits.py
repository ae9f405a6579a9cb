"""What tasks pay at rest where a joint is at its limit, with and without levels that leave room.

``python docs/evidence/rest_at_limits.py`` sends a Panda to 24 random targets within 0.6 m and 1 rad of
its reference posture, with the defaults and orientation above position above posture, and prints the
errors of those that end at a limit without a released direction, and the largest torque steps. Both are
the readable form, with the projection alone and as it is; some ten minutes.
"""

import buffer_targets
import numpy as np

import opspace as osc
from opspace.controller import ReferenceController, bounds
from opspace.controller.bounds import wants_more

TIME = 4.0


def run(robot, target):
    """Return the errors at the end, m and rad, the largest torque step, N·m per ms, and the status."""
    position, orientation = target
    tasks = [
        osc.JointLimits(),
        osc.OrientationTask(target=orientation, max_speed=1.0),
        osc.PositionTask(target=position, max_speed=0.5),
        osc.PostureTask(robot.q_reference),
    ]
    controller = ReferenceController(robot, osc.Stack(tasks))
    plant = osc.Plant(robot, robot.q_reference)
    command, step = controller.step(plant.t, plant.q, plant.v), 0.0
    while plant.t < TIME:
        plant.advance(command.tau)
        before, command = command, controller.step(plant.t, plant.q, plant.v)
        step = max(step, float(np.abs(command.tau - before.tau).max()))
    errors = [command.tasks[name].error_norm for name in ("position", "orientation")]
    return errors, step, command.status


def main():
    """Print both."""
    buffer_targets.TARGETS, buffer_targets.DISTANCE = 24, 0.6
    robot = osc.load_robot("panda")
    targets = buffer_targets.targets(robot)
    for name, asks in (("projection alone", lambda *_: False), ("as it is", wants_more)):
        bounds.wants_more = asks
        found = [run(robot, target) for target in targets]
        steps = [step for _, step, _ in found]
        print(
            f"{name}: largest steps {np.median(steps):.2f} in the median, {max(steps):.2f} at most"
        )
        for i, (errors, _, status) in enumerate(found):
            if osc.Status.JOINT_LIMIT in status and osc.Status.DIRECTION_OFF not in status:
                print(f"  target {i}: {1e3 * errors[0]:.2f} mm, {1e3 * errors[1]:.2f} mrad")


if __name__ == "__main__":
    main()
