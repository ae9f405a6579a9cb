"""Torque and its steps from tick to tick, side by side for the variants of an experiment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from opspace.plots import runs as data
from opspace.plots import style
from opspace.plots.labels import draw_lines, label_ends, mark_ends, number
from opspace.record import Recording


def torque_figure(runs: Mapping[str, Recording]) -> Figure:
    """Draw the torque of every joint and the largest |Δtau| of any joint in each tick.

    Args:
        runs: Recording by variant.

    Returns:
        One column of panels per variant, the steps all with the same scale.
    """
    runs = data.check_variants(runs)
    figure, end = style.new_figure(5.6), data.end_time(runs)
    panels = figure.subplots(2, len(runs), sharex=True, squeeze=False)
    scales, steps_scale = data.scales(runs, "tau"), _step_range(runs)
    for column, (name, run) in enumerate(runs.items()):
        torque, step = panels[:, column]
        lines, steps = data.joint_lines(run, "tau"), data.largest_step(run)
        style.dress(torque, title=data.title(name, run, ",\n"))
        torque.set_ylim(scales[name])
        draw_lines(torque, lines, 1.3)
        if data.stopped(run):
            mark_ends(torque, lines)
        style.dress(step, title=f"largest step {number(np.fmax.reduce(steps))} N·m", x="time [s]")
        step.set(yscale="log", ylim=steps_scale, xlim=(0.0, end))
        step.plot(run.t[1:], data.positive(steps), color=style.VARIANT_COLORS[name], linewidth=1.1)
    panels[0, 0].set_ylabel("joint torque [N·m]")
    panels[1, 0].set_ylabel("largest |Δτ| per tick [N·m]")
    for panel in panels[1, 1:]:
        panel.tick_params(labelleft=False)
    last = len(runs) - 1
    label_ends(
        {
            panels[0, column]: data.joint_lines(run, "tau")
            for column, run in enumerate(runs.values())
            if data.stopped(run) or column == last
        }
    )
    return figure


def _step_range(runs: Mapping[str, Recording]) -> tuple[float, float]:
    """Return a range of |Δtau| that shows every run and leaves out rounding."""
    steps = np.concatenate([data.largest_step(run) for run in runs.values()])
    steps = steps[np.isfinite(data.positive(steps))]
    if not len(steps):
        return 1e-3, 1.0
    top = 2.0 * float(steps.max())
    return max(0.5 * float(np.quantile(steps, 0.01)), 1e-6 * top), top
