"""Put a peg into a hole that is off by 2 mm and 1°, twenty times, and draw what is felt.

    python docs/evidence/peg.py

The directions in which the hole is off come from the number of the run. Prints a row for each run and
draws all of them into docs/images/peg.png.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from PIL import Image

from opspace.plots import save, style
from opspace.robots import load_robot
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario, scenario_from
from opspace.tasks.rotation import exp_rotation

RUNS = 20
OFF, LEAN = 2e-3, math.radians(1.0)
COLORS = 128
"""Of the picture: twenty thin lines are large in all their shades."""
ABOVE = 0.0105
"""How far above the plate the peg begins, m."""


def hole_of(run: int, radius: float) -> dict[str, list[float]]:
    """Place the hole of a run, off from the middle of a circle through the start, m."""
    angle, direction = 2.0 * math.pi * np.random.default_rng(run).random(2)
    robot = load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(robot.nv))
    tool = robot.frame_id(robot.tool)
    off = OFF * np.array([math.cos(angle), math.sin(angle), 0.0])
    axis = LEAN * np.array([math.cos(direction), math.sin(direction), 0.0])
    point = robot.position(tool) - [radius, 0.0, ABOVE] + off
    normal = exp_rotation(axis) @ -robot.rotation(tool)[:, 2]
    return {"point": point.tolist(), "normal": normal.tolist()}


def insert(run: int) -> np.ndarray:
    """Run the shipped scenario with a hole of its own.

    Returns:
        Time [s], depth of the peg [m], its lean from the hole [rad], force [N] and largest step of a
        torque [N·m per tick], a row each.
    """
    data = load_scenario("peg").model_dump(mode="json")
    data["plant"]["holes"][0] |= hole_of(run, data["tasks"]["hold"]["target"]["radius"])
    data["seed"] = run
    built = build(scenario_from(data))
    hole, robot = built.plant.holes[0], built.robot.fresh()
    tool, before, rows = robot.frame_id(robot.tool), None, []
    for i in range(round(built.scenario.duration / built.scenario.dt)):
        t = i * built.scenario.dt
        q, v = built.plant.measure()
        tau = built.controller.step(t, q, v, wrenches=built.plant.wrenches()).tau
        robot.update(built.plant.q, built.plant.v)
        straight = -float(hole.axes[:, 2] @ robot.rotation(tool)[:, 2])
        force = float(np.linalg.norm(built.plant.exerted[:3]))
        step = 0.0 if before is None else float(np.max(np.abs(tau - before)))
        depth = hole.inserted(robot.position(tool))
        rows.append((t, depth, math.acos(min(straight, 1.0)), force, step))
        built.plant.advance(tau)
        before = tau
    return np.array(rows).T


def draw(runs: list[np.ndarray], path: Path) -> Path:
    """Draw depth, lean and force of all runs, the first of them in front."""
    figure = style.new_figure(6.4)
    axes = figure.subplots(3, 1, sharex=True)
    names = ("depth of the peg [mm]", "lean [°]", "force [N]")
    for number, run in reversed(list(enumerate(runs))):
        first = number == 0
        look = {
            "color": style.VARIANT_COLORS["transition"] if first else style.FAINT,
            "linewidth": style.LINE if first else 0.6,
            "zorder": 3.0 if first else 2.0,
        }
        for ax, scale, row in zip(axes, (1e3, 180.0 / math.pi, 1.0), run[1:4], strict=True):
            ax.plot(run[0], scale * row, **look)
    for ax, name in zip(axes, names, strict=True):
        style.dress(ax, x="time [s]" if name == names[-1] else "", y=name)
    axes[0].axhline(0.0, color=style.FAINT, linewidth=1.0, linestyle=":")
    save(figure, path)
    with Image.open(path) as drawn:
        few = drawn.convert("RGB").quantize(COLORS, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    return path


def main() -> None:
    """Run all, print a row for each, and draw."""
    runs = []
    for number in range(RUNS):
        run = insert(number)
        t, depth, _, force, step = run
        there = t[int(np.argmax(depth > 0.0195))] if np.any(depth > 0.0195) else math.nan
        print(
            f"run {number:2d}: in after {there:.2f} s, {1e3 * depth[-1]:.2f} mm deep, "
            f"at most {np.max(force):.1f} N, {np.max(step):.2f} N·m per ms",
            flush=True,
        )
        runs.append(run)
    draw(runs, Path(__file__).parent.parent / "images" / "peg.png")


if __name__ == "__main__":
    main()
