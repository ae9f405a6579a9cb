"""Lead the tool out of the workspace and back: the singular direction fades."""

import numpy as np

import opspace as osc

robot = osc.load_robot("puma560")
here = robot.position(robot.frame_id(robot.tool)).copy()
out = here * [2.0, 2.0, 1.0]
there = osc.MinimumJerk(here, out, 2.0)
back = osc.MinimumJerk(out, here, 2.0, start_time=2.5)
position = osc.PositionTask(target=lambda t: there(t) if t < 2.5 else back(t))
stack = osc.Stack([osc.OrientationTask(), position, osc.PostureTask(kp=25.0)])
controller = osc.Controller(robot, stack)
plant = osc.Plant(robot, robot.q_reference)


class Watch:
    """Prints what the weakest direction does."""

    def observe(self, q, v, command):
        """See one tick."""
        if round(command.t * 1000) % 1000 == 0:
            level = command.levels[1]
            print(
                f"t = {command.t:.0f} s: weakest sigma {level.sigma[-1]:.2f}, "
                f"activation {level.activation[-1]:.2f}, "
                f"error {command.tasks['position'].error_norm:.3f} m"
            )


osc.simulate(plant, controller, 5.5, [Watch()])
print(f"joints at rest within {np.abs(plant.v).max():.1e} rad/s")
