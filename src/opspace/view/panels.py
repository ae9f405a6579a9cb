"""What the page writes beside the robot: tasks by level, joints and their limits, as HTML."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from opspace.command import Status
from opspace.robots.joint_units import effort_unit
from opspace.view.frame import Frame, LevelFrame, TaskFrame

ACTIVE, FADED, GONE = "#004488", "#BB5566", "#c4c4c4"
"""Colours of what is fully active, of what is fading, and of what is not there."""

_INK, _FAINT = "inherit", "#8c8c8c"
_ROW = "display:flex;align-items:center;gap:8px;margin:3px 0;font-size:13px;line-height:18px"
_NAME = "flex:0 0 38%;overflow:hidden;text-overflow:ellipsis;white-space:nowrap"
_NUMBER = "flex:0 0 44px;text-align:right;font-variant-numeric:tabular-nums"


def blend_color(activation: float) -> str:
    """Return the colour of something with this activation, from fading (0) to active (1)."""
    return "#" + "".join(f"{part:02x}" for part in blend_rgb(activation))


def blend_rgb(activation: float) -> tuple[int, int, int]:
    """Return the same colour as red, green and blue, 0 to 255."""
    h = 0.0 if math.isnan(activation) else min(max(activation, 0.0), 1.0)
    low, high = (
        np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) for color in (FADED, ACTIVE)
    )
    red, green, blue = (low + h * (high - low)).round().astype(int).tolist()
    return red, green, blue


def head(frame: Frame, note: str) -> str:
    """Say the time, what happens, and how the run goes.

    Args:
        frame: The tick shown.
        note: A few words about the run, such as "paused".
    """
    status = Status(frame.status)
    what = ", ".join(str(flag.name) for flag in Status if flag and flag in status) or "OK"
    return (
        f'<div style="font-size:13px;line-height:20px;padding:2px 12px">'
        f'<b style="font-size:16px;font-variant-numeric:tabular-nums">{frame.t:.2f} s</b>'
        f' <span style="color:{_FAINT}">{escape(note)}</span>'
        f'<div data-opspace="status">{escape(what.replace("_", " ").lower())}</div></div>'
    )


def tasks(frame: Frame) -> str:
    """Draw every task as a bar of its activation, under the level where it is."""
    present = [task for task in frame.tasks if task.present]
    absent = [task for task in frame.tasks if not task.present]
    entries: list[tuple[float, int, str]] = [
        (level.number, 0, _level(level)) for level in frame.levels if _used(level, present)
    ]
    entries += [(task.level, 1, _task(task)) for task in present]
    rows = [text for _, _, text in sorted(entries, key=lambda entry: entry[:2])]
    if absent:
        rows.append(_title("not in the stack"))
        rows += [_task(task) for task in absent]
    return _panel(rows)


def contacts(frame: Frame) -> str:
    """Draw every contact as a bar of its progress, with its normal force and the use of its cone."""
    if not frame.contacts:
        return ""
    rows = [_title("contacts", "planned, measured, use of the cone")]
    for contact in frame.contacts:
        there = not math.isnan(contact.progress)
        s = contact.progress if there else 0.0
        name, ink = escape(contact.name), _INK if there else _FAINT
        planned, measured = (
            "–" if np.isnan(force).any() else f"{np.linalg.norm(force):.0f} N"
            for force in (contact.force, contact.measured)
        )
        use = f"{contact.cone_use:.0%}" if there else "–"
        rows.append(
            f'<div style="{_ROW};color:{ink}" data-opspace-contact="{name}" data-opspace-s="{s:.3f}">'
            f'<span style="{_NAME};flex-basis:24%" title="{name}">{name}</span>'
            '<span style="flex:1;height:10px;border-radius:3px;background:rgba(140,140,140,0.22)">'
            f'<span style="display:block;height:10px;border-radius:3px;'
            f"background:{ACTIVE if s >= 1.0 else blend_color(0.5 + 0.5 * s)};"
            f'width:{100.0 * s:.1f}%"></span></span>'
            + "".join(f'<span style="{_NUMBER}">{one}</span>' for one in (planned, measured, use))
            + "</div>"
        )
    return _panel(rows)


def joints(frame: Frame, names: Sequence[str], robot: Mapping[str, Any]) -> str:
    """Draw every joint in its range with the zones where its limits act, and its torque.

    Args:
        frame: The tick shown.
        names: Names of the joints.
        robot: What the recording says about the robot.
    """
    rows = [
        f'<div style="{_ROW};color:{_FAINT}"><span style="{_NAME}">joint</span>'
        '<span style="flex:1">position in its range</span>'
        '<span style="flex:0 0 64px">torque</span></div>'
    ]
    free = len(frame.q) - len(names)
    units = robot.get("units") or ["rad"] * len(names)
    for i, name in enumerate(names):
        lower, upper = robot["lower"][i], robot["upper"][i]
        place = frame.q[i + free] if free == 0 or i >= 6 else math.nan
        gauge = _range(frame, name, i, float(place), lower, upper, robot)
        unit = effort_unit(units[i])
        tau = float(frame.tau[i])
        torque = _torque(tau, _most(tau, i, robot), unit)
        label = f'<span style="{_NAME}" title="{escape(name)}">{escape(short(name, names))}</span>'
        rows.append(f'<div style="{_ROW}">{label}{gauge}{torque}</div>')
    return _panel(rows)


def short(name: str, names: Sequence[str]) -> str:
    """Return a joint's name without what all joints' names begin with."""
    first, last = min(names), max(names)
    common = next((i for i, c in enumerate(first) if i >= len(last) or c != last[i]), len(first))
    cut = max(first[:common].rfind("_") + 1, 0)
    return name[cut:] or name


def _used(level: LevelFrame, present: Sequence[TaskFrame]) -> bool:
    there = any(task.level == level.number for task in present)
    return there or not bool(np.isnan(level.activation).all())


def _level(level: LevelFrame) -> str:
    known = [h for h in level.activation.tolist() if not math.isnan(h)]
    marks = "".join(
        f'<span title="direction {k + 1}: activation {h:.2f}" style="display:inline-block;'
        f"width:9px;height:9px;border-radius:2px;margin-left:3px;background:{blend_color(h)};"
        f'opacity:{0.25 + 0.75 * max(h, 0.35):.2f}"></span>'
        for k, h in enumerate(known)
    )
    return _title(f"level {level.number:g}", marks)


def _title(text: str, marks: str = "") -> str:
    return (
        '<div style="display:flex;align-items:center;justify-content:space-between;'
        f'margin-top:8px;font-size:12px;color:{_FAINT}"><span>{escape(text)}</span>'
        f"<span>{marks}</span></div>"
    )


def _task(task: TaskFrame) -> str:
    h = task.activation if task.present else 0.0
    color = ACTIVE if h >= 1.0 else blend_color(0.5 + 0.5 * h)
    number = f"{h:.2f}" if task.present else "–"
    ink = _INK if task.present else _FAINT
    name = escape(task.name)
    return (
        f'<div style="{_ROW};color:{ink}" data-opspace-task="{name}" data-opspace-h="{h:.3f}">'
        f'<span style="{_NAME}" title="{name}">{name}</span>'
        '<span style="flex:1;height:10px;border-radius:3px;background:rgba(140,140,140,0.22)">'
        f'<span style="display:block;height:10px;border-radius:3px;background:{color};'
        f'width:{100.0 * h:.1f}%"></span></span>'
        f'<span style="{_NUMBER}">{number}</span></div>'
    )


def _range(
    frame: Frame,
    name: str,
    index: int,
    place: float,
    lower: float | None,
    upper: float | None,
    robot: Mapping[str, Any],
) -> str:
    if lower is None or upper is None or not upper > lower or math.isnan(place):
        shown = "" if math.isnan(place) else f"{place:.2f}, no limits"
        return f'<span style="flex:1;color:{_FAINT}">{shown}</span>'
    span = upper - lower
    zones = ""
    for side, sign in (("lower", -1.0), ("upper", 1.0)):
        h = frame.limits.get(f"{name}/{side}", 0.0)
        width = _zone(robot, f"{name}/{side}", sign * float(frame.v[index]), span)
        edge = "left:0" if side == "lower" else "right:0"
        zones += (
            f'<span style="position:absolute;{edge};top:0;bottom:0;width:{100.0 * width:.1f}%;'
            f'background:{FADED};opacity:{0.25 + 0.75 * h:.2f}"></span>'
        )
    left = 100.0 * min(max((place - lower) / span, 0.0), 1.0)
    outside = place < lower or place > upper
    return (
        '<span style="flex:1;position:relative;height:12px;border-radius:3px;overflow:hidden;'
        f'background:rgba(140,140,140,0.22)" title="{place:.3f} in [{lower:.3f}, {upper:.3f}]">'
        f'{zones}<span style="position:absolute;top:0;bottom:0;width:4px;margin-left:-2px;'
        f'left:{left:.1f}%;background:{FADED if outside else ACTIVE}"></span></span>'
    )


def _zone(robot: Mapping[str, Any], side: str, speed: float, span: float) -> float:
    """Return the part of the range in which a limit acts: its buffer, or the way to a stop."""
    width = robot["buffer"] or 0.0
    brake = robot["brake"].get(side)
    if brake and speed > 0.0:
        width = max(width, speed * speed / (2.0 * brake))
    return min(max(width / span, 0.02), 0.5)


def _most(tau: float, i: int, robot: Mapping[str, Any]) -> float | None:
    """What the motor of a joint gives in the direction of its torque, N·m or N; None if unknown."""
    if "torque_range" not in robot:  # in recordings of before
        return robot["torque_limit"][i]
    end = robot["torque_range"][tau >= 0.0][i]
    return None if end is None else abs(end)


def _torque(tau: float, limit: float | None, unit: str) -> str:
    if not limit:
        return f'<span style="{_NUMBER};flex-basis:64px">{tau:.1f} {unit}</span>'
    part = min(abs(tau) / limit, 1.0)
    color = FADED if part >= 0.999 else ACTIVE
    edge = "left:50%" if tau >= 0.0 else "right:50%"
    return (
        '<span style="flex:0 0 64px;position:relative;height:12px;border-radius:3px;'
        f'background:rgba(140,140,140,0.22)" title="{tau:.2f} {unit} of {limit:g}">'
        f'<span style="position:absolute;top:0;bottom:0;{edge};width:{50.0 * part:.1f}%;'
        f'background:{color}"></span></span>'
    )


def _panel(rows: Sequence[str]) -> str:
    return f'<div style="padding:0 12px 6px">{"".join(rows)}</div>'
