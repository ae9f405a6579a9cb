"""A humanoid whose contacts come and go: what is there, what it carries, and what steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.plots import runs as data
from opspace.plots import style
from opspace.plots.labels import Line, label_ends
from opspace.record import Recording
from opspace.record.contact_columns import GROUP, contacts_in

COLORS: Mapping[str, str] = {
    "transition": style.VARIANT_COLORS["transition"],
    "switch": style.VARIANT_COLORS["switch"],
    "weighted": style.VARIANT_COLORS["without"],
    "weighted-switch": style.line_color(3),
    "hierarchy": style.line_color(4),
    "hierarchy-switch": style.line_color(5),
    "tsid": style.line_color(6),
}
TITLES: Mapping[str, str] = {
    "transition": "continuous",
    "switch": "hard switch",
    "weighted": "weighted QP",
    "weighted-switch": "switched weights",
    "hierarchy": "strict QPs",
    "hierarchy-switch": "switched QPs",
    "tsid": "TSID",
}
LOWEST = 1e-4
"""Where a torque step counts as none, N·m."""
SHOWN = "transition"


def humanoid_figure(runs: Mapping[str, Recording], changes: Mapping[str, float]) -> Figure:
    """Draw activations and forces of one run, torque steps and errors of all.

    Args:
        runs: Recording by variant, ``transition`` among them.
        changes: When what happened in that one, s.

    Returns:
        Four panels over time.
    """
    run = runs[SHOWN]
    figure = style.new_figure(10.0)
    ratios = (1.5, 1.5, 1.2, 1.0)
    activations, forces, steps, errors = figure.subplots(
        4, 1, sharex=True, gridspec_kw={"height_ratios": ratios}
    )
    lines = {
        activations: _activations(activations, run),
        forces: _forces(forces, run),
        steps: _over_time(steps, runs, "step"),
        errors: _over_time(errors, runs, "error"),
    }
    style.dress(activations, title="contacts: motion (thin), force (thick); tasks below", y="h")
    style.dress(forces, title="force on the robot: planned (thin), measured (thick)", y="[N]")
    style.dress(steps, title="largest torque step of any joint", y="[N·m] per tick")
    style.dress(errors, title="error of the centre of mass", x="time [s]", y="[mm]")
    for panel in lines:
        panel.set_xlim(0.0, float(run.t[-1]))
        for time in changes.values():
            panel.axvline(time, color=style.FAINT, lw=0.7, ls=":", zorder=0)
    label_ends(lines)
    return figure


def _activations(panel: Axes, run: Recording) -> list[Line]:
    """Draw h of contacts and tasks, one above the other."""
    lines: list[Line] = []
    names = contacts_in(run)
    shown = [name for name in run.header["tasks"] if _changes(run[f"tasks/{name}/activation"])]
    rows = [*((name, True) for name in names), *((name, False) for name in shown)]
    for i, (name, contact) in enumerate(rows):
        base, color = float(len(rows) - 1 - i), style.line_color(i)
        where = f"{GROUP}/{name}" if contact else f"tasks/{name}"
        h = base + 0.8 * np.nan_to_num(run[f"{where}/activation"])
        panel.fill_between(run.t, base, h, color=color, alpha=0.25, linewidth=0.0)
        panel.plot(run.t, h, color=color, linewidth=1.6)
        if contact:
            motion = base + 0.8 * np.nan_to_num(run[f"{where}/motion"])
            panel.plot(run.t, motion, color=color, linewidth=0.8)
        lines.append(Line(name, color, run.t, np.full(run.t.size, base + 0.3)))
    panel.set_yticks([])
    return lines


def _changes(values: np.ndarray) -> bool:
    return bool(np.isnan(values).any() or np.ptp(values) > 0.0)


def _forces(panel: Axes, run: Recording) -> list[Line]:
    """Draw the normal force of every contact."""
    lines: list[Line] = []
    for i, name in enumerate(contacts_in(run)):
        normal = np.array(run.header[GROUP][name]["normal"] or [0.0, 0.0, 1.0])
        color = style.line_color(i)
        planned = np.nan_to_num(run.group(f"{GROUP}/{name}/force")) @ normal
        if f"{GROUP}/{name}/measured/x" in run:
            measured = run.group(f"{GROUP}/{name}/measured") @ normal
            panel.plot(run.t, measured, color=color, linewidth=2.4, alpha=0.5)
        panel.plot(run.t, planned, color=color, linewidth=0.9)
        lines.append(Line(name, color, run.t, planned))
    return lines


def _over_time(panel: Axes, runs: Mapping[str, Recording], what: str) -> list[Line]:
    """Draw torque steps or errors of all runs, that of the shown one on top."""
    lines: list[Line] = []
    for variant in sorted(runs, key=lambda name: name == SHOWN):
        run = runs[variant]
        if what == "step":
            t, values = run.t[1:], np.maximum(data.largest_step(run), LOWEST)
        else:
            t = run.t
            values = 1e3 * np.linalg.norm(run.group("tasks/com/error"), axis=1)
        alpha = 1.0 if variant == SHOWN else 0.75
        panel.plot(t, values, color=COLORS[variant], linewidth=1.1, alpha=alpha)
        lines.append(Line(TITLES[variant], COLORS[variant], t, values))
    if what == "step":
        panel.set_yscale("log")
    return lines
