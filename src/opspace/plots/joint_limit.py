"""Figures of the joint limit experiment, after Fig. 7 of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.plots import runs as data
from opspace.plots import style
from opspace.plots.joint_torque import torque_figure
from opspace.plots.labels import key_row
from opspace.record import Recording


def joint_limit_figures(runs: Mapping[str, Recording], directory: Path | str) -> list[Path]:
    """Draw the joint limit experiment.

    Args:
        runs: Recording by variant: ``without``, ``switch`` and ``transition``; the figures show
            those that are there.
        directory: Directory to write to.

    Returns:
        The files that were written.

    Raises:
        InputError: There is no run, one of them is too short to draw, or none has a limit task.
        UnknownNameError: There is no such variant, or a column is missing.
    """
    runs, directory = data.check_variants(runs), Path(directory)
    figures = {
        "fig7-joint-limit": limit_figure(runs),
        "joint-limit-torque": torque_figure(runs),
    }
    return [style.save(figure, directory / f"{name}.png") for name, figure in figures.items()]


def limit_figure(runs: Mapping[str, Recording]) -> Figure:
    """Draw position and velocity of the limited joint and the activation of its limit (Fig. 7).

    Args:
        runs: Recording by variant.

    Returns:
        Three panels over one time axis, with a line for each variant.
    """
    limit, figure = data.limited_joint(runs), style.new_figure(7.0)
    position, velocity, activation = figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1, 1])
    flips = ""
    for name, run in runs.items():
        look = style.overlaid(name)
        position.plot(run.t, run[f"q/{limit.joint}"], linewidth=1.9, **look)
        velocity.plot(run.t, run[f"v/{limit.joint}"], linewidth=1.9, **look)
        active = data.limit_activation(run, limit.joint)
        if active is not None and name != "without":
            activation.plot(run.t, active, linewidth=1.9, **look)
        if active is not None and name == "switch":
            flips = f"; the hard switch flips {np.sum(np.abs(np.diff(active)) > 0.5)} times"
    _draw_limits(position, limit)
    activation.set(ylim=(-0.1, 1.15), yticks=[0.0, 0.5, 1.0])
    position.set_xlim(0.0, data.end_time(runs))
    unit = limit.unit
    style.dress(position, title=f"{limit.joint}: position", y=f"position [{unit}]")
    style.dress(velocity, title=f"{limit.joint}: velocity", y=f"velocity [{unit}/s]")
    style.dress(
        activation, title=f"activation of its limit{flips}", x="time [s]", y="activation [1]"
    )
    key_row(figure, [(data.title(n, r), style.VARIANT_COLORS[n]) for n, r in runs.items()])
    return figure


def _draw_limits(panel: Axes, limit: data.Limit) -> None:
    """Draw those limits that the joint comes near to."""
    low, high = panel.get_ylim()
    margin = 0.25 * (high - low)
    for value, inwards, name in ((limit.lower, 1.0, "lower"), (limit.upper, -1.0, "upper")):
        if value is None or not low - margin < value < high + margin:
            continue
        panel.axhline(value, color=style.INK, linewidth=1.2, linestyle=(0, (5, 2)), zorder=1.5)
        inner = value + inwards * limit.buffer
        panel.axhspan(min(value, inner), max(value, inner), color=style.BAND, zorder=0)
        panel.annotate(
            f"{name} limit\n{value:g} {limit.unit}",
            (1.0, value),
            xycoords=("axes fraction", "data"),
            xytext=(5.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=style.SMALL,
            color=style.INK,
            annotation_clip=False,
        )
    low, high = np.nanmin([low, *panel.get_ylim()]), np.nanmax([high, *panel.get_ylim()])
    panel.set_ylim(low, high)
