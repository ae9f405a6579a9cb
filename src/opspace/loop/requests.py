"""What is asked of a run while it goes on: applied between two ticks, written down, repeatable."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from numbers import Real
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np

from opspace.command import Command
from opspace.contacts import GroundContact
from opspace.controller import ReferenceController
from opspace.errors import InputError, OpspaceError, RecordingError, unknown_name
from opspace.law import Profile
from opspace.tasks import ForceTask, ImpedanceTask, Task
from opspace.tasks.leading import lead
from opspace.tasks.validation import finite, finite_array

KINDS: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "insert": frozenset({"level", "duration"}),
        "remove": frozenset({"duration", "wait"}),
        "move": frozenset({"level", "duration"}),
        "swap": frozenset({"duration"}),
        "lead": frozenset({"position", "orientation"}),
        "gain": frozenset({"kp", "duration"}),
        "spring": frozenset({"stiffness", "duration"}),
        "press": frozenset({"force"}),
        "place": frozenset({"obstacle", "position"}),
    }
)
"""What can be asked for, and what each takes beside its tasks."""

FILE = "requests.jsonl"
"""Name of the file beside a recording that tells what was asked for during the run."""

_NEEDED = {
    "move": ("level",),
    "gain": ("kp",),
    "spring": ("stiffness",),
    "press": ("force",),
    "place": ("obstacle", "position"),
}
_AGAIN = ("lead", "gain", "spring", "press", "place")
"""What a later one of the same kind replaces."""
_TASKS = {"swap": 2, "place": 0}


@dataclass(frozen=True)
class RunRequest:
    """One change asked for during a run.

    Attributes:
        kind: One of `KINDS`.
        tasks: Name of the task or contact, or of the two tasks that swap.
        level: Number of the level, for move and for insert of a task; contacts have none.
        duration: How long it takes, s; not for lead and press, which have speeds of their own.
        position: (3,) where to lead to, m.
        orientation: Quaternion wxyz to lead to.
        kp: Stiffness to come to, 1/s².
        stiffness: Stiffness that an `opspace.ImpedanceTask` comes to, N/m and N·m/rad, one per row.
        force: Force that an `opspace.ForceTask` comes to, N, one per axis.
        obstacle: Name of the obstacle to lead to a position; then there is no task.
        wait: Of a contact to remove, see `opspace.Stack.remove`.

    Raises:
        InputError: Something that this kind does not take, or lacks.
        UnknownNameError: There is no such kind.
    """

    kind: str
    tasks: tuple[str, ...] = ()
    level: float | None = None
    duration: float | None = None
    position: tuple[float, ...] | None = None
    orientation: tuple[float, ...] | None = None
    kp: float | None = None
    wait: bool | None = None
    obstacle: str | None = None
    stiffness: tuple[float, ...] | None = None
    force: tuple[float, ...] | None = None

    @property
    def about(self) -> str:
        """What it is about, in words."""
        return " and ".join(self.tasks) if self.obstacle is None else self.obstacle

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            raise unknown_name("request", str(self.kind), KINDS)
        if isinstance(self.tasks, str) or not all(isinstance(name, str) for name in self.tasks):
            raise InputError(f"request {self.kind!r}: tasks must be names, not {self.tasks!r}")
        self._convert()
        many = _TASKS.get(self.kind, 1)
        if len(self.tasks) != many:
            raise InputError(f"request {self.kind!r} takes {many} task(s), not {list(self.tasks)}")
        given = {f.name for f in fields(self)[2:] if getattr(self, f.name) is not None}
        if wrong := sorted(given - KINDS[self.kind]):
            raise InputError(f"request {self.kind!r} does not take {', '.join(wrong)}")
        for needed in _NEEDED.get(self.kind, ()):
            if needed not in given:
                raise InputError(f"request {self.kind!r} needs {needed}")
        if self.obstacle is not None and not isinstance(self.obstacle, str):
            raise InputError(
                f"request {self.kind!r}: obstacle must be a name, not {self.obstacle!r}"
            )

    def _convert(self) -> None:
        """Turn what was given into plain numbers, or refuse it."""
        what = f"request {self.kind!r}:"
        for name in ("level", "duration", "kp"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _number(value, f"{what} {name}"))
        for name in ("duration", "kp"):
            if (getattr(self, name) or 0.0) < 0.0:
                raise InputError(f"{what} {name} must be at least 0, not {getattr(self, name)}")
        if not (self.wait is None or isinstance(self.wait, bool)):
            raise InputError(f"{what} wait must be true or false, not {self.wait!r}")
        for name, size in (("position", 3), ("orientation", 4)):
            value = getattr(self, name)
            if value is not None:
                found = finite_array(value, (size,), f"{what} {name}")
                object.__setattr__(self, name, tuple(found.tolist()))
        # As long as the task says, which sees them when they are applied.
        for name in ("stiffness", "force"):
            value = getattr(self, name)
            if value is not None:
                if not isinstance(value, tuple):
                    raise InputError(f"{what} {name} must be a list of numbers, not {value!r}")
                each = tuple(_number(one, f"{what} {name}") for one in value)
                object.__setattr__(self, name, each)

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> RunRequest:
        """Read a request from JSON's own types.

        Args:
            content: The attributes by name; lists for tuples.

        Returns:
            The request.

        Raises:
            InputError: Not a request.
            UnknownNameError: A kind that there is not.
        """
        known = [f.name for f in fields(cls)]
        if not isinstance(content, Mapping):
            raise InputError(f"a request is a mapping, not {content!r}")
        for key in content:
            if key not in known:
                raise InputError(f"a request has no {key!r} (valid: {', '.join(known)})")
        try:
            values: dict[str, Any] = {
                key: tuple(value) if isinstance(value, list) else value
                for key, value in content.items()
            }
            return cls(**values)
        except TypeError as error:
            raise InputError(f"this is no request: {error}") from None

    def replaces(self, other: RunRequest) -> bool:
        """Whether nothing of another request is left when this one is done."""
        mine = self.kind, self.tasks, self.obstacle
        if self.kind not in _AGAIN or mine != (
            other.kind,
            other.tasks,
            other.obstacle,
        ):
            return False
        return self.plain().keys() >= other.plain().keys()

    def plain(self) -> dict[str, Any]:
        """Return the request in JSON's own types, without what is not given."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        plain = {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}
        return {key: value for key, value in plain.items() if value is not None}


