"""How near bodies come to each other, and what keeping them apart does to the torque."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from opspace.plots import style
from opspace.plots.labels import Line, draw_lines, label_ends
from opspace.record import Recording

_HEIGHT = 1.9
_CALM = 1e-3
"""Torque steps below this are drawn there, N·m per ms: they have no logarithm."""

_BLOCK = 10
"""Ticks of which the largest step is drawn."""

COLORS: Mapping[str, str] = {
    "without": "#BB5566",
    "switch": "#DDAA33",
    "cbf-qp": "#44AA99",
    "inertia": "#8c8c8c",
    "opspace": "#004488",
}


def collisions_figure(
    scenes: Mapping[str, Mapping[str, Recording]], margins: Mapping[str, float]
) -> Figure:
    """Draw the nearest pair and the torque steps of several scenes over time.

    Args:
        scenes: Recordings by way, by scene.
        margins: Distance that was to be kept in each scene, m.

    Returns:
        The figure: a row for each scene.
    """
    figure = style.new_figure(0.6 + _HEIGHT * len(scenes))
    panels = figure.subplots(len(scenes), 2, squeeze=False)
    labels = {}
    for (name, runs), (left, right) in zip(scenes.items(), panels, strict=True):
        last = name == list(scenes)[-1]
        x = "time [s]" if last else ""
        style.dress(left, title=name, x=x, y="nearest pair [mm]")
        style.dress(right, x=x, y="torque step [N·m/ms]")
        near = [_line(way, run.t, 1e3 * run["distances/least"]) for way, run in runs.items()]
        steps = [_line(way, *_steps(run)) for way, run in runs.items()]
        # The library last, so that nothing hides it.
        draw_lines(left, near[::-1], 1.3)
        draw_lines(right, steps[::-1], 1.1)
        left.axhline(1e3 * margins[name], color=style.INK, linewidth=0.8, linestyle=(0, (4, 3)))
        left.axhspan(-1e3, 0.0, color=style.VARIANT_COLORS["without"], alpha=0.08, linewidth=0.0)
        lowest = min(float(np.min(line.y)) for line in near)
        left.set_ylim(max(lowest - 5.0, -150.0), 100.0)
        right.set_yscale("log")
        right.set_ylim(bottom=_CALM)
        labels[right] = steps
    label_ends(labels)
    return figure


def _line(way: str, t: np.ndarray, values: np.ndarray) -> Line:
    return Line(way, COLORS.get(way, style.line_color(0)), t, values)


def _steps(run: Recording) -> tuple[np.ndarray, np.ndarray]:
    steps = np.max(np.abs(np.diff(run.group("tau"), axis=0)), axis=1) / (1e3 * np.diff(run.t))
    blocks = len(steps) // _BLOCK
    most = steps[: blocks * _BLOCK].reshape(blocks, _BLOCK).max(axis=1)
    return run.t[1 : blocks * _BLOCK + 1 : _BLOCK], np.maximum(most, _CALM)
