"""Any columns of any recordings, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from opspace.errors import InputError
from opspace.plots import style
from opspace.plots.labels import Line, draw_lines, label_ends
from opspace.plots.style import line_color
from opspace.record import Recording

DEFAULT = ("q", "v", "tau", "tasks")
"""What is drawn of a recording when nothing is asked for, as far as it is there."""

QUANTITIES = {"q": "joint position", "v": "joint velocity", "tau": "joint torque"}

_ROW_HEIGHT = 1.9


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
        return f"{QUANTITIES.get(self.name, self.name)} [{self.unit}]"

    def lines(self, recording: Recording) -> list[Line]:
        """Return the lines of a recording, named by what the columns do not have in common."""
        return [
            Line(
                column.removeprefix(f"{self.name}/"), line_color(i), recording.t, recording[column]
            )
            for i, column in enumerate(self.columns)
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
    first = next(iter(recordings.values()), None)
    if first is None:
        raise InputError("there is no recording to draw")
    present = [name for name in DEFAULT if any(n.startswith(f"{name}/") for n in first.names)]
    rows = [row for name in columns or present for row in _rows(first, name)]
    if not rows:
        raise InputError(f"{first.directory} has none of {', '.join(DEFAULT)}; name its columns")
    figure = style.new_figure(0.6 + _ROW_HEIGHT * len(rows))
    panels = figure.subplots(len(rows), len(recordings), sharex=True, sharey="row", squeeze=False)
    for i, row in enumerate(rows):
        for panel, (title, recording) in zip(panels[i], recordings.items(), strict=True):
            style.dress(panel, title=title if i == 0 else "")
            draw_lines(panel, row.lines(recording), 1.4)
        panels[i, 0].set_ylabel(row.label)
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    times = np.concatenate([recording.t for recording in recordings.values()])
    panels[0, 0].set_xlim(times.min(), times.max())
    last = list(recordings.values())[-1]
    label_ends({panels[i, -1]: row.lines(last) for i, row in enumerate(rows)})
    return figure


def _rows(recording: Recording, name: str) -> list[Row]:
    """Return a row for each unit among the columns of a group, or one for a single column."""
    if name in recording:
        return [Row(name, recording.units[name], (name,))]
    members = recording.members(name)
    units = dict.fromkeys(recording.units[member] for member in members)
    return [
        Row(name, unit, tuple(m for m in members if recording.units[m] == unit)) for unit in units
    ]
