"""Recordings that look like the two experiments, made without a simulator."""

import numpy as np

from opspace.law.activation import Buffer
from opspace.record import Column, Recorder, load

JOINTS = tuple(f"joint{i}" for i in range(1, 7))
HOME = np.array([0.0, 1.0, -2.9, 0.0, -1.2, 0.0])
FADING = Buffer(0.01, 0.02)
RANGE = 0.75

SCENARIOS = {
    "singularity": {
        "robot": "puma560",
        "singularity": {"lower": 0.01, "upper": 0.02, "scale": "absolute", "profile": "quintic"},
        "joint_limits": None,
    },
    "joint-limit": {
        "robot": "puma560",
        "singularity": None,
        "joint_limits": {"mode": "buffer", "buffer": 0.1, "joints": {"joint1": [-RANGE, RANGE]}},
    },
}


def smooth(s):
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def out_and_back(t):
    """0, then 1 from 3 s to 4 s, then 0 again from 6 s on."""
    return smooth((t - 1.0) / 2.0) - smooth((t - 4.0) / 2.0)


def columns():
    return (
        Column("t", "s", "time"),
        *(Column(f"q/{j}", "rad") for j in JOINTS),
        *(Column(f"v/{j}", "rad/s") for j in JOINTS),
        *(Column(f"tau/{j}", "N·m") for j in JOINTS),
        *(Column(f"tool/{a}", "m") for a in "xyz"),
        Column("tasks/orientation/activation", "1"),
        *(Column(f"tasks/orientation/error/{i}", "rad") for i in range(3)),
        Column("tasks/position/activation", "1"),
        *(Column(f"tasks/position/error/{i}", "m") for i in range(3)),
        *(Column(f"levels/{i}/sigma/{k}", "1") for i in range(2) for k in range(3)),
        *(Column(f"levels/{i}/activation/{k}", "1") for i in range(2) for k in range(3)),
        Column("limits/joint1/lower", "1"),
        Column("limits/joint1/upper", "1"),
        Column("hard_solves", "1"),
        Column("status", "1"),
    )


def write(directory, values, *, header=None, ended="completed", reason=""):
    """Record columns given by name; the others are zero."""
    known = columns()
    ticks = len(next(iter(values.values())))
    rows = np.zeros((ticks, len(known)))
    names = [column.name for column in known]
    for name, column in values.items():
        rows[:, names.index(name)] = column
    recorder = Recorder(directory, known, header or {})
    for row in rows:
        recorder.append(row)
    recorder.close(ended, reason)
    return load(directory)


def experiment(directory, name, dt=0.02):
    """The three variants of ``singularity`` or ``joint-limit``."""
    return {
        variant: write_run(directory / variant, name, variant, dt)
        for variant in ("without", "switch", "transition")
    }


def write_run(directory, name, variant, dt):
    t = np.arange(0.0, 8.0, dt)
    explodes = variant == "without" and name == "singularity"
    if explodes:
        t = t[t < 2.2]
    phase = out_and_back(t)
    q = joint_positions(name, variant, t, phase)
    v = np.gradient(q, t, axis=0)
    tau = torques(variant, name, t, q, v, dt)
    tool, error = tool_motion(name, variant, phase)
    sigma = np.full((len(t), 6), np.nan)
    sigma[:, :3] = [2.0, 1.5, 0.9] + 0.1 * phase[:, None]
    sigma[:, 3:] = np.column_stack([0.30 - 0.05 * phase, 0.22 - 0.06 * phase, 0.12 - 0.11 * phase])
    weak = np.array([FADING(float(s)).value for s in sigma[:, 5]])
    if variant == "switch":
        weak = np.round(weak)
    near = np.clip((np.abs(q[:, 0]) - (RANGE - 0.1)) / 0.1, 0.0, 1.0)
    values = {"t": t, "tasks/position/activation": 1.0, "tasks/orientation/activation": 1.0}
    for i, joint in enumerate(JOINTS):
        values |= {f"q/{joint}": q[:, i], f"v/{joint}": v[:, i], f"tau/{joint}": tau[:, i]}
    for i, axis in enumerate("xyz"):
        values |= {f"tool/{axis}": tool[:, i], f"tasks/position/error/{i}": error[:, i]}
    for i in range(6):
        values[f"levels/{i // 3}/sigma/{i % 3}"] = sigma[:, i]
        values[f"levels/{i // 3}/activation/{i % 3}"] = weak if i == 5 else 1.0
    if name == "joint-limit" and variant != "without":
        values["limits/joint1/upper"] = smooth(near) if variant == "transition" else near > 0.5
    ended = ("stopped", "joint 'joint6' moved at 21.0 rad/s") if explodes else ("completed", "")
    scenario = {**SCENARIOS[name], "description": name}
    return write(directory, values, header={"scenario": scenario}, ended=ended[0], reason=ended[1])


def joint_positions(name, variant, t, phase):
    if name == "joint-limit":
        far = np.array([1.1, 0.05, 0.1, 0.0, -0.05, 0.4])
        q = HOME + phase[:, None] * far
        if variant != "without":
            q[:, 0] = 0.74 * np.tanh(q[:, 0] / 0.74 * 1.6) / np.tanh(1.6 * 1.1 / 0.74)
        return q
    q = HOME + phase[:, None] * np.array([0.0, -0.75, 1.25, 0.02, -0.5, 0.01])
    if variant == "without":
        growth = np.exp(7.0 * (t - 2.2))[:, None]
        q += growth * 0.5 * np.sin(np.outer(t, [31.0, 37.0, 41.0, 45.0, 50.0, 43.0]))
    return q


def torques(variant, name, t, q, v, dt):
    tau = np.gradient(v, t, axis=0) * [3.0, 3.0, 1.0, 0.2, 0.2, 0.2]
    tau[:, 1] += 40.0 * np.cos(q[:, 1])
    tau[:, 2] += 12.0 * np.cos(q[:, 1] + q[:, 2])
    if variant == "switch":
        tau[(t > 2.0) & (t < 5.0)] += [9.0, -14.0, 6.0, 1.0, -2.0, 0.5]
    return tau


def tool_motion(name, variant, phase):
    offset = np.array([0.5, 0.0, 0.0] if name == "singularity" else [-0.25, 0.45, 0.0])
    wanted = np.array([0.45, -0.15, 0.1]) + phase[:, None] * offset
    reached = phase if variant == "without" else 0.62 * np.tanh(phase / 0.62)
    tool = np.array([0.45, -0.15, 0.1]) + reached[:, None] * offset
    return tool, wanted - tool
