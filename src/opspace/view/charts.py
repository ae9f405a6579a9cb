"""Torques and singular values over the last seconds, as charts that scroll."""

from __future__ import annotations

import numpy as np
import viser
from viser import uplot

from opspace.view.frame import FrameReader
from opspace.view.panels import short

SECONDS = 8.0
"""How much of the past the charts show."""

POINTS = 240
HEIGHT = 210

# Paul Tol's muted scheme, as in the figures.
COLORS = (
    "#332288", "#44AA99", "#CC6677", "#999933", "#66B5E0", "#882255", "#117733", "#CBB34D", "#AA4499",
)  # fmt: skip


class Chart:
    """Columns over time.

    Args:
        server: The server of the page.
        reader: Where the numbers come from.
        title: What the chart shows, with its unit.
        columns: Names of columns by the label of their line, which shows the smallest of them.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        reader: FrameReader,
        title: str,
        columns: dict[str, list[str]],
    ) -> None:
        self._reader = reader
        self._columns = [name for names in columns.values() for name in names]
        self._starts = np.cumsum([0, *(len(names) for names in columns.values())])[:-1]
        series = [uplot.Series(label="time [s]")]
        for i, label in enumerate(columns):
            color = COLORS[i % len(COLORS)]
            series.append(uplot.Series(label=label, stroke=color, width=1.5))
        self._handle = server.gui.add_uplot(
            data=self._data(0),
            series=tuple(series),
            title=title,
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=True)},
            legend=uplot.Legend(show=True, live=False),
            height=HEIGHT,
            # Room for the topmost number beside the axis.
            padding=(14, 18, 0, 0),
        )

    def show(self, row: int) -> None:
        """Show the time before a tick."""
        self._handle.data = self._data(row)

    def _data(self, row: int) -> tuple[np.ndarray, ...]:
        history = self._reader.history(row, SECONDS, POINTS, self._columns)
        # What is not there is nan: this minimum passes over it, and a line of nan would hide all others.
        lines = np.nan_to_num(np.fmin.reduceat(history[:, 1:], self._starts, axis=1))
        return (history[:, 0].copy(), *lines.T.copy())


def torque_columns(reader: FrameReader) -> dict[str, list[str]]:
    """List the torques by the name of the joint."""
    return {short(name, reader.joints): [f"tau/{name}"] for name in reader.joints}


def sigma_columns(reader: FrameReader) -> dict[str, list[str]]:
    """List the singular values of every level."""
    return {
        f"level {level.number:g}": reader.recording.group(f"levels/{level.number:g}/sigma")
        for level in reader.at(0).levels
    }
