"""Errors raised by opspace, each naming what is wrong and what would be right."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")


class OpspaceError(Exception):
    """Base of every error that opspace raises on purpose."""


class InputError(OpspaceError, ValueError):
    """A number, shape or value that cannot be used."""


class UnknownNameError(OpspaceError, KeyError):
    """A name that does not exist; the message lists near matches and the valid choices.

    A `KeyError` too, as what is asked for by name is often asked of a mapping.

    Attributes:
        name: The name as given.
        kind: What the name should have been, for example ``"frame"``.
        choices: Every valid name, also those that the message leaves out.
    """

    def __init__(
        self, message: str, *, name: str = "", kind: str = "", choices: Iterable[str] = ()
    ) -> None:
        super().__init__(message)
        self.name = name
        self.kind = kind
        self.choices = tuple(choices)

    __str__ = Exception.__str__  # a KeyError would put the message into quotes

    def reworded(self, message: str) -> UnknownNameError:
        """Say the same in a context that the message tells."""
        return UnknownNameError(message, name=self.name, kind=self.kind, choices=self.choices)


class ModelError(OpspaceError):
    """A robot file that cannot be read or used."""


class ModelWarning(UserWarning):
    """What a robot file says and the controller does not follow."""


class RecordingError(OpspaceError):
    """A recording that cannot be written or read."""


class RobotStoppedError(OpspaceError):
    """A robot that has braked by itself and takes no commands any more."""


class MissingExtraError(OpspaceError, ImportError):
    """An optional dependency that is not installed."""


class ScenarioError(OpspaceError):
    """A scenario that cannot be used.

    Attributes:
        file: Scenario file, or None for a scenario that was not read from a file.
        line: Line of the offending key, counted from 1, or None where it is not known.
        key: Dotted path of the offending key, for example ``tasks.position.kp``.
    """

    def __init__(
        self,
        message: str,
        *,
        file: Path | str | None = None,
        line: int | None = None,
        key: str = "",
    ) -> None:
        where = str(file) if file is not None else "scenario"
        if line is not None:
            where += f":{line}"
        super().__init__(f"{where}: {key + ': ' if key else ''}{message}")
        self.file = file
        self.line = line
        self.key = key

    def __reduce__(self) -> tuple[Any, ...]:
        """Be copied with the message as it is, which a second construction would prefix again."""
        return self.__class__.__new__, (self.__class__, *self.args), self.__dict__


def unknown_name(
    kind: str, name: str, choices: Iterable[str], listed: Iterable[str] | None = None
) -> UnknownNameError:
    """Build the error for a name that is not among ``choices``.

    Args:
        kind: What the name should have been, for example ``"frame"``.
        name: The name as given.
        choices: Every valid name.
        listed: The names that the message lists where all would be too many; None lists all.

    Returns:
        The error, to be raised by the caller.
    """
    valid = list(choices)
    near = difflib.get_close_matches(str(name), valid, n=3, cutoff=0.5)
    hint = f"; did you mean {' or '.join(repr(n) for n in near)}?" if near else ""
    shown = valid if listed is None else list(listed)
    return UnknownNameError(
        f"unknown {kind} {name!r}{hint} (valid: {', '.join(shown) if shown else 'none'})",
        name=name,
        kind=kind,
        choices=valid,
    )


class ByName(dict[str, T]):
    """What a tick tells by name; a name that is not there is refused with those that are."""

    def __missing__(self, name: str) -> T:
        raise unknown_name("name in this tick", name, self)


def missing_extra(package: str, extra: str) -> MissingExtraError:
    """Build the error for an optional dependency that is not installed.

    Args:
        package: Name of the package that failed to import.
        extra: The extra of opspace that installs it.

    Returns:
        The error, to be raised by the caller.
    """
    return MissingExtraError(
        f"{package} is not installed; install it with: pip install 'opspace[{extra}]'"
    )
