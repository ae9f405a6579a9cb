"""Time what forces and limits add to a tick of a G1 on two soles (35 coordinates).

``taskset -c 1 python docs/evidence/standing_ticks.py`` prints microseconds, of every state the quickest
of many rounds: what a busy machine does meanwhile is not in it. The law alone is the tick whose soles
can carry everything and whose motors and joints are not asked, where it gives nothing up.
"""

from time import perf_counter_ns

import numpy as np

import opspace as osc

STATES, ROUNDS = 60, 25
OFFSET, HALF = (0.035, 0.0, -0.035), (0.085, 0.025)
EVERYTHING = (2.0, 2.0)
"""Half the sides of soles that carry whatever is wanted, m."""


def controller(half=HALF, friction=0.5, most=None, limits=None, torque_limits="report"):
    """Centre of mass above torso and a hand above a posture."""
    robot = osc.load_robot("g1")
    soles = [
        osc.SoleContact(
            f"{side}_ankle_roll_link",
            half,
            offset=OFFSET,
            friction=friction,
            max_force=most,
            name=side,
        )
        for side in ("left", "right")
    ]
    tasks = [
        osc.ComTask(kp=50.0),
        [
            osc.OrientationTask("torso_link", name="torso"),
            osc.PositionTask("right_rubber_hand", name="hand"),
        ],
        osc.PostureTask(kp=25.0),
    ]
    stack = osc.Stack(tasks, limits, soles)
    return osc.Controller(robot, stack, torque_limits=torque_limits)


def states(robot, sway):
    """Give configurations and velocities on a closed path around the posture at the start."""
    rng = np.random.default_rng(0)
    turns, speeds = rng.normal(size=(2, robot.nv))
    turns[:6] = 0.0
    for phase in 2.0 * np.pi * np.arange(STATES) / STATES:
        q = robot.integrate(robot.q_reference, sway * np.sin(phase) * turns, 1.0)
        yield q, 3.0 * sway * np.cos(phase) * speeds


def quickest(subjects, at):
    """Take the quickest of the rounds at every state, in turns, µs, and how often each gave up."""
    taken = np.full((len(subjects), ROUNDS, len(at)), np.inf)
    gave_up = np.zeros(len(subjects))
    for turn in range(ROUNDS):
        for i, subject in enumerate(subjects):
            for k, (q, v) in enumerate(at):
                start = perf_counter_ns()
                command = subject.step(0.0, q, v)
                taken[i, turn, k] = 1e-3 * (perf_counter_ns() - start)
                gave_up[i] += osc.Status.FILTERED in command.status
    return np.min(taken, axis=1), gave_up / taken[0].size


def main():
    """Measure at states where nothing is given up, and where much is."""
    subjects = {
        "the law": controller(EVERYTHING, friction=20.0, most=1e9),
        "cones": controller(),
        "cones and motors": controller(torque_limits="priority"),
        "cones, motors and joints": controller(torque_limits="priority", limits=osc.JointLimits()),
    }
    robot, law = subjects["cones"].robot, None
    for what, sway in (("calm", 0.001), ("pushed", 0.1)):
        found, part = quickest(list(subjects.values()), list(states(robot, sway)))
        if law is None:
            assert part[0] == 0.0
            law = float(np.median(found[0]))
            print(f"the law: {law:.1f} µs")
        for name, ticks, gave_up in zip(list(subjects)[1:], found[1:], part[1:], strict=True):
            more = ticks - law
            print(
                f"{what}, {name}: {np.median(more):+.1f} µs in the median, {np.max(more):+.1f} at most,"
            )
            print(f"    where {100.0 * gave_up:.0f} % of the ticks give something up")


if __name__ == "__main__":
    main()