@dataclass(frozen=True)
class _GainRamp:
    """A stiffness on its way; a step in it would be a step in the torque.

    Attributes:
        gain: What it is called in its task.
        start: Where it was.
        goal: Where it comes to.
        begin: When it began, s.
        duration: How long it takes, s.
    """

    gain: str
    start: Any
    goal: Any
    begin: float
    duration: float

    def at(self, t: float) -> Any:
        part = 1.0 if self.duration <= 0.0 else (t - self.begin) / self.duration
        return self.start + (self.goal - self.start) * Profile("quintic")(part).value

    def over(self, t: float) -> bool:
        return t >= self.begin + self.duration


def _number(value: object, what: str) -> float:
    if not isinstance(value, Real) or isinstance(value, bool):
        raise InputError(f"{what} must be a number, not {value!r}")
    return finite(value, what)  # pyright: ignore[reportArgumentType]


class Changes:
    """Applies requests to the tasks of a controller, for the thread that ticks.

    Args:
        controller: The controller.
        tasks: The tasks that requests may name; those in the stack are known anyway.
        contacts: The contacts that requests may name, in the same way.
    """

    def __init__(
        self,
        controller: ReferenceController,
        tasks: Iterable[Task] = (),
        contacts: Iterable[GroundContact] = (),
    ) -> None:
        self._controller = controller
        late = list(tasks)
        for task in late:
            # Names are looked up now: a task may be led before it is inserted.
            controller.stack.prepare(task)
        self._tasks = {task.name: task for task in [*late, *controller.stack]}
        self._contacts = {one.name: one for one in [*contacts, *controller.stack.contacts.values()]}
        self._ramps: dict[str, _GainRamp] = {}

    def apply(self, request: RunRequest, t: float) -> None:
        """Do what is asked for; it takes effect with the next tick.

        Args:
            request: The request.
            t: Time of the present tick, s.

        Raises:
            OpspaceError: It cannot be done.
        """
        stack = self._controller.stack
        if request.kind == "place":
            self._place(request, t)
            return
        duration = 0.5 if request.duration is None else request.duration
        contact = self._contacts.get(request.tasks[0])
        if contact is not None:
            self._change_contact(contact, request, duration)
            return
        task = self._task(request.tasks[0])
        match request.kind:
            case "insert":
                if request.level is None:
                    raise InputError(f"request 'insert' of the task {task.name!r} needs level")
                stack.insert(task, request.level, duration)
            case "remove":
                stack.remove(task, duration, wait=request.wait)
            case "move":
                assert request.level is not None
                stack.move(task, request.level, duration)
            case "swap":
                stack.swap(task, self._task(request.tasks[1]), duration)
            case "lead":
                place = {"position": request.position, "orientation": request.orientation}
                lead(task, self._controller.robot, t, **place)
            case "press":
                self._press(task, request)
            case "spring":
                if not isinstance(task, ImpedanceTask):
                    raise InputError(f"task {task.name!r} has no spring: it is no ImpedanceTask")
                self._change_gain(task, "stiffness", np.array(request.stiffness), t, duration)
            case _:
                self._change_gain(task, "kp", request.kp, t, duration)

    @property
    def moving(self) -> bool:
        """Whether a gain is on its way."""
        return bool(self._ramps)

    def _change_contact(self, contact: GroundContact, request: RunRequest, duration: float) -> None:
        """Let a contact come or go.

        Raises:
            InputError: Anything else is asked of it.
        """
        if request.kind == "remove":
            self._controller.stack.remove(contact, duration, wait=request.wait)
        elif request.kind == "insert" and request.level is None:
            self._controller.stack.insert(contact, duration)
        else:
            raise InputError(
                f"{contact.name!r} is a contact: it has no level, target or gain, and can be asked "
                "to insert and remove only"
            )

    def follow(self, t: float) -> None:
        """Move on what takes time: the gains on their way at time ``t`` [s]."""
        for name, ramp in list(self._ramps.items()):
            setattr(self._tasks[name], ramp.gain, ramp.at(t))
            if ramp.over(t):
                del self._ramps[name]

    def _change_gain(self, task: Task, gain: str, goal: Any, t: float, duration: float) -> None:
        start = getattr(task, gain)
        # Refused now, if at all: between two ticks nobody sees it.
        setattr(task, gain, goal)
        setattr(task, gain, start)
        self._ramps[task.name] = _GainRamp(gain, start, goal, t, duration)

    @staticmethod
    def _press(task: Task, request: RunRequest) -> None:
        """Let a force task go to another force, as fast as its ``force_rate`` lets it."""
        if not isinstance(task, ForceTask):
            raise InputError(f"task {task.name!r} presses with no force: it is no ForceTask")
        task.force = np.array(request.force)

    def _place(self, request: RunRequest, t: float) -> None:
        guard = self._controller.collisions
        if guard is None:
            raise InputError("this controller keeps away from nothing: it has no obstacles")
        assert request.obstacle is not None
        assert request.position is not None
        guard[request.obstacle].lead(request.position, t)

    def _task(self, name: str) -> Task:
        try:
            return self._tasks[name]
        except KeyError:
            raise unknown_name("task", name, [*self._tasks, *self._contacts]) from None


