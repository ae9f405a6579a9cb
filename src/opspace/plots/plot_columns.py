"""Any columns of any recordings, side by side or over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from opspace.errors import InputError
from opspace.plots import style
from opspace.plots.labels import Line, draw_lines, label_ends, mark_ends
from opspace.plots.style import line_color
from opspace.record import Recording

DEFAULT = ("q", "v", "tau", "tasks")
"""What is drawn of a recording when nothing is asked for, as far as it is there."""

QUANTITIES = {"q": "joint position", "v": "joint velocity", "tau": "joint torque"}

_ROW_HEIGHT = 1.9
_WIDTH_OF_MORE = 3.5
"""Width that each recording beyond the second adds [in]."""
_ABREAST = 3
"""Panels beside each other where recordings are drawn over each other."""
_LINE_WIDTH = 1.4


class Row(NamedTuple):
    """Columns of one unit that share panels.

    Attributes:
        name: Column or group that was asked for.
        unit: Unit of the columns.
        columns: Their names.
    """

    name: str
    unit: str
    columns: tuple[str, ...]

    @property
    def label(self) -> str:
        """What the vertical axis says."""
        if (self.name, self.unit) == ("tau", "N"):
            return "joint force [N]"
        return f"{QUANTITIES.get(self.name, self.name)} [{self.unit}]"

    def lines(self, recording: Recording) -> list[Line]:
        """Return the lines that a recording has, named by what the columns do not have in common."""
        return [
            Line(
                column.removeprefix(f"{self.name}/"), line_color(i), recording.t, recording[column]
            )
            for i, column in enumerate(self.columns)
            if column in recording
        ]


def plot_columns(recordings: Mapping[str, Recording], columns: Sequence[str] = ()) -> Figure:
    """Draw columns over time: a column of panels per recording, a row per quantity.

    Args:
        recordings: Recording by title.
        columns: Names of columns or of groups of columns, such as ``tau`` or ``tool/x``. A group
            of several units gets a row for each. Nothing means positions, velocities, torques and
            tasks.

    Returns:
        The figure; its ``savefig`` writes it.

    Raises:
        InputError: There is nothing to draw.
        UnknownNameError: A recording has no such column or group.
    """
    rows = _rows(recordings, columns)
    width = style.WIDTH + _WIDTH_OF_MORE * max(0, len(recordings) - 2)
    figure = style.new_figure(0.6 + _ROW_HEIGHT * len(rows), width)
    panels = figure.subplots(len(rows), len(recordings), sharex=True, sharey="row", squeeze=False)
    for i, row in enumerate(rows):
        for panel, (title, recording) in zip(panels[i], recordings.items(), strict=True):
            style.dress(panel, title=title if i == 0 else "")
            draw_lines(panel, row.lines(recording), _LINE_WIDTH)
        panels[i, 0].set_ylabel(row.label)
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    _limit_time(panels[0, 0], recordings)
    labels: dict[Axes, list[Line]] = {}
    for i, row in enumerate(rows):
        labels |= _labels(row, dict(zip(panels[i], recordings.values(), strict=True)))
    label_ends(labels)
    return figure


def _labels(row: Row, shown: Mapping[Axes, Recording]) -> dict[Axes, list[Line]]:
    """Say which lines are named where: each once, as far to the right as it is there."""
    named: set[str] = set()
    labels: dict[Axes, list[Line]] = {}
    for panel, recording in reversed(list(shown.items())):
        labels[panel] = [line for line in row.lines(recording) if line.name not in named]
        named |= {line.name for line in labels[panel]}
    return {panel: lines for panel, lines in labels.items() if lines}


def overlay_columns(recordings: Mapping[str, Recording], columns: Sequence[str] = ()) -> Figure:
    """Draw recordings over each other: a panel per column, a line per recording.

    Args:
        recordings: Recording by title.
        columns: See `plot_columns`.

    Returns:
        The figure; its ``savefig`` writes it.

    Raises:
        InputError: There is nothing to draw.
        UnknownNameError: A recording has no such column or group.
    """
    rows = _rows(recordings, columns)
    names = [(name, row.unit) for row in rows for name in row.columns]
    abreast = min(_ABREAST, len(names))
    count = -(-len(names) // abreast)
    figure = style.new_figure(0.6 + _ROW_HEIGHT * count, style.WIDTH + 1.5 * (abreast - 1))
    panels = figure.subplots(count, abreast, sharex=True, squeeze=False).flatten()
    for panel in panels[len(names) :]:
        panel.remove()
    end, labels = max(recording.t[-1] for recording in recordings.values()), {}
    for i, (panel, (name, unit)) in enumerate(zip(panels, names, strict=False)):
        style.dress(panel, title=name, y=f"[{unit}]")
        lines = [
            Line(title, line_color(k), recording.t, recording[name])
            for k, (title, recording) in enumerate(recordings.items())
            if name in recording
        ]
        draw_lines(panel, lines, _LINE_WIDTH)
        mark_ends(panel, [line for line in lines if line.x[-1] < end])
        if i + abreast >= len(names):
            panel.set_xlabel("time [s]")
            panel.tick_params(labelbottom=True)
        labels[panel] = lines
    _limit_time(panels[0], recordings)
    label_ends(labels)
    return figure


def _limit_time(panel: Axes, recordings: Mapping[str, Recording]) -> None:
    times = np.concatenate([recording.t for recording in recordings.values()])
    panel.set_xlim(times.min(), times.max())


def _rows(recordings: Mapping[str, Recording], columns: Sequence[str]) -> list[Row]:
    """Return the rows that are asked for, or those of `DEFAULT` that all recordings have."""
    if not recordings:
        raise InputError("there is no recording to draw")
    first = next(iter(recordings.values()))
    for recording in recordings.values():
        if not len(recording):
            raise InputError(f"{recording.directory} holds no tick to draw")
    if columns:
        return [row for name in columns for row in _rows_of(recordings, name)]
    present = [n for n in DEFAULT if all(n in r.groups for r in recordings.values())]
    if not present:
        raise InputError(f"{first.directory} has none of {', '.join(DEFAULT)}; name its columns")
    # The number of a task's level is no activation, and would flatten those beside it.
    return [
        row._replace(columns=tuple(c for c in row.columns if not c.endswith("/level")))
        for name in present
        for row in _rows_of(recordings, name)
    ]


def _rows_of(recordings: Mapping[str, Recording], name: str) -> list[Row]:
    """Return a row for each unit among the columns of a group, or one for a single column."""
    units: dict[str, str] = {}
    for recording in recordings.values():
        for member in _members(recording, name):
            units.setdefault(member, recording.units[member])
    return [
        Row(name, unit, tuple(m for m in units if units[m] == unit))
        for unit in dict.fromkeys(units.values())
    ]


def _members(recording: Recording, name: str) -> tuple[str, ...]:
    if name in recording:
        return (name,)
    if name not in recording.groups:
        raise recording.no_column(name)
    return recording.members(name)
