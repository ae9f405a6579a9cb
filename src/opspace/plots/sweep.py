"""What a sweep found: numbers over what was varied, or how they are distributed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.plots import style

SHOWN = ("max_torque_step", "max_torque_use", "max_joint_speed", "position_excess")
WORDS = {
    "max_torque_step": "largest torque step",
    "max_torque_use": "largest torque, part of its limit",
    "max_joint_speed": "largest joint speed",
    "position_excess": "beyond a joint limit",
}
MOST = 3
"""Varied keys that fit beside each other."""

_GOOD, _BAD = style.VARIANT_COLORS["transition"], style.VARIANT_COLORS["without"]


def sweep_figure(rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> Figure:
    """Draw every number over every varied key that is a number; without one, distributions.

    Args:
        rows: Rows of a sweep, as `opspace.sweep.Sweep` has them.
        units: Unit by number.

    Returns:
        The figure.
    """
    keys = _numeric_keys(rows)[:MOST]
    if not keys:
        figure = style.new_figure(5.6)
        for panel, name in zip(figure.subplots(2, 2).flat, SHOWN, strict=True):
            _distribution(panel, _numbers(rows, name), _label(name, units))
        return figure
    figure = style.new_figure(2.2 * len(SHOWN))
    panels = figure.subplots(len(SHOWN), len(keys), squeeze=False, sharex="col", sharey="row")
    for line, name in zip(panels, SHOWN, strict=True):
        for panel, key in zip(line, keys, strict=True):
            _over(panel, rows, key, name)
        style.dress(line[0], y=_label(name, units).replace(", part", ",\npart"))
    for panel, key in zip(panels[-1], keys, strict=True):
        panel.set_xlabel(key, fontsize=style.TEXT_SIZE, color=style.INK)
    return figure


def _numeric_keys(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    values = rows[0]["values"] if rows else {}
    return [
        key
        for key, value in values.items()
        if isinstance(value, Real) and not isinstance(value, bool)
    ]


def _numbers(rows: Sequence[Mapping[str, Any]], name: str) -> np.ndarray:
    found = [row["numbers"].get(name) for row in rows]
    return np.array([np.nan if value is None else value for value in found], dtype=float)


def _label(name: str, units: Mapping[str, str]) -> str:
    return WORDS[name] if units[name] == "1" else f"{WORDS[name]} [{units[name]}]"


def _over(panel: Axes, rows: Sequence[Mapping[str, Any]], key: str, name: str) -> None:
    style.dress(panel)
    x = np.array([float(row["values"][key]) for row in rows])
    y = _numbers(rows, name)
    good = np.array([row["ended"] == "completed" for row in rows])
    for chosen, color, words in ((good, _GOOD, ""), (~good, _BAD, "not completed")):
        panel.plot(x[chosen], y[chosen], "o", color=color, markersize=3.5, alpha=0.7)
        if words and np.any(chosen & np.isfinite(y)):
            at = int(np.flatnonzero(chosen & np.isfinite(y))[0])
            panel.annotate(
                words,
                (x[at], y[at]),
                xytext=(5, 5),
                textcoords="offset points",
                color=style.text_color(color),
                fontsize=style.SMALL,
            )
    if np.all(x > 0.0) and x.max() > 30.0 * x.min():
        panel.set_xscale("log")


def _distribution(panel: Axes, values: np.ndarray, label: str) -> None:
    style.dress(panel, x=label, y="part of the runs")
    values = np.sort(values[np.isfinite(values)])
    panel.set_ylim(0.0, 1.05)
    if not values.size:
        return
    part = np.arange(1, values.size + 1) / values.size
    panel.plot(values, part, color=_GOOD, linewidth=style.LINE)
    largest = values[-1]
    panel.annotate(
        f"largest {largest:.3g}",
        (largest, 1.0),
        xytext=(0, -12),
        textcoords="offset points",
        ha="right",
        va="top",
        color=style.text_color(_GOOD),
        fontsize=style.SMALL,
    )
