"""Cost of a tick by scene and by the number of transitions."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.plots import style
from opspace.plots.labels import number

Times = Mapping[str, Mapping[str, Mapping[str, float]]]

_OWN = style.VARIANT_COLORS["transition"]
_COLORS = {"opspace": _OWN, "model calls alone": style.GRID, "placo": style.FAINT}
_BLENDINGS = {"chain": _OWN, "idv": style.VARIANT_COLORS["switch"]}


def benchmark_figure(scenes: Times) -> Figure:
    """Draw medians: every scene with its peers, and the cost of transitions.

    Args:
        scenes: By scene and subject the times in µs, as `opspace.bench.Benchmark` has them.

    Returns:
        The figure.
    """
    steps = {name: times for name, times in scenes.items() if _transitions(name) is not None}
    others = {name: times for name, times in scenes.items() if name not in steps}
    figure = style.new_figure(max(3.2, 0.8 + 0.55 * len(others)))
    wide = [panel for panel in (others, steps) if panel]
    panels = figure.subplots(1, len(wide), squeeze=False)[0]
    for panel, content in zip(panels, wide, strict=True):
        if content is others:
            _bars(panel, others)
        else:
            _lines(panel, steps)
    return figure


def _bars(panel: Axes, scenes: Times) -> None:
    style.dress(panel, x="time per tick, median [µs]")
    panel.grid(visible=False, axis="y")
    row, places, names = 0.0, [], []
    for name, times in scenes.items():
        start = row
        for subject, found in times.items():
            panel.barh(row, found["p50"], height=0.8, color=_COLORS.get(subject, style.GRID))
            text = f" {number(found['p50'])}  {subject}"
            panel.text(found["p50"], row, text, va="center", fontsize=style.SMALL)
            row += 1.0
        places.append(0.5 * (start + row - 1.0))
        names.append(name)
        row += 0.7
    panel.set_yticks(places, names)
    panel.invert_yaxis()
    longest = max(found["p50"] for times in scenes.values() for found in times.values())
    shortest = min(found["p50"] for times in scenes.values() for found in times.values())
    if longest > 30.0 * shortest:
        panel.set_xscale("log")
        panel.set_xlim(0.5 * shortest, longest * (longest / shortest) ** 0.5)
    else:
        panel.set_xlim(0.0, 1.75 * longest)


def _lines(panel: Axes, scenes: Times) -> None:
    style.dress(panel, x="tasks on their way at once", y="time per tick, median [µs]")
    for blending, color in _BLENDINGS.items():
        points = sorted(
            (found[1], times["opspace"]["p50"])
            for name, times in scenes.items()
            if (found := _transitions(name)) is not None and (found[0] == blending or found[1] == 0)
        )
        if len(points) > 1:
            x, y = zip(*points, strict=True)
            panel.plot(x, y, color=color, marker="o", markersize=4)
            panel.text(x[-1], y[-1], f"  {blending}", color=color, va="center")
    panel.set_ylim(bottom=0.0)
    panel.margins(x=0.18)


def _transitions(name: str) -> tuple[str, int] | None:
    """Blending and number of transitions of a scene such as ``chain-4``."""
    blending, _, count = name.rpartition("-")
    return (blending, int(count)) if blending in _BLENDINGS and count.isdigit() else None
