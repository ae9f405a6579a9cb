"""When a reference begins."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, TypeVar

from opspace.tasks.validation import finite

if TYPE_CHECKING:
    from opspace.tasks.references.sample import Reference

Own = TypeVar("Own", bound="Started")


class Started:
    """A reference that begins at a time of its own, or else at the first tick that asks for it.

    Without a start time it is a function of the time since its beginning: a task asks it with that.

    Attributes:
        start_time: Time at which it begins, s; None is the first tick that asks.
    """

    start_time: float | None

    def begin_at(self: Own, t: float) -> Own:
        """Return this reference, beginning at time t [s] if it has no start time of its own."""
        if self.start_time is not None:
            return self
        begun = copy(self)
        begun.start_time = t
        return begun

    def elapsed(self, t: float) -> float:
        """Return the time since its beginning, s."""
        return t if self.start_time is None else t - self.start_time


def begun(reference: Reference, t: float) -> Reference:
    """Let a reference begin at time t [s] if it has no start time of its own.

    Args:
        reference: Any reference; one without ``begin_at`` is a function of the controller's time.
        t: Time, s.

    Returns:
        The reference, to be asked with the controller's time.
    """
    begin = getattr(reference, "begin_at", None)
    return reference if begin is None else begin(t)


def optional_time(value: float | None, what: str) -> float | None:
    """Check a start time, s; None stays None."""
    return None if value is None else finite(value, what)
