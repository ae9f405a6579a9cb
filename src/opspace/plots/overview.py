"""One picture of what the method is for: pictures of the robot beside speed and torque steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.plots import runs as data
from opspace.plots import style
from opspace.plots.labels import Line, key_row, label_ends, number
from opspace.record import Recording

if TYPE_CHECKING:
    from matplotlib.gridspec import SubplotSpec

SPEED, STEP = "fastest joint [rad/s]", "|Δτ| per tick [N·m]"
LOWEST = {SPEED: 1e-2, STEP: 1e-3}
"""Rest and rounding, below which nothing is worth showing on a logarithmic scale."""


def overview_figure(
    experiments: Mapping[str, Mapping[str, Recording]],
    path: Path | str,
    *,
    images: Sequence[np.ndarray] = (),
) -> Path:
    """Draw the largest joint speed and the largest torque step of every tick.

    Args:
        experiments: Runs by variant, by the title of their experiment.
        path: PNG file to write.
        images: (height, width, 3) pictures, drawn above each other at the left.

    Returns:
        The path.

    Raises:
        InputError: There is no run, or one of them is too short to draw.
        UnknownNameError: There is no such variant, or a column is missing.
    """
    return style.save(draw_overview(experiments, images), path)


def draw_overview(
    experiments: Mapping[str, Mapping[str, Recording]], images: Sequence[np.ndarray] = ()
) -> Figure:
    """Draw the overview; see `overview_figure`."""
    groups = {title: data.check_variants(runs) for title, runs in experiments.items()}
    figure = style.new_figure(4.6)
    widths = [0.8] * bool(images) + [1.0] * len(groups)
    grid = figure.add_gridspec(2, len(widths), width_ratios=widths)
    if images:
        _draw_images(figure, grid[:, 0], images)
    first = len(widths) - len(groups)
    rows: dict[str, list[Axes]] = {SPEED: [], STEP: []}
    for column, (title, runs) in enumerate(groups.items(), start=first):
        for row, (label, panels) in enumerate(rows.items()):
            panel = figure.add_subplot(grid[row, column], sharey=panels[0] if panels else None)
            panel.set(xlim=(0.0, data.end_time(runs)), yscale="log", ylim=_range(label, groups))
            style.dress(panel, title="" if row else title, x="time [s]" if row else "")
            panel.tick_params(labelbottom=row == 1, labelleft=not panels)
            panel.set_ylabel("" if panels else label)
            for name, run in runs.items():
                _draw_run(panel, name, run, label)
            panels.append(panel)
    peaks: dict[Axes, list[Line]] = {}
    for label, panels in rows.items():
        for panel, runs in zip(panels, groups.values(), strict=True):
            peaks[panel] = [_peak(panel, name, run, label) for name, run in runs.items()]
    label_ends(peaks)
    key_row(figure, _key(groups))
    return figure


def _key(groups: Mapping[str, Mapping[str, Recording]]) -> list[tuple[str, str]]:
    """Return name and colour of each variant, and what a cross means."""
    stopped: dict[str, bool] = {}
    for name, run in (item for runs in groups.values() for item in runs.items()):
        stopped[name] = stopped.get(name, False) or data.stopped(run)
    return [
        (style.VARIANT_TITLES[n] + (" (×: stopped)" if s else ""), style.VARIANT_COLORS[n])
        for n, s in stopped.items()
    ]


def _draw_images(figure: Figure, place: SubplotSpec, images: Sequence[np.ndarray]) -> None:
    rows = place.subgridspec(len(images), 1, hspace=0.02)
    for i, image in enumerate(images):
        panel = figure.add_subplot(rows[i, 0])
        panel.imshow(image)
        panel.set_axis_off()


def _values(run: Recording, label: str) -> tuple[np.ndarray, np.ndarray]:
    return (run.t, data.fastest(run)) if label == SPEED else (run.t[1:], data.largest_step(run))


def _draw_run(panel: Axes, variant: str, run: Recording, label: str) -> None:
    color, (t, values) = style.VARIANT_COLORS[variant], _values(run, label)
    panel.plot(t, data.positive(values), linewidth=1.3, **style.overlaid(variant))
    if data.stopped(run):
        panel.plot(t[-1:], values[-1:], "x", color=color, markersize=8, mew=2.0, zorder=4)


def _range(label: str, groups: Mapping[str, Mapping[str, Recording]]) -> tuple[float, float]:
    runs = [run for group in groups.values() for run in group.values()]
    peak = np.fmax.reduce([np.fmax.reduce(_values(run, label)[1]) for run in runs])
    return LOWEST[label], 3.0 * float(np.fmax(peak, LOWEST[label]))


def _peak(panel: Axes, variant: str, run: Recording, label: str) -> Line:
    """Return what writes the largest value at the right of a panel, at its height."""
    x, y = np.array(panel.get_xlim()), np.full(2, np.fmax.reduce(_values(run, label)[1]))
    return Line(f"max {number(y[0])}", style.VARIANT_COLORS[variant], x, y)
