"""Names written where the lines are, instead of in a legend box."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from scipy.optimize import isotonic_regression

from opspace.plots.style import SMALL, TEXT_SIZE, text_color

LINE_HEIGHT = 1.25
"""Distance of two lines of text, in font sizes."""

TIE = 0.2
"""Lines that end closer than this, in lines of text, count as ending together."""

_POINTS_PER_INCH = 72.0


class Line(NamedTuple):
    """A line that wants a name.

    Attributes:
        name: Its name.
        color: Its colour.
        x: (T,) horizontal values.
        y: (T,) vertical values.
    """

    name: str
    color: str
    x: np.ndarray
    y: np.ndarray


def draw_lines(axes: Axes, lines: Sequence[Line], width: float = 1.6) -> None:
    """Draw lines, earlier ones above later ones.

    Args:
        axes: Panel to draw in.
        lines: The lines.
        width: Line width in points.
    """
    for i, line in enumerate(lines):
        axes.plot(line.x, line.y, color=line.color, linewidth=width, zorder=3.0 - 0.01 * i)


def mark_ends(axes: Axes, lines: Sequence[Line]) -> None:
    """Mark the last point of lines that end early.

    Args:
        axes: Panel that shows the lines.
        lines: The lines.
    """
    for line in lines:
        axes.plot(line.x[-1:], line.y[-1:], "x", color=line.color, markersize=6, zorder=4)


def label_ends(panels: Mapping[Axes, Sequence[Line]], size: float = SMALL) -> None:
    """Write the names of lines at their right ends, moved apart where they would overlap.

    To be called when everything else is drawn, since it needs the heights of the panels. Where
    there are more lines than fit, those that move most get a name.

    Args:
        panels: The lines of each panel; the panels are of one figure.
        size: Font size in points.
    """
    for axes, height in zip(panels, _heights(list(panels)), strict=True):
        _label_panel(axes, panels[axes], size, height)


def _label_panel(axes: Axes, lines: Sequence[Line], size: float, height: float) -> None:
    ended = [line for line in lines if np.isfinite(line.y).any()]
    if not ended:
        return
    gap = size * LINE_HEIGHT
    room = max(int(height / gap), 1)
    chosen = sorted(sorted(range(len(ended)), key=lambda i: -_range(ended[i]))[:room])
    ends = {i: _end(axes, ended[i], height) for i in chosen}
    # Lines that end together are named from top to bottom in the order in which they were given.
    chosen.sort(key=lambda i: (round(ends[i][1] / (TIE * gap)), -i))
    wanted = np.maximum.accumulate([ends[i][1] for i in chosen])
    right = max(x for x, _ in ends.values())
    for i, y in zip(chosen, spread(wanted, gap, 0.5 * gap, height - 0.5 * gap), strict=True):
        axes.annotate(
            ended[i].name,
            (right, y / height),
            xycoords="axes fraction",
            xytext=(5.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=size,
            color=text_color(ended[i].color),
            annotation_clip=False,
        )


def spread(wanted: np.ndarray, gap: float, low: float, high: float) -> np.ndarray:
    """Move sorted places at least ``gap`` apart, as little as possible in the squared sense.

    Args:
        wanted: (k,) places, rising up to the order that is to be kept.
        gap: Least distance of two neighbours.
        low: Lowest place.
        high: Highest place.

    Returns:
        (k,) places; below ``low`` only where all of them do not fit.
    """
    steps = gap * np.arange(len(wanted))
    places = np.asarray(isotonic_regression(wanted - steps).x)
    # Clipping an isotonic fit gives the bounded one.
    return np.clip(places, min(low, high - steps[-1]), high - steps[-1]) + steps


def number(value: float) -> str:
    """Write a number with two digits that count and without an exponent."""
    if not (np.isfinite(value) and value):
        return f"{value:g}"
    rounded = float(f"{value:.1e}")
    return f"{rounded:.{max(1 - int(np.floor(np.log10(abs(rounded)))), 0)}f}"


def key_row(figure: Figure, entries: Iterable[tuple[str, str]]) -> None:
    """Write what the colours mean in one row above all panels.

    Args:
        figure: The figure.
        entries: Name and colour, from left to right.
    """
    samples = {name: Line2D([], [], color=color, linewidth=3.0) for name, color in entries}
    row = figure.legend(
        samples.values(),
        samples.keys(),
        loc="outside upper left",
        ncols=len(samples),
        frameon=False,
        fontsize=TEXT_SIZE,
        handlelength=1.2,
        columnspacing=2.0,
    )
    for text, sample in zip(row.get_texts(), samples.values(), strict=True):
        text.set_color(text_color(str(sample.get_color())))


def _heights(panels: Sequence[Axes]) -> list[float]:
    """Lay their figure out and return the heights of panels in points."""
    if not panels:
        return []
    figure = panels[0].figure
    while isinstance(figure, SubFigure):
        figure = figure.figure
    figure.draw_without_rendering()
    return [p.get_window_extent().height * _POINTS_PER_INCH / figure.dpi for p in panels]


def _range(line: Line) -> float:
    return float(np.nanmax(line.y) - np.nanmin(line.y))


def _end(axes: Axes, line: Line, height: float) -> tuple[float, float]:
    """Return where a line ends: fraction of the width, and height in points within the panel."""
    last = np.flatnonzero(np.isfinite(line.y))[-1]
    x, y = axes.transLimits.transform(axes.transScale.transform((line.x[last], line.y[last])))
    return float(x), float(np.clip(y, 0.0, 1.0)) * height
