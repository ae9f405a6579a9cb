"""Activations in [0, 1]: smooth profiles, buffers on a quantity and ramps in time."""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
import math
from dataclasses import dataclass
from typing import NamedTuple

from opspace.errors import InputError, unknown_name
from opspace.law.scalars import (
    PROFILES,
    profile,
    profile_derivatives,
    ramp_phase,
)


class Activation(NamedTuple):
    """An activation and its first two derivatives with respect to its argument."""

    value: float
    slope: float
    curvature: float


_INSTANT = 1e-9


@dataclass(frozen=True)
class Profile:
    r"""A smooth step from 0 at s = 0 to 1 at s = 1, constant outside.

    While the activations on their way are blended exactly the torque is as smooth in time as they
    are, so quintic is the default everywhere.

    Args:
        name: One of `opspace.law.scalars.PROFILES`, which has formulas and smoothness.

    Raises:
        UnknownNameError: The name is not one of them.
    """

    name: str = "quintic"

    def __post_init__(self) -> None:
        if self.name not in PROFILES:
            raise unknown_name("activation profile", self.name, PROFILES)

    def __call__(self, s: float) -> Activation:
        """Evaluate h, dh/ds and d²h/ds² at ``s`` (any real number)."""
        code = PROFILES.index(self.name)
        return Activation(profile(code, s), *profile_derivatives(code, s))


@dataclass(frozen=True)
class Buffer:
    """Activation by a quantity: 0 at ``off``, 1 at ``on``, smooth in between (Fig. 4 of the paper).

    h(x) = profile((x − off) / (on − off)). With ``off < on`` the activation rises with x (a singular
    value that must be large), with ``off > on`` it falls (a distance that must not become small).

    Args:
        off: Value of the quantity at and beyond which the activation is 0, in its own unit.
        on: Value at and beyond which the activation is 1.
        profile: Name of the profile, see `Profile`.

    Raises:
        InputError: The two edges coincide or are not finite.
        UnknownNameError: There is no such profile.
    """

    off: float
    on: float
    profile: str = "quintic"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.off) and math.isfinite(self.on)) or self.off == self.on:
            raise InputError(
                f"a buffer needs two different finite edges, got off={self.off}, on={self.on}"
            )
        Profile(self.profile)

    def __call__(self, x: float) -> Activation:
        """Evaluate h, dh/dx and d²h/dx² at ``x``."""
        width = self.on - self.off
        h = Profile(self.profile)((x - self.off) / width)
        return Activation(h.value, h.slope / width, h.curvature / width**2)


class Ramp(NamedTuple):
    """Activation by time, which can be sent elsewhere at any moment without a step.

    h(t) = profile(s(t)). An undisturbed ramp has s(t) = (t − start_time) / duration. When a running
    ramp gets a new target, the rate of s is led smoothly (C¹) from the old one to the constant rate
    that arrives on time, so h keeps its value, slope and curvature. s may pass 0 or 1 on the way;
    h is constant there, hence it never leaves [0, 1].

    Build the first one with `Ramp.resting` and every other one with `towards`.
    """

    profile: str
    target: float
    start_time: float
    duration: float
    phase: float
    rate: float
    acceleration: float
    blend_time: float
    cruise: float

    @staticmethod
    def resting(value: float, profile: str = "quintic") -> "Ramp":
        """Build a ramp that stays at ``value``, 0 or 1.

        Args:
            value: 0.0 (out) or 1.0 (in).
            profile: Name of the profile, see `Profile`.

        Raises:
            InputError: ``value`` is neither 0 nor 1.
            UnknownNameError: There is no such profile.
        """
        _check_target(value)
        Profile(profile)
        return Ramp(profile, value, 0.0, 0.0, value, 0.0, 0.0, 0.0, 0.0)

    def towards(self, target: float, duration: float, t: float) -> "Ramp":
        """Build the ramp that leaves the present activation at ``t`` and arrives ``duration`` later.

        Args:
            target: 0.0 or 1.0.
            duration: Time to get there, s; less than a nanosecond, or than the clock resolves at
                this time, is a hard switch.
            t: Time of the request, s.

        Returns:
            The new ramp, equal to this one in value, slope and curvature at ``t``.

        Raises:
            InputError: Target, duration or time cannot be used.
        """
        _check_target(target)
        if not (math.isfinite(duration) and duration >= 0.0):
            raise InputError(f"the duration of a ramp must be finite and >= 0 s, got {duration}")
        if not math.isfinite(t):
            raise InputError(f"the time of a ramp must be finite, got {t}")
        if duration < _INSTANT or t + duration == t:
            return Ramp(self.profile, target, t, 0.0, target, 0.0, 0.0, 0.0, 0.0)
        s, rate, acceleration = ramp_phase(t, *self.numbers)
        if not 0.0 < s < 1.0:
            # h is flat here, so the phase may start at the edge with whatever rate it needs.
            edge = min(max(s, 0.0), 1.0)
            cruise = (target - edge) / duration
            return Ramp(self.profile, target, t, duration, edge, cruise, 0.0, 0.0, cruise)
        # Long enough to be gentle, short enough that s overshoots by at most about 1/8.
        blend = 0.5 * duration
        if rate != 0.0:
            blend = min(blend, 0.25 / abs(rate))
        if acceleration != 0.0:
            blend = min(blend, 1.0 / math.sqrt(abs(acceleration)))
        # In this order nothing overflows, however long the ramp: blend · acceleration is small.
        covered = blend * (rate / 2.0 + blend * acceleration / 12.0)
        cruise = (target - s - covered) / (duration - 0.5 * blend)
        return Ramp(self.profile, target, t, duration, s, rate, acceleration, blend, cruise)

    def __call__(self, t: float) -> Activation:
        """Evaluate h, dh/dt [1/s] and d²h/dt² [1/s²] at time ``t`` [s]."""
        s, rate, acceleration = ramp_phase(t, *self.numbers)
        h = Profile(self.profile)(s)
        return Activation(h.value, h.slope * rate, h.curvature * rate**2 + h.slope * acceleration)

    def starting(self, t: float) -> "Ramp":
        """Build the same ramp that starts at time ``t`` [s]."""
        return self if t == self.start_time else Ramp(self.profile, self.target, t, *self[3:])

    def finished(self, t: float) -> bool:
        """Tell whether the ramp is at its target at time ``t`` [s]; a hard switch always is."""
        return self.duration == 0.0 or t >= self.start_time + self.duration

    @property
    def numbers(self) -> tuple[float, ...]:
        """Target, start, duration, phase, rate, acceleration, blend time and cruise rate."""
        return self[1:]


def _check_target(value: float) -> None:
    if value not in (0.0, 1.0):
        raise InputError(f"a ramp goes to activation 0 or 1, got {value}")
