"""Draw how the wrist of a PUMA 560 passes over its first joint's axis.

``python docs/evidence/buffer_shoulder.py`` takes half a minute.
"""

from __future__ import annotations

import numpy as np
from buffer_document import DOCS
from buffer_motions import START, Run
from buffer_singularities import VARIANTS, shoulder
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import opspace as osc
from opspace.plots.style import (
    BAND,
    FAINT,
    INK,
    SMALL,
    VARIANT_COLORS,
    VARIANT_TITLES,
    dress,
    new_figure,
    save,
    text_color,
)

SHOULDER = 0.15005
"""Distance of the arm's plane from the first joint's axis, m."""
HAND = 0.1
"""Distance of the tool from the wrist centre, m."""
EVERY = 10
"""One point in so many ticks is drawn."""


def wrist_path(done: Run) -> np.ndarray:
    """Return the wrist's horizontal places, (T, 2), m."""
    robot = osc.load_robot("puma560")
    tool = robot.frame_id(robot.tool)
    places = []
    for q in done.seen.q[::EVERY]:
        robot.update(q, np.zeros(robot.nv))
        places.append((robot.position(tool) - HAND * robot.rotation(tool)[:, 2])[:2])
    return np.array(places)


def draw() -> Figure:
    """Draw the way over the axis from above, and the torque of the first joint."""
    runs = {name: shoulder(option) for name, option in VARIANTS.items()}
    figure = new_figure(3.7)
    above, torque = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    dress(above, title="the wrist from above", x="x [m]", y="y [m]")
    dress(torque, title="on the way over", x="time [s]", y="torque of joint 1 [N·m]")
    _draw_above(above, runs)
    _draw_torque(torque, runs)
    return figure


def _draw_above(panel: Axes, runs: dict[str, Run]) -> None:
    panel.add_patch(Circle((0.0, 0.0), SHOULDER, color=BAND, zorder=0))
    panel.plot(0.0, 0.0, "+", color=INK, ms=9)
    panel.text(0.012, 0.012, "axis of joint 1", fontsize=SMALL, color=INK)
    panel.text(0.0, 0.1, "out of reach", fontsize=SMALL, color="#55717f", ha="center")
    path = wrist_path(runs["transition"])
    out = path[: int(runs["transition"].back / 0.001) // EVERY]
    start, goal = path[0], path[0] + [-0.7, 0.15]
    panel.plot(*zip(start, goal, strict=True), ":", color=FAINT, lw=1.6)
    panel.text(-0.29, 0.002, "asked for", fontsize=SMALL, color=FAINT, ha="left")
    stopped = wrist_path(runs["without"])
    for places, name in ((out, "transition"), (stopped, "without")):
        panel.plot(*places.T, color=VARIANT_COLORS[name], lw=2.0)
    panel.plot(*stopped[-1], "x", color=VARIANT_COLORS["without"], ms=9, mew=2.0, zorder=5)
    _name(panel, 0.13, -0.075, "without")
    _name(panel, -0.17, -0.19, "transition")
    panel.set(xlim=(-0.4, 0.4), ylim=(-0.26, 0.2))
    panel.set_aspect("equal")


def _draw_torque(panel: Axes, runs: dict[str, Run]) -> None:
    for name in ("switch", "without", "transition"):
        tau = np.array(runs[name].seen.tau)[:, 0]
        panel.plot(runs[name].t, tau, color=VARIANT_COLORS[name], lw=1.6)
    panel.set(xlim=(START, 4.5), ylim=(-110.0, 110.0))
    for name, (x, y) in {"switch": (2.72, -72.0), "without": (1.85, 95.0)}.items():
        _name(panel, x, y, name)
    _name(panel, 2.8, -17.0, "transition")


def _name(panel: Axes, x: float, y: float, variant: str) -> None:
    color = text_color(VARIANT_COLORS[variant])
    panel.text(x, y, VARIANT_TITLES[variant], fontsize=SMALL, color=color, fontweight="bold")


if __name__ == "__main__":
    save(draw(), DOCS / "images" / "shoulder.png")