class RequestDesk:
    """The observer that takes requests from other threads, and writes down what it did and when.

    Args:
        changes: What applies them.
        log: File to write them to, one JSON object per line with the time ``at``; None for none.
        answer: Told about every request, with the reason where it was refused.
    """

    def __init__(
        self,
        changes: Changes,
        log: Path | None = None,
        answer: Callable[[RunRequest, str], None] = lambda request, reason: None,
    ) -> None:
        self._changes = changes
        self._waiting: deque[RunRequest] = deque()
        self._log: IO[str] | None = log.open("w", encoding="utf-8") if log else None
        self._answer = answer

    def ask(self, request: RunRequest) -> None:
        """Put a request on the desk, from any thread; each is dealt with after a tick of its own."""
        self._waiting.append(request)

    @property
    def idle(self) -> bool:
        """Whether nothing waits, and no gain is on its way."""
        return not self._waiting and not self._changes.moving

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Deal with the request that has waited longest.

        One takes some tenth of a millisecond; a hundred in one tick would delay the next one. A
        place to be led to, or a gain, that another one of the same kind waits to replace is skipped.
        """
        del q, v
        while self._waiting:
            request = self._waiting.popleft()
            if not any(later.replaces(request) for later in tuple(self._waiting)):
                self._deal(request, command.t)
                break
            self._answer(request, "")
        self._changes.follow(command.t)

    def close(self) -> None:
        """Answer what still waits, and close the log."""
        while self._waiting:
            self._answer(self._waiting.popleft(), "the run has ended")
        if self._log is not None:
            self._log.close()

    def _deal(self, request: RunRequest, t: float) -> None:
        try:
            self._changes.apply(request, t)
        # Whatever is wrong with what somebody asks, the robot goes on.
        except Exception as error:
            self._answer(request, str(error) or type(error).__name__)
            return
        if self._log is not None:
            self._log.write(json.dumps({"at": t, **request.plain()}, ensure_ascii=False) + "\n")
            self._log.flush()
        self._answer(request, "")


class RequestPlayer:
    """The observer that asks for the same again, at the same ticks.

    Args:
        changes: What applies them.
        log: File that a `RequestDesk` wrote.

    Raises:
        RecordingError: The file cannot be read, or holds something else.
    """

    def __init__(self, changes: Changes, log: Path) -> None:
        self._changes = changes
        self._coming = deque(_read(log))

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Ask for what was asked for at this tick."""
        del q, v
        while self._coming and self._coming[0][0] <= command.t:
            self._changes.apply(self._coming.popleft()[1], command.t)
        self._changes.follow(command.t)


def _read(log: Path) -> list[tuple[float, RunRequest]]:
    try:
        lines = log.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{log} cannot be read: {error}") from error
    found: list[tuple[float, RunRequest]] = []
    for number, line in enumerate(lines, start=1):
        try:
            content = json.loads(line)
            at = finite(content.pop("at"), "at")
            if found and at < found[-1][0]:
                raise InputError(f"at = {at:g} s is before the line above")
            found.append((at, RunRequest.read(content)))
        except (OpspaceError, ValueError, TypeError, AttributeError, KeyError) as error:
            raise RecordingError(f"{log}:{number} is no request: {error}") from None
    return found
