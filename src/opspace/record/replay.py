"""Put recorded states to a fresh controller: the same torques must come out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from opspace.command import Command, Status
from opspace.controller import ReferenceController
from opspace.errors import OpspaceError, RecordingError
from opspace.record.black_box import FIRST
from opspace.record.obstacle_columns import ObstaclePlayer
from opspace.record.reader import Recording, load
from opspace.record.wrench_columns import Given, recorded_wrenches

_Row = tuple[float, np.ndarray, np.ndarray, np.ndarray, float, Given | None]


@dataclass
class Replay:
    """What a replay found.

    Attributes:
        ticks: How many ticks were replayed.
        unit: Of torques; N·m and N where some joints turn and some slide.
        gap: Largest difference between a recorded torque and the one that came out, N·m or N.
        gap_at: Time of that tick, s.
        last_gap: The difference in the last tick, N·m or N; NaN where there was no torque.
        seconds: By name of a status how long it held, s.
        first: By name of a status when it held first, s.
        last: What the last tick answered: the names of its statuses, or its error.
        repeated: Whether the last tick answered what is recorded: the same status or the same error.
        ended: How the recorded run ended, and why.
    """

    ticks: int
    ended: str
    unit: str
    gap: float = 0.0
    gap_at: float = 0.0
    last_gap: float = np.nan
    seconds: dict[str, float] = field(default_factory=dict)
    first: dict[str, float] = field(default_factory=dict)
    last: str = ""
    repeated: bool = False


def replay(
    recording: Path | str | Recording,
    controller: ReferenceController,
    observe: Callable[[np.ndarray, np.ndarray, Command], None] = lambda q, v, command: None,
) -> Replay:
    """Replay a recording with a controller that has not run yet.

    Every recorded state goes to the controller, at its time and in its order, so a failure shows
    itself again at the same tick; obstacles are where they were, to the last bit. Of a
    `opspace.BlackBox` the first tick ever goes before them.
    Requests and handovers of the run are those that the controller has been given before.

    Args:
        recording: The recording or its directory.
        controller: A controller like the one that was recorded, fresh.
        observe: Sees every tick but the last, as an observer of the run did.

    Returns:
        What was found.

    Raises:
        RecordingError: There is no recording, or it is not one of a robot like the controller's.
        InputError: A tick before the last one was refused.
    """
    if not isinstance(recording, Recording):
        recording = load(recording)
    rows = _rows(recording, controller)
    ended = f"{recording.ended.how} {recording.ended.reason}".strip()
    found = Replay(len(recording), ended, recording.unit_of("tau"))
    _begin(recording, controller)
    obstacles = ObstaclePlayer(recording, controller)
    for i, (t, q, v, tau, _, wrenches) in enumerate(rows[:-1]):
        obstacles.put(i)
        command = controller.step(t, q, v, wrenches=wrenches)
        observe(q, v, command)
        _compare(found, t, command, tau)
    if rows:
        obstacles.put(len(rows) - 1)
        _last(found, rows[-1], controller)
    _in_seconds(found, recording)
    return found


def _last(found: Replay, row: _Row, controller: ReferenceController) -> None:
    """Replay the last tick, which may have ended the run."""
    t, q, v, tau, status, wrenches = row
    try:
        command = controller.step(t, q, v, wrenches=wrenches)
    except Exception as error:
        found.last = f"{type(error).__name__}: {error}"
        found.repeated = found.ended.endswith(found.last)
        return
    _compare(found, t, command, tau)
    found.last = names(command.status)
    found.repeated = int(command.status) == status


def names(status: Status) -> str:
    """Write the statuses of a tick."""
    return ", ".join(str(s.name) for s in Status if s & status) or "OK"


def _rows(recording: Recording, controller: ReferenceController) -> list[_Row]:
    robot, where = controller.robot, recording.directory
    try:
        q, v, tau = (recording.group(name) for name in ("q", "v", "tau"))
        t, status = recording.t, np.nan_to_num(recording["status"], nan=-1.0)
    except OpspaceError as error:
        raise RecordingError(f"{where} cannot be replayed: {error}") from error
    if not q.shape[1] == robot.nq or not v.shape[1] == tau.shape[1] == robot.nv:
        raise RecordingError(f"{where} is not of a robot like {robot.name!r}")
    wrenches = recorded_wrenches(recording)
    return list(zip(t.tolist(), q, v, tau, status.tolist(), wrenches, strict=True))


def _begin(recording: Recording, controller: ReferenceController) -> None:
    """Let the controller see the first tick of the run where the recording begins later."""
    first = recording.header.get(FIRST)
    if first is None:
        return
    try:
        t, q, v = float(first["t"]), np.array(first["q"], float), np.array(first["v"], float)
        wrenches = first.get("wrenches") or None
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(
            f"{recording.directory} does not tell its first tick: {error}"
        ) from error
    if len(recording) and recording.t[0] > t:
        controller.step(t, q, v, wrenches=wrenches)


def _compare(found: Replay, t: float, command: Command, tau: np.ndarray) -> None:
    found.last_gap = float(np.max(np.abs(command.tau - tau)))
    if found.last_gap > found.gap:
        found.gap, found.gap_at = found.last_gap, t
    for status in Status:
        if status & command.status:
            name = str(status.name)
            found.seconds[name] = found.seconds.get(name, 0.0) + 1.0
            found.first.setdefault(name, t)


def _in_seconds(found: Replay, recording: Recording) -> None:
    """Turn counts of ticks into times."""
    steps = np.diff(recording.t)
    steps = steps[np.isfinite(steps)]
    dt = float(np.median(steps)) if steps.size else 0.0
    found.seconds = {name: count * dt for name, count in found.seconds.items()}
