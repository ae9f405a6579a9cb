"""A touch in several ways: force, torque step and activation over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from opspace.plots import style

BEFORE, AFTER = 0.05, 0.35
"""Time around the touch that is shown, s."""

COLORS = {
    "contact": style.VARIANT_COLORS["transition"],
    "alone": "#66B5E0",
    "switch": style.VARIANT_COLORS["switch"],
    "sai": "#AA4499",
    "impedance": style.VARIANT_COLORS["without"],
}


def touch_figure(
    runs: Mapping[str, Mapping[str, np.ndarray]], titles: Mapping[str, str], wanted: float
) -> Figure:
    """Draw touches, each from shortly before it.

    Args:
        runs: By way: ``t`` from the touch on [s], ``force`` [N], ``step`` [N·m per ms] and
            ``confidence``, one number per tick each.
        titles: What the ways are called.
        wanted: The force that is asked for, N.

    Returns:
        The figure.
    """
    figure = style.new_figure(6.4)
    force, step, sure = figure.subplots(3, 1, sharex=True)
    for name, run in runs.items():
        look = {
            "color": COLORS[name],
            "linewidth": style.LINE,
            "label": titles[name],
            "zorder": 2.0 if name in ("switch", "sai") else 2.5,
        }
        there = (run["t"] >= -BEFORE) & (run["t"] <= AFTER)
        t = 1e3 * run["t"][there]
        force.plot(t, run["force"][there], **look)
        step.plot(t, run["step"][there], **look)
        sure.plot(t, run["confidence"][there], **look)
    force.axhline(wanted, color=style.FAINT, linewidth=1.0, linestyle=":")
    style.dress(force, y="force [N]")
    style.dress(step, y="torque step\n[N·m per ms]")
    style.dress(sure, x="time after the touch [ms]", y="confidence")
    force.legend(frameon=False, fontsize=style.SMALL, loc="upper right")
    return figure
