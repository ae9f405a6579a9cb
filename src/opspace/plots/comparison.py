"""Ways to change tasks side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from opspace.plots import style
from opspace.plots.labels import number

_PANELS = {
    "torque_step": "largest torque step\nper tick [N·m]",
    "jerk": "largest rate of the\nacceleration [rad/s³]",
    "error_inside": "RMS error of the top level\nduring changes [m, rad]",
}
_OWN, _OTHER = style.VARIANT_COLORS["transition"], style.FAINT
_SMALLEST = 1e-9


def comparison_figure(rows: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw three measures of every method, on logarithmic scales.

    Args:
        rows: Measures by name of the method, as `opspace.compare.Measures` names them.

    Returns:
        One panel per measure; a method whose run was given up says so.
    """
    figure = style.new_figure(1.0 + 0.34 * len(rows))
    panels = figure.subplots(1, len(_PANELS), sharey=True, squeeze=False)[0]
    names = list(rows)
    for panel, (key, title) in zip(panels, _PANELS.items(), strict=True):
        style.dress(panel, x=title)
        panel.set_xscale("log")
        panel.grid(visible=False, axis="y")
        values = [max(rows[name][key] or 0.0, _SMALLEST) for name in names]
        colors = [_OWN if name in {"opspace", "chain"} else _OTHER for name in names]
        shown = [value for value in values if value > _SMALLEST] or [1.0]
        left, right = 0.3 * min(shown), max(shown)
        panel.set_xlim(left, right * (right / left) ** 0.45)
        panel.barh(names, values, left=0.0, color=colors, height=0.62)
        for place, name in enumerate(names):
            value = rows[name][key]
            text = "-" if value is None else number(value)
            if not rows[name]["completed"]:
                text += f" (to {rows[name]['stopped_at']:.1f} s)"
            panel.text(
                max(values[place], left), place, f" {text}", va="center", fontsize=style.SMALL
            )
    panels[0].invert_yaxis()
    return figure
