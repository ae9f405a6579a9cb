"""One tick of a recording as the page shows it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from opspace.errors import InputError
from opspace.record.contact_columns import GROUP as CONTACTS
from opspace.record.growing import GrowingRecording
from opspace.record.obstacle_columns import GROUP as OBSTACLES
from opspace.record.obstacle_columns import HEADER_KEY, PARTS, placing_of
from opspace.record.wrench_columns import GROUP as WRENCHES
from opspace.record.wrench_columns import RECENT, latest
from opspace.tasks.obstacles import Placing


@dataclass(frozen=True)
class TaskFrame:
    """A task at one tick.

    Attributes:
        name: Its name.
        activation: 0 to 1; nan while it is not in the stack.
        level: Number of its level; between two while it moves.
        error: (m,) desired minus actual.
    """

    name: str
    activation: float
    level: float
    error: np.ndarray

    @property
    def present(self) -> bool:
        """Whether it is in the stack."""
        return not math.isnan(self.activation)


@dataclass(frozen=True)
class LevelFrame:
    """A level at one tick.

    Attributes:
        number: Its number.
        sigma: (k,) eigenvalues of Eq. 25, strongest first.
        activation: (k,) activation of the directions.
        weakest: (6,) the last of them as a motion in the world, nan where it cannot be drawn.
    """

    number: float
    sigma: np.ndarray
    activation: np.ndarray
    weakest: np.ndarray


@dataclass(frozen=True)
class ContactFrame:
    """A contact at one tick.

    Attributes:
        name: Its name.
        progress: How far it has come, 0 to 1; nan while it is not in the stack.
        activation: h of its force.
        force: (3,) planned force on the robot in world axes, N.
        measured: (3,) measured force, N; nan where none is.
        cop: (2,) centre of pressure in its axes, m.
        cone_use: Part of its cone that the force uses.
    """

    name: str
    progress: float
    activation: float
    force: np.ndarray
    measured: np.ndarray
    cop: np.ndarray
    cone_use: float


@dataclass(frozen=True)
class TouchFrame:
    """What a force task knows of its contact at one tick; nan while it is not in the stack.

    Attributes:
        name: Name of the task.
        activation: Of the task.
        confidence: How sure it is that something is touched, 0 to 1.
        wanted: (m,) force and moment that is wanted along its rows, N and N·m.
        commanded: (m,) the same with feedback.
        wrench: (3,) force on the environment that was measured last, in world axes, N.
    """

    name: str
    activation: float
    confidence: float
    wanted: np.ndarray
    commanded: np.ndarray
    wrench: np.ndarray


_NOWHERE = np.full(3, np.nan)


@dataclass(frozen=True)
class Frame:
    """One tick.

    Attributes:
        t: Time, s.
        q: (nq,) configuration, rad.
        v: (n,) velocity, rad/s.
        tau: (n,) torque, N·m.
        tasks: The tasks.
        levels: The levels, most important first.
        limits: Activation of the joint limits by name.
        status: Flags of the command.
        obstacles: Where obstacles are, by name, those that are there.
        contacts: The contacts.
        com: (3,) centre of mass, m; nan for robots that are bolted down.
        touches: What force tasks touch.
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    tasks: tuple[TaskFrame, ...]
    levels: tuple[LevelFrame, ...]
    limits: dict[str, float]
    status: int
    obstacles: Mapping[str, Placing] = field(default_factory=dict[str, Placing])
    contacts: tuple[ContactFrame, ...] = ()
    com: np.ndarray = field(default_factory=lambda: _NOWHERE)
    touches: tuple[TouchFrame, ...] = ()


