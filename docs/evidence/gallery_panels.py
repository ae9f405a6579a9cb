"""What the picture of each example shows: a function per example, named like it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import opspace as osc

TIME = "time [s]"


class Panel(NamedTuple):
    """One panel: lines (name, x, y) and dashed marks (text, height)."""

    title: str
    y: str
    lines: list
    x: str = TIME
    marks: tuple = ()
    equal: bool = False


def torques(run, count=3, title="torque"):
    """Show the torque of the first joints."""
    t, tau = run.tape.t, run.tape.tau
    return Panel(title, "torque [N·m]", [(f"joint {j + 1}", t, tau[:, j]) for j in range(count)])


def law_only(run):
    """Show torque and accelerations over the activation."""
    n, h = run.names, np.linspace(0.0, 1.0, 51)
    M, first, second = n["M"], n["first"], n["second"]

    def torque(x):
        tasks = [osc.TaskSet(first, [1.0], 0, activation=x), osc.TaskSet(second, [2.0], 1)]
        return osc.task_torque(M, tasks)

    tau = np.array([torque(x) for x in h])
    got = np.linalg.solve(M, tau.T)
    x = "activation of the first task"
    return [
        Panel("torque", "torque [N·m]", [(f"joint {j + 1}", h, tau[:, j]) for j in range(3)], x),
        Panel(
            "what the tasks get",
            "acceleration [rad/s²]",
            [("first", h, (first @ got)[0]), ("second", h, (second @ got)[0])],
            x,
            (("first wants 1", 1.0), ("second wants 2", 2.0)),
        ),
    ]


def hold_and_reach(run):
    """Show where the tool is, and the torque."""
    t, p = run.tape.tool(run.names["robot"])
    lines = [(axis, t, p[:, i] - p[0, i]) for i, axis in enumerate("xyz")]
    return [Panel("the tool moves", "way of the tool [m]", lines), torques(run)]


def insert_and_remove(run):
    """Show the activation of the task that comes and goes, and the torque."""
    lines = [("joint3", *run.tape.tasks("joint3", "activation"))]
    return [Panel("a task comes and goes", "activation", lines), torques(run)]


def swap(run):
    """Show the errors of two tasks that cannot both be fulfilled."""
    hand = [("position", *run.tape.tasks("position", "error_norm"))]
    posture = [("posture", *run.tape.tasks("posture", "error_norm"))]
    return [
        Panel("the tool's task", "error [m]", hand),
        Panel("the posture's task", "error [rad]", posture),
    ]


def out_of_reach(run):
    """Show how far the tool goes, and what fades."""
    t, p = run.tape.tool(run.names["robot"])
    target = np.array([run.names["position"].target(x).x for x in t])
    far = [("tool", t, np.linalg.norm(p[:, :2], axis=1))]
    far.append(("target", t, np.linalg.norm(target[:, :2], axis=1)))
    h = np.array([command.levels[1].activation for command in run.tape.commands[::5]])
    names = ("strongest", "middle", "weakest")
    return [
        Panel("tool and target", "distance from the axis [m]", far),
        Panel(
            "directions of the task", "activation", [(n, t, h[:, i]) for i, n in enumerate(names)]
        ),
    ]


def joint_limit(run):
    """Show a joint at its limit, and the torque."""
    q = np.array(run.tape.q)[:, 0] - run.names["start"]
    there, back = run.names["motions"]
    asked = [float((there if t < 1.5 else back)(t).x[0]) - run.names["start"] for t in run.tape.t]
    lines = [("joint 1", run.tape.t, q), ("asked for", run.tape.t, asked)]
    marks = (("limit", 0.5),)
    return [
        Panel("a joint at its limit", "joint 1 [rad]", lines, TIME, marks),
        torques(run, 1, "its torque"),
    ]


def own_task(run):
    """Show the way of the tool from above, and its distance from the axis."""
    t, p = run.tape.tool(run.names["robot"])
    angle = np.linspace(np.arctan2(p[0, 1], p[0, 0]), np.arctan2(p[-1, 1], p[-1, 0]), 60)
    circle = 0.6 * np.array([np.cos(angle), np.sin(angle)])
    return [
        Panel(
            "from above", "y [m]", [("tool", p[:, 0], p[:, 1]), ("cylinder", *circle)], "x [m]", (), True
        ),
        Panel(
            "distance from the axis", "radius [m]", [("tool", t, np.hypot(p[:, 0], p[:, 1]))],
            TIME, (("wanted", 0.6),),
        ),
    ]  # fmt: skip


def own_controller(run):
    """Show the own controller's answer, fed with intermediate values and with a gain."""
    n, h = run.names, np.linspace(0.0, 1.0, 51)
    solve, (J1, f1), (J2, f2) = n["own_controller"], (n["J1"], n["f1"]), (n["J2"], n["f2"])

    def fed(x):
        tasks = [osc.TaskSet(J1, f1, 0, activation=x), osc.TaskSet(J2, f2, 1)]
        values = osc.intermediate_values(solve, tasks, n["M"])
        return solve([k.replace(f=f, activation=1.0) for k, f in zip(tasks, values, strict=True)])

    def gain(x):
        tasks = [osc.TaskSet(J1, x * f1, 0), osc.TaskSet(J2, f2, 1)]
        return solve(tasks if x else tasks[1:])

    x = "activation of the first task"
    return [
        Panel(title, "torque [N·m]", [(f"joint {j + 1}", h, tau[:, j]) for j in range(3)], x)
        for title, tau in (
            ("fed intermediate values", np.array([fed(a) for a in h])),
            ("a gain instead: steps at 0", np.array([gain(a) for a in h])),
        )
    ]


