"""Measured wrenches and what force tasks made of them, in the rows of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from opspace.record.format import Column
from opspace.record.reader import Recording
from opspace.tasks import ForceTask, Task

GROUP = "wrench"
PARTS = {"x": "N", "y": "N", "z": "N", "rx": "N·m", "ry": "N·m", "rz": "N·m"}
"""Parts of a wrench in world axes, and their units."""

Given: TypeAlias = Mapping[str, "np.ndarray | None"]
"""Wrenches of a tick by name of the frame, as a controller has been given them."""

RECENT = 10
"""A wrench that none of so many ticks has brought is not shown any more."""

_NOTHING = np.full(len(PARTS), np.nan)


def sensors_of(tasks: Sequence[Task]) -> tuple[str, ...]:
    """List the frames whose wrenches some prepared tasks need."""
    return tuple(dict.fromkeys(task.sensor for task in tasks if isinstance(task, ForceTask)))


def subject_of_touch(task: ForceTask) -> dict[str, Any]:
    """Describe where and with what a force task presses in JSON's own types."""
    source = task.source
    return {
        "sensor": task.sensor,
        "offset": None if source.offset is None else source.offset.tolist(),
        "selection": task.selection.tolist(),
        "in_tool_axes": task.in_tool_axes,
        "force": task.force.tolist(),
        "least": task.thresholds[1],
    }


def columns_of_wrenches(sensors: Sequence[str]) -> list[Column]:
    """List the columns of wrenches; rows hold NaN where nothing new was measured."""
    return [
        Column(f"{GROUP}/{sensor}/{part}", unit, f"wrench on the environment at {sensor}, {part}")
        for sensor in sensors
        for part, unit in PARTS.items()
    ]


def columns_of_touches(tasks: Sequence[Task]) -> list[Column]:
    """List the columns of what force tasks know of their contacts."""
    columns: list[Column] = []
    for task in tasks:
        if not isinstance(task, ForceTask):
            continue
        where = f"touch/{task.name}"
        columns.append(
            Column(f"{where}/confidence", "1", f"how sure {task.name} is of its contact")
        )
        for what, words in (("measured", "filtered"), ("commanded", "with feedback")):
            columns += [
                Column(f"{where}/{what}/{i}", unit, f"row {i}: {what} on the environment, {words}")
                for i, unit in enumerate(task.error_units)
            ]
    return columns


def row_of_wrenches(given: Given, sensors: Sequence[str]) -> list[np.ndarray]:
    """Give the numbers of one tick for `columns_of_wrenches`."""
    found = [given.get(sensor) for sensor in sensors]
    return [_NOTHING if wrench is None else wrench for wrench in found]


def row_of_touches(tasks: Sequence[Task]) -> list[np.ndarray]:
    """Give the numbers of one tick for `columns_of_touches`."""
    parts: list[np.ndarray] = []
    for task in tasks:
        if isinstance(task, ForceTask):
            touch = task.touch
            if touch is None:
                parts.append(np.full(1 + 2 * task.rows, np.nan))
            else:
                parts += [np.array([touch.confidence]), touch.measured, touch.commanded]
    return parts


def touched(header: Mapping[str, Any]) -> list[dict[str, Any]]:
    """List what the tool may touch, where a recording's scenario says so: surfaces and holes."""
    plant = header.get("scenario", {}).get("plant", {})
    return [*plant.get("surfaces", ()), *plant.get("holes", ())]


def latest(wrenches: np.ndarray, row: int) -> np.ndarray:
    """Give what was measured last up to a tick; NaN where `RECENT` ticks have brought nothing.

    Args:
        wrenches: (ticks, k) NaN where nothing new was measured.
        row: The tick.
    """
    recent = wrenches[max(row + 1 - RECENT, 0) : row + 1]
    known = recent[~np.isnan(recent).any(axis=1)]
    return known[-1] if len(known) else np.full(wrenches.shape[1], np.nan)


def recorded_wrenches(recording: Recording) -> list[Given | None]:
    """Read back what the controller was given in every tick; None where it needs no wrench."""
    names = [column.name for column in recording.columns if column.name.startswith(f"{GROUP}/")]
    sensors = tuple(
        dict.fromkeys(name.rsplit("/", 1)[0].removeprefix(f"{GROUP}/") for name in names)
    )
    if not sensors:
        return [None] * len(recording)
    by_sensor = {sensor: recording.group(f"{GROUP}/{sensor}") for sensor in sensors}
    return [
        {s: None if np.any(np.isnan(w[i])) else w[i] for s, w in by_sensor.items()}
        for i in range(len(recording))
    ]
