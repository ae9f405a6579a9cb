"""A recording as a file of Rerun: a scalar per column, and the way of the tool in space."""

# The present version of Rerun needs Python 3.11, so that a check for 3.10 sees none of its names.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from opspace.errors import missing_extra
from opspace.export.facts import facts
from opspace.export.nanoseconds import nanoseconds
from opspace.record import Column, Recording
from opspace.record.format import parts_of

try:
    import rerun as rr
    import rerun.blueprint as rrb
except ImportError:
    raise missing_extra("rerun-sdk", "export") from None

TIMELINE = "t"
WORLD = "/world"
TOOL = ("tool/x", "tool/y", "tool/z")

_JOINTS = {"q": "joint position", "v": "joint velocity", "tau": "joint torque"}
_COLOR = (0, 68, 136)
_RADIUS = 0.01


def write(recording: Recording, path: Path) -> Iterator[tuple[int, int]]:
    """Write each column as scalars at its name, over the timeline ``t``.

    Args:
        recording: The run.
        path: File to write.

    Yields:
        How many columns are written, and of how many.

    Raises:
        InputError: A time is below zero.
    """
    times = nanoseconds(recording).astype("timedelta64[ns]")
    stream = rr.RecordingStream("opspace", send_properties=False)
    try:
        # Rerun's own way to a file only prints an error where the disk is full.
        memory = stream.binary_stream()
        stream.send_blueprint(_blueprint(recording), make_active=False, make_default=True)
        stream.send_recording_name(recording.directory.resolve().name)
        stream.send_property("opspace", rr.AnyValues(**facts(recording)))
        if all(name in recording for name in TOOL) and len(recording):
            _send_tool(stream, times, np.column_stack([recording[name] for name in TOOL]))
        for done, column in enumerate(recording.columns, 1):
            _send_column(stream, times, column, recording[column.name])
            yield done, len(recording.columns)
        path.write_bytes(memory.read() or b"")
    finally:
        stream.disconnect()


def entity(name: str) -> str:
    """Return the path of a column in Rerun, where some signs need a backslash."""
    return "/" + "/".join(rr.escape_entity_path_part(part) for part in parts_of(name))


def _send_column(
    stream: rr.RecordingStream, times: np.ndarray, column: Column, values: np.ndarray
) -> None:
    # Legends name the last part only, which is not enough for the rows of several tasks.
    lines = rr.SeriesLines(names=f"{column.name} [{column.unit}]")
    about = rr.AnyValues(unit=column.unit, description=column.description or column.name)
    stream.log(entity(column.name), lines, about, static=True, strict=True)
    _send(stream, entity(column.name), times, rr.Scalars.columns(scalars=values))


def _send_tool(stream: rr.RecordingStream, times: np.ndarray, tool: np.ndarray) -> None:
    stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True, strict=True)
    whole = rr.LineStrips3D([tool[np.isfinite(tool).all(axis=1)]], colors=[_COLOR])
    stream.log(f"{WORLD}/path", whole, static=True, strict=True)
    look = rr.Points3D.from_fields(colors=[_COLOR], radii=[_RADIUS])
    stream.log(f"{WORLD}/tool", look, static=True, strict=True)
    _send(stream, f"{WORLD}/tool", times, rr.Points3D.columns(positions=tool))


def _send(stream: rr.RecordingStream, path: str, times: np.ndarray, columns: Any) -> None:
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=times)], columns, strict=True)


def _blueprint(recording: Recording) -> rrb.Blueprint:
    """Show the tool in space beside positions, velocities, torques, activations and errors."""
    plots = [
        rrb.TimeSeriesView(name=title, contents=[f"+ {entity(column.name)}" for column in columns])
        for title, columns in _plots(recording).items()
    ]
    views: list[Any] = [rrb.Vertical(*plots)] if plots else []
    if all(name in recording for name in TOOL):
        views.insert(0, rrb.Spatial3DView(name="tool", origin=WORLD))
    return rrb.Blueprint(rrb.Horizontal(*views), collapse_panels=True)


def _plots(recording: Recording) -> dict[str, list[Column]]:
    """Return the columns of each plot by its title; what slides is not in one with what turns."""
    plots: dict[str, list[Column]] = {}
    for column in recording.columns:
        group, *inner = parts_of(column.name)
        if group in _JOINTS and inner:
            title = f"{_JOINTS[group]} [{column.unit}]"
        elif group == "tasks":
            title = "activation of tasks" if inner[-1:] == ["activation"] else "error of tasks"
        else:
            continue
        plots.setdefault(title, []).append(column)
    return plots
