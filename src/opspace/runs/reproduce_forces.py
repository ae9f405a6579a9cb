"""Touching and wiping in several ways, with what is felt and what it does to the torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from opspace.record.format import write_json
from opspace.robots import load_robot
from opspace.runs.run import METRICS
from opspace.scenario.build import build
from opspace.scenario.load import scenario_from
from opspace.scenario.schema import Scenario

FORCE = 10.0
"""What is pressed with, N."""
ABOVE = 0.02
"""How far above the table the tool begins, m."""
TITLES: Mapping[str, str] = MappingProxyType(
    {
        "contact": "force task by contact",
        "alone": "force task alone",
        "switch": "hard switch",
        "sai": "hard switch, gains of SAI",
        "impedance": "impedance, table known",
        "rough arm": "force task alone, masses and friction off",
    }
)
"""What the ways are called."""
SAI = MappingProxyType({"kp": 0.7, "ki": 1.3, "kv": 10.0, "friction": False})
"""Default gains of the force control of SAI primitives, without its observer of passivity."""
STIFFNESSES = (3e2, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6)
"""Of the sweep, N/m."""
CIRCLE_AT = 1.5
"""When the circle begins, s; it is measured half a second later, at its speed."""
SETTLED = 0.5
"""Part of a second at the end of a touch that is measured, s."""


@dataclass(frozen=True)
class Felt:
    """What one run gave, a row per tick.

    Attributes:
        t: (ticks,) time, s.
        tau: (ticks, n) torque, N·m.
        force: (ticks,) true force on the table, N.
        confidence: (ticks,) of the force task, NaN where there is none.
        away: (ticks,) distance from where the hand should be along the table, m.
        turned: (ticks,) angle from upright, rad.
    """

    t: np.ndarray
    tau: np.ndarray
    force: np.ndarray
    confidence: np.ndarray
    away: np.ndarray
    turned: np.ndarray

    @property
    def steps(self) -> np.ndarray:
        """(ticks − 1,) largest step of a joint torque, N·m per tick."""
        return np.max(np.abs(np.diff(self.tau, axis=0)), axis=1)

    @property
    def touched(self) -> int:
        """First tick with a force; the last one where there is none."""
        return int(np.argmax(self.force > 0.0)) if np.any(self.force > 0.0) else self.t.size - 1

    def touch(self) -> dict[str, float]:
        """Measure the touch: torque step from 50 ms before to 300 ms after, peak, losses."""
        first = self.touched
        touching = self.force > 0.0
        return {
            "torque_step": float(np.max(self.steps[max(first - 50, 0) : first + 300])),
            "peak_force": float(np.max(self.force)),
            "losses": int(np.sum(touching[:-1] & ~touching[1:])),
        }

    def wiping(self) -> dict[str, float]:
        """Measure the circle at its speed, RMS."""
        there = self.t > CIRCLE_AT + 0.5
        parts = {
            "force_rms": self.force - FORCE,
            "away_rms": 1e3 * self.away,
            "turned_rms": 1e3 * self.turned,
        }
        return {name: float(np.sqrt(np.mean(x[there] ** 2))) for name, x in parts.items()}


UNITS: Mapping[str, str] = MappingProxyType(
    {
        "torque_step": "N·m/ms",
        "peak_force": "N",
        "losses": "",
        "force_rms": "N",
        "away_rms": "mm",
        "turned_rms": "mrad",
    }
)
"""Units of what is measured."""


def ways(robot: str, stiffness: float = 1e5) -> dict[str, Scenario]:
    """Come down on a table at about 0.1 m/s, press and wipe a circle, in several ways.

    Args:
        robot: Name or absolute path of the robot.
        stiffness: Of the table, N/m.

    Returns:
        Scenarios by name of the way.
    """
    base = _pressing(robot, stiffness, 6.0)
    tasks = base["tasks"]
    drop = -2.0 * ABOVE
    down = {"type": "minimum_jerk", "offset": [0.0, 0.0, drop], "duration": 0.75}
    tasks["hand"]["target"] = {
        "type": "circle",
        "radius": 0.05,
        "period": 3.0,
        "start_time": CIRCLE_AT,
        "ramp": 0.5,
    }
    led = {"type": "position", "level": 2, "axes": "z", "kp": 400.0, "give_way": "press"}
    by_contact = {
        **tasks,
        "press": {**tasks["press"], "activation": {"contact": "press"}},
        "down": {**led, "target": down},
    }
    known = {**down, "offset": [0.0, 0.0, -ABOVE - 0.01]}
    # Below the hand, whose axes it has as well.
    spring = {"type": "impedance", "level": 3, "stiffness": [0.0, 0.0, FORCE / 0.01]}
    sprung = {
        "upright": tasks["upright"],
        "hand": tasks["hand"],
        "down": {**spring, "target": known},
        "posture": {**tasks["posture"], "level": 4},
    }
    like_sai = {**by_contact, "press": {**by_contact["press"], **SAI}}
    found = {
        "contact": {**base, "tasks": by_contact},
        "alone": base,
        "switch": {**base, "tasks": by_contact, "method": "switch"},
        "sai": {**base, "tasks": like_sai, "method": "switch"},
        "impedance": {**base, "tasks": sprung},
        "rough arm": {
            **base,
            "plant": {
                **base["plant"],
                "mass_error": 0.1,
                "dry_friction": _half_newton_metre(robot),
            },
        },
    }
    return {name: scenario_from(data) for name, data in found.items()}


def _half_newton_metre(robot: str) -> float:
    """Part of the torque limit of the joints that is some 0.5 N·m."""
    limit = load_robot(robot).torque_limit
    known = limit[np.isfinite(limit)]
    return float(0.5 / np.median(known)) if known.size else 0.0


def _pressing(robot: str, stiffness: float, duration: float) -> dict[str, Any]:
    arm = load_robot(robot)
    arm.update(arm.q_reference, np.zeros(arm.nv))
    x, y, z = arm.position(arm.frame_id(arm.tool)).tolist()
    tasks: dict[str, Any] = {
        "press": {
            "type": "force",
            "level": 0,
            "force": -FORCE,
            "axes_frame": "world",
            "contact": [1.0, 4.0],
            "approach_speed": 0.04,
        },
        "upright": {"type": "orientation", "level": 1, "kp": 400.0},
        "hand": {"type": "position", "level": 2, "axes": "xy", "kp": 400.0},
        "posture": {"type": "posture", "level": 3, "kp": 20.0},
    }
    surface = {"point": [x, y, z - ABOVE], "stiffness": stiffness, "friction": 0.3}
    return {
        "robot": robot,
        "duration": duration,
        "tasks": tasks,
        # What is measured is the touch, and nothing else that fades or switches.
        "joint_limits": None,
        "singularity": None,
        "plant": {
            "delay": 1e-3,
            "wrench_noise": 0.3,
            "wrench_delay": 2e-3,
            "surfaces": [surface],
        },
    }


def felt(scenario: Scenario) -> Felt:
    """Run a scenario whose tool presses downwards.

    Args:
        scenario: With a position or impedance task ``hand`` and an orientation ``upright``.

    Returns:
        What was felt.
    """
    built = build(scenario)
    press: Any = built.tasks.get("press")
    rows: list[tuple[Any, ...]] = []
    for i in range(round(scenario.duration / scenario.dt)):
        t = i * scenario.dt
        q, v = built.plant.measure()
        command = built.controller.step(t, q, v, wrenches=built.plant.wrenches())
        sure = np.nan if press is None else press.touch.confidence
        away, turned = (np.linalg.norm(command.tasks[name].error) for name in ("hand", "upright"))
        rows.append((t, command.tau, -built.plant.exerted[2], sure, away, turned))
        built.plant.advance(command.tau)
    return Felt(*(np.array(column) for column in zip(*rows, strict=True)))


def run_ways(robot: str) -> dict[str, Felt]:
    """Run all of `ways`."""
    return {name: felt(scenario) for name, scenario in ways(robot).items()}


def draw_touches(runs: Mapping[str, Felt], path: Path) -> Path:
    """Draw the touches of `run_ways`.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    from opspace.plots import save, touch_figure  # noqa: PLC0415 - an extra, and slow to import

    shown = {
        name: {
            "t": run.t - run.t[run.touched],
            "force": run.force,
            "step": np.append(run.steps, 0.0),
            "confidence": run.confidence,
        }
        for name, run in runs.items()
        if name != "rough arm"
    }
    return save(touch_figure(shown, TITLES, FORCE), path)


