"""A recording as MCAP with messages in JSON, which Foxglove and PlotJuggler read."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from opspace.errors import InputError, missing_extra
from opspace.export.facts import facts
from opspace.export.nanoseconds import nanoseconds
from opspace.record import Column, Recording
from opspace.record.format import parts_of

try:
    from mcap.well_known import MessageEncoding, SchemaEncoding
    from mcap.writer import Writer
except ImportError:
    raise missing_extra("mcap", "export") from None

OF_GROUPS = ("tasks", "levels", "true")
"""Groups that hold groups; each of these is a topic of its own."""

ALONE = "tick"
"""Topic of the columns that are in no group."""

_ROWS_AT_ONCE = 500


class MessageField(NamedTuple):
    """A column in the messages of a topic.

    Attributes:
        keys: Where it lies in a message, from the outside to the inside.
        number: Which column of the recording it is.
    """

    keys: tuple[str, ...]
    number: int


def write(recording: Recording, path: Path) -> Iterator[tuple[int, int]]:
    """Write a topic per group of columns, and a message per row and topic.

    JSON has no number that is not finite: those are left out of their message, which the schemas
    allow, since no field is required.

    Args:
        recording: The run.
        path: File to write.

    Yields:
        How many rows are written, and of how many.

    Raises:
        InputError: A time is below zero, or a column has the name of a group.
    """
    times = nanoseconds(recording).tolist()
    topics = topics_of(recording.columns)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="opspace")
        channels = {
            topic: _channel(writer, topic, fields, recording.columns)
            for topic, fields in topics.items()
        }
        writer.add_metadata("recording", facts(recording))
        for row, (time, values) in enumerate(zip(times, recording.data, strict=True)):
            numbers = values.tolist()
            for topic, fields in topics.items():
                data = json.dumps(_message(fields, numbers), ensure_ascii=False).encode()
                writer.add_message(channels[topic], time, data, time, row)
            if row % _ROWS_AT_ONCE == 0:
                yield row, len(recording)
        writer.finish()
    yield len(recording), len(recording)


def topics_of(columns: Sequence[Column]) -> dict[str, list[MessageField]]:
    """Sort columns into topics.

    Args:
        columns: The columns of a recording.

    Returns:
        By topic, such as ``/tau`` or ``/tasks/position``, its fields.
    """
    topics: dict[str, list[MessageField]] = {}
    for number, column in enumerate(columns):
        parts = parts_of(column.name)
        parts = parts if len(parts) > 1 else (ALONE, column.name)
        depth = 2 if parts[0] in OF_GROUPS and len(parts) > 2 else 1
        fields = topics.setdefault("/" + "/".join(parts[:depth]), [])
        fields.append(MessageField(parts[depth:], number))
    return topics


def _channel(
    writer: Writer, topic: str, fields: Sequence[MessageField], columns: Sequence[Column]
) -> int:
    name = "opspace." + topic[1:].replace("/", ".")
    described = json.dumps(_schema(name, fields, columns), ensure_ascii=False).encode()
    schema = writer.register_schema(name, SchemaEncoding.JSONSchema, described)
    return writer.register_channel(topic, MessageEncoding.JSON, schema)


def _schema(name: str, fields: Sequence[MessageField], columns: Sequence[Column]) -> dict[str, Any]:
    """Describe the messages of a topic; every field says its unit."""
    schema = {"title": name, "type": "object", "properties": {}}
    for keys, number in fields:
        column, place = columns[number], schema
        for key in keys[:-1]:
            place = place["properties"].setdefault(key, {"type": "object", "properties": {}})
            if place["type"] != "object":
                raise _clash(column)
        if keys[-1] in place["properties"]:
            raise _clash(column)
        place["properties"][keys[-1]] = {
            "title": column.name,
            "type": "number",
            "description": f"{column.description or column.name} [{column.unit}]",
        }
    return schema


def _clash(column: Column) -> InputError:
    return InputError(f"column {column.name!r} cannot be told from a group in JSON")


def _message(fields: Sequence[MessageField], row: Sequence[float]) -> dict[str, Any]:
    message: dict[str, Any] = {}
    for keys, number in fields:
        value = row[number]
        if math.isfinite(value):
            place = message
            for key in keys[:-1]:
                place = place.setdefault(key, {})
            place[keys[-1]] = value
    return message
