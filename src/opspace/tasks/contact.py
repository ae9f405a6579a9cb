"""How sure it is that something is touched, and what depends on it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.law.scalars import QUINTIC, profile
from opspace.tasks.references.sample import Constant, Reference, Sample
from opspace.tasks.references.start import begun

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot
    from opspace.tasks.force import ForceTask

RISE, FALL = 0.01, 0.03
"""Time constants of the confidence when it grows and when it shrinks, s."""
FOLLOW = 0.02
"""Time constant with which what follows the tool follows it in contact, s."""
LONGEST = 0.1
"""A pause longer than this is none between two ticks, s."""


def lag(dt: float, time: float) -> float:
    """Part of the way that a first-order lag with this time constant goes in a tick, 0 to 1."""
    return dt / (time + dt)


class Confidence:
    """How sure it is that the tool touches: c from 0 to 1, continuous in time whatever is measured.

        c ← c + Δt/(τ + Δt) (P((F − off)/(on − off)) − c)

    P is the quintic profile, τ is `RISE` while c grows and `FALL` while it shrinks.

    Args:
        off: Force at and below which nothing is touched, N.
        on: Force at and above which the touch is certain, N.
    """

    def __init__(self, off: float, on: float) -> None:
        self.off, self.on = off, on
        self.value = 0.0

    def learn(self, force: float, dt: float) -> float:
        """Count one measured force [N], ``dt`` [s] after the one before."""
        s = min(max((force - self.off) / (self.on - self.off), 0.0), 1.0)
        wanted = profile(QUINTIC, s)
        time = RISE if wanted > self.value else FALL
        self.value += lag(dt, time) * (wanted - self.value)
        return self.value


class Reach:
    """How far a tool goes on when it loses the surface.

    In contact the floor follows the tool with the time constant `FOLLOW`; out of contact the tool may
    go ``reach`` beyond it, at a speed that falls to zero there:

        ṡ_f = c (s − s_f)/τ,        v_a = clip(k (s_f + reach − s), ± v)

    Before the first touch there is no floor.

    Args:
        reach: m.
    """

    def __init__(self, reach: float) -> None:
        self.reach = reach
        self.floor = math.inf

    def learn(self, travel: float, confidence: float, beyond: float, dt: float) -> None:
        """Count where the tool is along the way in, m; the floor begins ``beyond`` [m] behind it."""
        if confidence <= 0.0:
            return
        if math.isinf(self.floor):
            self.floor = travel + beyond
        self.floor += confidence * lag(dt, FOLLOW) * (travel - self.floor)

    def speed(self, travel: float, most: float, slope: float) -> float:
        """Return the speed v_a of the approach, at most ``most`` [m/s], with the slope k [1/s]."""
        return min(max(slope * (self.floor + self.reach - travel), -most), most)


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


class GiveWay:
    """A position in time that follows the tool along the force while something is pressed.

    For a position task below a force task, which does not decide there how far in the tool is. With n
    along the force and c the confidence of the touch, the reference p is shifted by δ n,

        δ̇ = −c nᵀ ṗ + c (nᵀ (x − p) − δ)/τ,        τ = `FOLLOW`

    so that it is where the tool is when the touch ends. Like the force task it remembers; asked again
    at the same time it answers the same.

    Args:
        reference: (3,) m, or a reference of a position.
        task: The force task.
    """

    def __init__(self, reference: ArrayLike | Reference, task: ForceTask) -> None:
        self.reference: Reference = reference if callable(reference) else Constant(reference)
        self.task = task
        self._t: float | None = None
        self._shift = 0.0

    def begin_at(self, t: float) -> GiveWay:
        """Return this reference with nothing to be followed yet, begun at time t, s."""
        return GiveWay(begun(self.reference, t), self.task)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        x, v, a = self.reference(t)
        touch = self.task.touch
        if touch is None:
            return Sample(x, v, a)
        before, self._t = self._t, t
        dt = 0.0 if before is None else t - before
        n, c = touch.direction, touch.confidence
        if 0.0 < dt <= LONGEST:
            ahead = float(n @ v) if v.size else 0.0
            away = touch.travel - float(n @ x) - self._shift
            self._shift += c * (lag(dt, FOLLOW) * away - dt * ahead)
        v = v - c * (n @ v) * n if v.size else v
        return Sample(x + self._shift * n, v, a - c * (n @ a) * n if a.size else a)


def checked_thresholds(contact: tuple[float, float] | None, force: float, name: str) -> Confidence:
    """Make the confidence of a task that presses with ``force`` [N].

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
        return Confidence(0.1 * force, 0.4 * force)
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
    return Confidence(off, on)