def requests_from_a_thread(run):
    """Show what ten requests at any time make of an activation, and the torque."""
    t, h = run.tape.tasks("joint3", "activation", 1)
    until = t < t[np.flatnonzero(h)[-1]] + 0.05
    run.tape.commands[:] = run.tape.commands[: int(until.sum())]
    lines = [("joint3", t[until], h[until])]
    return [Panel("in and out, at any time", "activation", lines), torques(run)]


def showpiece(run):
    """Show the torque of the first seconds."""
    tau, t = np.array(run.names["tau"]), np.arange(len(run.names["tau"])) * 1e-3
    steps = np.abs(np.diff(tau, axis=0)).max(axis=1)
    return [
        Panel("torque", "torque [N·m]", [(f"joint {j + 1}", t, tau[:, j]) for j in range(3)]),
        Panel("its largest step in 1 ms", "step [N·m]", [("all joints", t[1:], steps)]),
    ]


def planar_arm(run):
    """Show the weakest direction, and the torque."""
    t, tau = run.names["times"], np.array(run.names["torques"])
    marks = (("absent", 0.05), ("present", 0.25))
    sigma = Panel(
        "mobility of the tip", "sigma [1/kg]", [("weakest", t, run.names["sigmas"])], TIME, marks
    )
    return [
        sigma,
        Panel("torque", "torque [N·m]", [(f"joint {j + 1}", t, tau[:, j]) for j in range(4)]),
    ]


def torque_limits(run):
    """Show the error of the first task, and what is asked of the motors, both ways."""
    found = run.names["watches"]
    t = np.arange(1000) * 1e-3
    names = {"report": "clipped", "priority": "by priority"}
    return [
        Panel(
            "the first task",
            "orientation error [rad]",
            [(text, t, found[way].turned[:1000]) for way, text in names.items()],
        ),
        Panel(
            "what is asked of the motors",
            "part of their torque",
            [(text, t, found[way].used[:1000]) for way, text in names.items()],
            TIME,
            (("what they give", 1.0),),
        ),
    ]


def environment(run):
    """Show how the rewards of both policies add up."""
    t = 20e-3 * np.arange(1, 51)
    lines = [(name, t, np.cumsum(found)) for name, found in run.names["rewards"].items()]
    return [Panel("32 arms reach for points", "reward so far, of an arm", lines)]


def writing(run, columns=21):
    """Show what the arms have written, one beside the other and in rows."""
    n = run.names
    traces, arms, swapping, beginning = n["traces"], n["arms"], n["swapping"], n["beginning"]
    across, down = 0.16 * (arms % columns), 0.25 * (arms // columns)
    gap = np.full((1, arms.size), np.nan)  # the pen goes up between two letters
    x = np.vstack([traces[:, :, 1] + across, gap]).T
    y = np.vstack([traces[:, :, 2] - down, gap]).T
    groups = {
        "ranks kept": ~swapping & ~beginning,
        "ranks swapped": swapping,
        "begun anew": beginning,
    }
    # A point alone is not drawn: here it is where the name of its line goes.
    side, heights = np.nanmax(x), np.linspace(np.nanmax(y), np.nanmin(y), 5)[1:4]
    lines = [
        (name, np.append(x[group], side), np.append(y[group], height))
        for (name, group), height in zip(groups.items(), heights, strict=True)
    ]
    side, height = "side, letters 0.16 m apart [m]", "height, rows 0.25 m apart [m]"
    return [Panel(f"{arms.size} arms write", height, lines, side, equal=True)]