def measured(runs: Mapping[str, Felt]) -> dict[str, dict[str, float]]:
    """Measure runs of `ways`, by name."""
    return {name: {**run.touch(), **run.wiping()} for name, run in runs.items()}


def sweep_stiffness(
    robot: str, stiffnesses: Sequence[float] = STIFFNESSES
) -> dict[str, dict[str, float]]:
    """Press on tables of every stiffness with the same gains.

    Args:
        robot: Name or absolute path of the robot.
        stiffnesses: N/m.

    Returns:
        Of each what a touch gives, and the RMS error of the force [N] in the last half second.
    """
    found: dict[str, dict[str, float]] = {}
    for stiffness in stiffnesses:
        run = felt(scenario_from(_pressing(robot, stiffness, 3.0)))
        late = run.force[run.t > run.t[-1] - SETTLED] - FORCE
        found[f"{stiffness:.0e}"] = {**run.touch(), "force_rms": float(np.sqrt(np.mean(late**2)))}
    return found


def write(out: Path, name: str, numbers: Mapping[str, Mapping[str, float]]) -> Path:
    """Write the numbers of runs into a directory of their own and return it."""
    directory = out / name
    directory.mkdir(parents=True, exist_ok=True)
    write_json(directory / METRICS, {key: dict(value) for key, value in numbers.items()})
    return directory


def numbers_table(
    numbers: Mapping[str, Mapping[str, float]], first: str
) -> tuple[list[str], list[list[str]]]:
    """Write numbers for a person, one row per run.

    Args:
        numbers: By run, those of `UNITS`.
        first: Head of the first column.

    Returns:
        Heads and rows.
    """
    keys = list(next(iter(numbers.values())))
    heads = [f"{key.replace('_', ' ')} [{UNITS[key]}]".replace(" []", "") for key in keys]
    rows = [
        [name, *(f"{found[key]:d}" if key == "losses" else f"{found[key]:.3g}" for key in keys)]
        for name, found in numbers.items()
    ]
    return [first, *heads], rows
