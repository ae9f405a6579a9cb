"""How sure it is that something is touched, and what depends on it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.law.press_columns import CONFIDENCE
from opspace.law.scalars import FALL, FOLLOW, lag, passed
from opspace.tasks.references.sample import Constant, Reference, Sample
from opspace.tasks.references.start import begun
from opspace.tasks.validation import Array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot
    from opspace.tasks.force import ForceTask


TURNED = 0.9
"""Cosine of a turn of the force from one tick to the next that is no turn of the tool."""


class Contact:
    """Activation by how sure a force task is that it touches: its confidence c.

    As the activation of the force task itself it inserts the task when something is touched, above
    whatever moves the tool there, and fades it out when the touch is lost.

    Args:
        task: The force task.
    """

    def __init__(self, task: ForceTask) -> None:
        self.task = task

    def bind(self, robot: Robot) -> None:
        """Bind the force task, which may not be in the stack."""
        self.task.bind(robot)

    def __call__(self, robot: Robot, t: float) -> float:
        """Evaluate the activation at the robot's present state."""
        return self.task.sense(robot, t).confidence


class HardContact(Contact):
    """The switch that a contact replaces: on from the force ``on``, off below ``off``, all or nothing.

    For comparisons. It makes the confidence of the force task 0 or 1 as well.
    """

    _on = False

    def __call__(self, robot: Robot, t: float) -> float:
        """Evaluate the activation at the robot's present state."""
        touch = self.task.sense(robot, t)
        pressed = float(np.linalg.norm(touch.measured))
        off, on = self.task.thresholds
        self._on = pressed > (off if self._on else on)
        self.task.memory[CONFIDENCE] = float(self._on)
        return float(self._on)


class GiveWay:
    """A position in time that follows the tool along the force while something is pressed.

    For a position task below a force task, which does not decide there how far in the tool is. With n
    along the force and c the confidence of the touch, the reference p is shifted by δ n,

        δ̇ = −c nᵀ ṗ + c (nᵀ (x − p) − δ)/τ,        τ = `opspace.law.scalars.FOLLOW`

    so that it is where the tool is when the touch ends. It goes by what the force task knew in the
    tick before, like which it remembers; asked again at the same time it answers the same. While the
    force task is not asked, c fades as that of a lost touch does and the shift stays; where n turns
    at once, as when a force changes its sign, what there is of the shift stays where it is.

    Args:
        reference: (3,) m, or a reference of a position.
        task: The force task.
    """

    def __init__(self, reference: ArrayLike | Reference, task: ForceTask) -> None:
        self.reference: Reference = reference if callable(reference) else Constant(reference)
        self.task = task
        self._t = -math.inf
        self._c = 0.0
        self._left = 0.0  # of the confidence, since the task was last asked
        self._n = np.zeros(3)
        self._shift = 0.0
        self._kept = np.zeros(3)
        self._before: Array | None = None
        self._now: Array | None = None

    def begin_at(self, t: float) -> GiveWay:
        """Return this reference with nothing to be followed yet, begun at time t, s."""
        return GiveWay(begun(self.reference, t), self.task)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        x, v, a = self.reference(t)
        if t != self._t:
            self._follow(t, x, v)
        c, n = self._c, self._n
        v = v - c * (n @ v) * n if v.size else v
        return Sample(x + self._kept + self._shift * n, v, a - c * (n @ a) * n if a.size else a)

    def _follow(self, t: float, x: Array, v: Array) -> None:
        """Bring the shift from the tick before up to time t."""
        dt = passed(t, self._t)
        known = self.task.memory.before(t) if self.task.memory.asked_since(self._t) else None
        self._t, self._before, self._now = t, self._now, x
        self._left *= 1.0 - lag(dt, FALL)
        if known is not None and known[2].any():  # a task that begins in this tick knows nothing
            c, travel, n = known
            if n @ self._n < TURNED:
                self._kept, self._shift = self._kept + self._shift * self._n, 0.0
            self._left = self._left if c < self._left else 0.0
            self._c, self._n = max(c, self._left), n
            if dt > 0.0 and self._before is not None:
                away = travel - float(n @ (self._before + self._kept)) - self._shift
                self._shift += self._c * lag(dt, FOLLOW) * away
        else:
            self._left = self._c = (1.0 - lag(dt, FALL)) * self._c
        if dt > 0.0 and v.size:
            self._shift -= self._c * dt * float(self._n @ v)


def checked_thresholds(
    contact: tuple[float, float] | None, force: float, name: str
) -> tuple[float, float]:
    """Tell between which forces [N] the confidence of a task rises that presses with ``force`` [N].

    Args:
        contact: Forces (off, on) between which the confidence rises, N; None is a tenth and four
            tenths of the force.
        force: Size of the force, N.
        name: Name of the task.

    Raises:
        InputError: Not 0 < off < on, or the force is below ``on``: task and motion would hold each
            other half-way, with a confidence between 0 and 1.
    """
    if contact is None:
        return 0.1 * force, 0.4 * force
    off, on = contact
    if not (math.isfinite(off) and math.isfinite(on) and 0.0 < off < on):
        raise InputError(
            f"task {name!r}: contact must be two forces 0 < off < on [N], not {contact}"
        )
    if force < on:
        raise InputError(
            f"task {name!r}: a force of {force:g} N is below contact[1] = {on:g} N, so that the task "
            "could come to rest half-way between motion and force; press harder or lower contact"
        )
    return float(off), float(on)