class FrameReader:
    """Reads ticks of a recording.

    Args:
        recording: The recording.

    Raises:
        InputError: It has no states or torques, or does not tell its tasks.
    """

    def __init__(self, recording: GrowingRecording) -> None:
        if "tasks" not in recording.header:
            raise InputError(
                f"{recording.directory} does not say what it is about; record it again"
            )
        self.recording = recording
        self._t, self._status = recording.columns(["t", "status"])
        self._q, self._v, self._tau = (
            recording.columns(recording.group(name)) for name in ("q", "v", "tau")
        )
        limits = recording.group("limits")
        self._limits = {name.removeprefix("limits/"): recording.index[name] for name in limits}
        self._obstacles = {
            name: recording.columns([f"{OBSTACLES}/{name}/{part}" for part in PARTS])
            for name in recording.header.get(HEADER_KEY, {}).get("obstacles", {})
            if recording.group(f"{OBSTACLES}/{name}")
        }
        self._tasks = {name: self._task(name) for name in recording.header["tasks"]}
        self._levels = {float(name): self._level(name) for name in _levels(recording)}
        self._contacts = {name: self._contact(name) for name in recording.header.get(CONTACTS, {})}
        self._com = recording.columns(recording.group("com"))
        self._touches = {
            name: self._touch(name, about["press"]["sensor"])
            for name, about in recording.header["tasks"].items()
            if "press" in about
        }

    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
        return [name.removeprefix("v/") for name in self.recording.group("v")]

    def at(self, row: int) -> Frame:
        """Read one tick.

        Args:
            row: Which, from 0.

        Returns:
            The tick.
        """
        values = np.array(self.recording.data[row])
        tasks = [
            TaskFrame(name, float(values[h]), float(values[level]), values[error])
            for name, (h, level, error) in self._tasks.items()
        ]
        return Frame(
            t=float(values[self._t]),
            q=values[self._q],
            v=values[self._v],
            tau=values[self._tau],
            tasks=tuple(tasks),
            levels=tuple(
                LevelFrame(number, *(values[part] for part in parts))
                for number, parts in self._levels.items()
            ),
            limits={name: float(values[place]) for name, place in self._limits.items()},
            status=int(values[self._status]),
            obstacles={
                name: placing_of(values[part])
                for name, part in self._obstacles.items()
                if not np.isnan(values[part[0]])
            },
            contacts=tuple(
                _contact_frame(name, values, places) for name, places in self._contacts.items()
            ),
            com=values[self._com] if self._com else _NOWHERE,
            touches=tuple(self._touch_frame(name, row, values) for name in self._touches),
        )

    def row_at(self, t: float) -> int:
        """Find the tick next to a time [s]."""
        times = self.recording.data[:, self._t]
        return int(np.clip(np.searchsorted(times, t), 0, max(len(times) - 1, 0)))

    def history(self, row: int, seconds: float, points: int, names: list[str]) -> np.ndarray:
        """Read columns over the time before a tick.

        Args:
            row: The last tick.
            seconds: How long before it [s].
            points: How many ticks at most.
            names: The columns.

        Returns:
            (k, 1 + number of columns) with the time first [s].
        """
        data = self.recording.data
        first = self.row_at(float(data[row, self._t]) - seconds)
        stride = max(1, -(-(row - first) // points))
        shown = np.arange(row, first - 1, -stride)[::-1]
        return np.array(data[shown])[:, [self._t, *self.recording.columns(names)]]

    def _task(self, name: str) -> tuple[int, int, list[int]]:
        recording = self.recording
        h, level = recording.columns([f"tasks/{name}/activation", f"tasks/{name}/level"])
        return h, level, recording.columns(recording.group(f"tasks/{name}/error"))

    def _contact(self, name: str) -> dict[str, list[int]]:
        recording = self.recording
        single = ("progress", "activation", "cone_use")
        found = {part: recording.columns([f"{CONTACTS}/{name}/{part}"]) for part in single}
        several = ("force", "measured", "cop")
        found.update(
            {
                part: recording.columns(recording.group(f"{CONTACTS}/{name}/{part}"))
                for part in several
            }
        )
        return found

    def _touch(self, name: str, sensor: str) -> dict[str, list[int]]:
        recording, where = self.recording, f"touch/{name}"
        found = {
            part: recording.columns(recording.group(f"{where}/{part}"))
            for part in ("measured", "commanded")
        }
        found["confidence"] = recording.columns([f"{where}/confidence"])
        found["wrench"] = recording.columns([f"{WRENCHES}/{sensor}/{axis}" for axis in "xyz"])
        return found

    def _touch_frame(self, name: str, row: int, values: np.ndarray) -> TouchFrame:
        places, (h, _, error) = self._touches[name], self._tasks[name]
        # The memory of a task that has left the stack stays as it was.
        there = 0.0 if math.isfinite(values[h]) else math.nan
        recent = self.recording.data[max(row + 1 - RECENT, 0) : row + 1, places["wrench"]]
        return TouchFrame(
            name,
            float(values[h]),
            float(values[places["confidence"][0]]) + there,
            values[error] + values[places["measured"]],
            values[places["commanded"]] + there,
            latest(recent, len(recent) - 1),
        )

    def _level(self, number: str) -> tuple[list[int], list[int], list[int]]:
        recording, prefix = self.recording, f"levels/{number}"
        sigma, activation, weakest = (
            recording.columns(recording.group(f"{prefix}/{part}"))
            for part in ("sigma", "activation", "weakest")
        )
        return sigma, activation, weakest


def _contact_frame(name: str, values: np.ndarray, places: dict[str, list[int]]) -> ContactFrame:
    one = {part: values[columns] for part, columns in places.items()}
    return ContactFrame(
        name,
        float(one["progress"][0]),
        float(one["activation"][0]),
        one["force"],
        one["measured"] if one["measured"].size else _NOWHERE,
        one["cop"],
        float(one["cone_use"][0]),
    )


def _levels(recording: GrowingRecording) -> list[str]:
    return list(dict.fromkeys(name.split("/")[1] for name in recording.group("levels")))
