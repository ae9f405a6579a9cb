"""Tables for a person."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from opspace.record import Recording
from opspace.robots.joint_units import effort_unit
from opspace.runs.check import JointReport, rounded
from opspace.runs.event_times import began
from opspace.runs.metrics import UNITS, Metrics, largest_torque_step, units_of
from opspace.scenario.events import Event, in_order


def metrics_table(
    runs: Mapping[str, Metrics], units: Mapping[str, str] = UNITS
) -> tuple[list[str], list[list[str]]]:
    """Write metrics, one column per run.

    Args:
        runs: Metrics by name of the run.
        units: Their units, see `units_of`.

    Returns:
        Heads and rows; numbers that no run has are left out.
    """
    numbers = {name: metrics.to_json() for name, metrics in runs.items()}
    rows = []
    for key, unit in units.items():
        values = [found[key] for found in numbers.values()]
        if any(value is not None for value in values):
            rows.append(
                [key.replace("_", " "), *map(_written, values), "" if unit == "1" else unit]
            )
    return ["", *numbers, "unit"], rows


def timeline_table(
    events: Sequence[Event], recording: Recording
) -> tuple[list[str], list[list[str]]]:
    """Write what happened to the stack and what it did to the torque, in order of time.

    Args:
        events: The events of the scenario.
        recording: The run.

    Returns:
        Heads with units, and rows; the torque step is the largest of any joint between two ticks
        from the beginning of the event to its end. An event that waited for what did not happen has
        no times.
    """
    unit = units_of(recording)["max_torque_step"]
    heads = ["from [s]", "to [s]", "event", "level", f"largest torque step [{unit}]"]
    rows = []
    for _, event in in_order(events):
        what = f"{event.kind} {', '.join(event.tasks)}"
        level = "-" if event.level is None else f"{event.level:g}"
        start = began(event, recording)
        if start is None:
            rows.append(["-", "-", what, level, "-"])
            continue
        end = start + event.duration
        step = largest_torque_step(recording, start, end)
        rows.append([f"{start:.3f}", f"{end:.3f}", what, level, _written(step)])
    return heads, rows


def joints_table(joints: Sequence[JointReport]) -> tuple[list[str], list[list[str]]]:
    """Write what is known of joints, one row each.

    Args:
        joints: The joints.

    Returns:
        Heads with units, and rows.
    """
    units = list(dict.fromkeys(j.unit for j in joints)) or ["rad"]

    def measured(what: str, wanted: Callable[[str], str]) -> str:
        return f"{what} [{', '.join(map(wanted, units))}]"

    heads = [
        "joint",
        *(measured(what, str) for what in ("reference", "lower", "upper")),
        measured("speed", "{}/s".format),
        *(measured(what, effort_unit) for what in ("torque", "gravity")),
        measured("brake", "{}/s²".format),
    ]
    rows = []
    for j in joints:
        numbers = (j.reference, j.lower, j.upper, j.max_velocity)
        loads = (j.gravity, j.brake)
        # Where slides stand among hinges, a row says which of the units is its own.
        name = j.name if len(units) == 1 else f"{j.name} [{j.unit}]"
        rows.append([name, *map(_written, numbers), _given(j), *map(_written, loads)])
    return heads, rows


def _given(joint: JointReport) -> str:
    """Write what a motor gives, with both ends where they differ."""
    least, most = joint.least_torque, joint.most_torque
    if least is None or most is None or -least == most:
        return _written(joint.max_torque)
    return f"{_written(least)} to {_written(most)}"


def _written(value: bool | float | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return rounded(value)
