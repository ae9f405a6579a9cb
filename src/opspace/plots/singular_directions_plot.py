"""Figures of the singularity experiment, after Fig. 3, 4 and 5 of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.law.activation import Buffer
from opspace.plots import runs as data
from opspace.plots import style
from opspace.plots.joint_torque import torque_figure
from opspace.plots.labels import Line, draw_lines, label_ends, mark_ends
from opspace.record import Recording

OURS = style.VARIANT_COLORS["transition"]


def singularity_figures(runs: Mapping[str, Recording], directory: Path | str) -> list[Path]:
    """Draw the singularity experiment.

    Args:
        runs: Recording by variant: ``without``, ``switch`` and ``transition``; the figures show
            those that are there.
        directory: Directory to write to.

    Returns:
        The files that were written.

    Raises:
        InputError: There is no run, or one of them is too short to draw.
        UnknownNameError: There is no such variant, or a column is missing.
    """
    runs, directory = data.check_variants(runs), Path(directory)
    figures = {"fig3-joint-speed": joint_speed_figure(runs)}
    if "transition" in runs:
        figures["fig4-activation"] = activation_figure(runs["transition"])
        figures["fig5-position"] = position_figure(runs["transition"])
    figures["singularity-torque"] = torque_figure(runs)
    return [style.save(figure, directory / f"{name}.png") for name, figure in figures.items()]


def joint_speed_figure(runs: Mapping[str, Recording]) -> Figure:
    """Draw the velocity of every joint, without and with the method (Fig. 3).

    Args:
        runs: Recording by variant.

    Returns:
        One panel per run; ``switch`` only where there is no other.
    """
    shown = {name: run for name, run in runs.items() if name != "switch"} or dict(runs)
    figure, end = style.new_figure(3.6), data.end_time(shown)
    panels, scales = figure.subplots(1, len(shown), squeeze=False)[0], data.scales(shown, "v")
    lines = {name: data.joint_lines(run, "v") for name, run in shown.items()}
    for panel, (name, run) in zip(panels, shown.items(), strict=True):
        panel.set(xlim=(0.0, end), ylim=scales[name])
        style.dress(panel, title=data.title(name, run), x="time [s]", y="joint velocity [rad/s]")
        draw_lines(panel, lines[name])
        if data.stopped(run):
            mark_ends(panel, lines[name])
    label_ends({panel: lines[name] for panel, name in zip(panels, shown, strict=True)})
    return figure


def activation_figure(run: Recording) -> Figure:
    """Draw the activation of the weakest direction over its eigenvalue (Fig. 4).

    Args:
        run: A run with continuous transitions.

    Returns:
        The points of the run on the curve of its buffer.
    """
    figure = style.new_figure(3.6, width=6.0)
    panel, edges, direction = figure.subplots(), data.sigma_edges(run), data.weakest(run)
    lowest = 0.01 if direction is None else float(np.nanmin(direction.sigma))
    top = 2.0 * edges.upper if edges else 4.0 * max(lowest, 1e-3)
    if edges:
        grid = np.linspace(0.0, top, 400)
        buffer = Buffer(edges.lower, edges.upper, edges.profile)
        panel.axvspan(edges.lower, edges.upper, color=style.BAND, zorder=0)
        panel.plot(grid, [buffer(float(s)).value for s in grid], color=style.FAINT, linewidth=1.6)
        _write(panel, 0.5 * (edges.lower + edges.upper), 1.09, "buffer", "center", style.INK)
        _write(panel, 0.98 * top, 0.78, f"profile: {edges.profile}", "right", style.FAINT)
    if direction is not None:
        sigma, activation = _thinned(*direction.weakest(), top)
        panel.plot(sigma, activation, "o", color=OURS, markersize=5.5, alpha=0.8, mew=0)
        _write(panel, 0.98 * top, 0.89, "measured in the run", "right", OURS)
    panel.set(xlim=(0.0, top), ylim=(-0.05, 1.17), yticks=np.linspace(0.0, 1.0, 6))
    style.dress(
        panel,
        x=f"smallest eigenvalue σ of the projected Λ⁻¹ [{edges.unit if edges else '1'}]",
        y="activation of its direction [1]",
    )
    return figure


def position_figure(run: Recording, task: str = "position") -> Figure:
    """Draw tool and desired position, activations and eigenvalues over time (Fig. 5).

    Args:
        run: A run with continuous transitions.
        task: The task that controls the position of the tool.

    Returns:
        Three panels over one time axis.
    """
    figure, edges, direction = style.new_figure(7.0), data.sigma_edges(run), data.weakest(run)
    position, activation, spectrum = figure.subplots(3, 1, sharex=True, height_ratios=[1.7, 1, 1.2])
    lines: dict[Axes, list[Line]] = {position: data.tool_lines(run)}
    wanted = data.desired(run, task)
    for i, line in enumerate(lines[position]):
        position.plot(run.t, wanted[:, i], color=line.color, linewidth=1.3, linestyle=(0, (4, 2.5)))
    if direction is not None:
        lines[activation] = data.direction_lines(run.t, direction.activation)
        lines[spectrum] = data.direction_lines(run.t, data.positive(direction.sigma))
        spectrum.set(yscale="log", ylim=_sigma_range(direction.sigma, edges))
        _shade_fading([position, activation, spectrum], run.t, direction)
    if edges:
        spectrum.axhspan(edges.lower, edges.upper, color=style.BAND, zorder=0)
        middle, t = (edges.lower * edges.upper) ** 0.5, 0.01 * float(run.t[-1])
        _write(spectrum, t, middle, "buffer", "left", style.INK)
    position.set(xlim=(0.0, float(run.t[-1])))
    activation.set(ylim=(-0.1, 1.15), yticks=[0.0, 0.5, 1.0])
    unit = edges.unit if edges else "1"
    style.dress(position, title="tool: actual (solid) and desired (dashed)", y="position [m]")
    style.dress(
        activation, title="activation of each direction (shaded: fading)", y="activation [1]"
    )
    style.dress(spectrum, title="eigenvalues of the projected Λ⁻¹", x="time [s]", y=f"σ [{unit}]")
    for panel, drawn in lines.items():
        draw_lines(panel, drawn)
    label_ends(lines)
    return figure


def _thinned(
    sigma: np.ndarray, activation: np.ndarray, top: float, bins: int = 45
) -> tuple[np.ndarray, np.ndarray]:
    """Keep one tick of each small range of the eigenvalue, so that points stay points."""
    inside = np.isfinite(sigma) & (sigma >= 0.0) & (sigma <= top)
    sigma, activation = sigma[inside], activation[inside]
    _, first = np.unique(np.floor(sigma / top * bins), return_index=True)
    return sigma[first], activation[first]


def _shade_fading(panels: list[Axes], t: np.ndarray, direction: data.Direction) -> None:
    """Shade the times at which a direction is not fully active."""
    fading = (direction.weakest()[1] < 1.0).astype(int)
    changes = np.flatnonzero(np.diff(fading, prepend=0, append=0))
    for start, stop in changes.reshape(-1, 2):
        for panel in panels:
            panel.axvspan(
                float(t[start]), float(t[stop - 1]), color=style.BAND, zorder=0, linewidth=0
            )


def _sigma_range(sigma: np.ndarray, edges: data.SigmaEdges | None) -> tuple[float, float]:
    """Return a range that shows the eigenvalues and the buffer, but not the way to an exact 0."""
    shown = sigma[np.isfinite(sigma) & (sigma > 0.0)]
    marks = np.append(shown, [edges.lower, edges.upper] if edges else [])
    if not marks.size:
        return 0.1, 1.0
    floor = 0.05 * edges.lower if edges else 1e-6 * float(marks.max())
    return 0.7 * max(float(marks.min()), floor), 1.5 * float(marks.max())


def _write(panel: Axes, x: float, y: float, text: str, ha: str, color: str) -> None:
    panel.text(x, y, text, ha=ha, va="center", fontsize=style.SMALL, color=style.text_color(color))
