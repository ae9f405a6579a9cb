"""Scalar laws and numbers that the readable and the compiled form share; each stands here once.

Plain functions of floats: the readable form calls them as they are, the kernels compile all of them.
They may call one another and use numbers of this module, nothing else.
"""

# pyright: strict
from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

UNBOUNDED = 1e30
"""Bounds beyond are none."""

# --- Activation profiles h(s) between s = 0 and s = 1, see `opspace.Profile` -------------------------

PROFILES = ("linear", "cubic", "quintic", "half-sine", "tanh", "step")
"""Names of the profiles; the place of a name is its code.

========== =============================================== ==========
name       h(s)                                            smoothness
========== =============================================== ==========
linear     s                                               C⁰
cubic      3 s² − 2 s³                                     C¹
quintic    10 s³ − 15 s⁴ + 6 s⁵                            C²
half-sine  ½ − ½ cos(π s)                                  C¹
tanh       ½ (1 + tanh(1/(1 − s) − 1/s))                   C^∞
step       0 below ½, 1 from there                         a jump
========== =============================================== ==========

``step`` is the hard switch that all of this avoids, for comparisons."""
LINEAR, CUBIC, QUINTIC, HALF_SINE, TANH, STEP = range(6)

TANH_EDGE = 4e-3
"""Nearer to an end the value of ``tanh`` equals 0 or 1 to the last bit, and cosh overflows."""


def profile(code: int, s: float) -> float:
    """Evaluate h(s), 0 below s = 0 and 1 above s = 1."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    if code == QUINTIC:
        h = s**3 * (10.0 + s * (6.0 * s - 15.0))
    elif code == CUBIC:
        h = s * s * (3.0 - 2.0 * s)
    elif code == HALF_SINE:
        h = 0.5 - 0.5 * math.cos(math.pi * s)
    elif code == TANH:
        h = _tanh(s)
    elif code == STEP:
        h = 1.0 if s >= 0.5 else 0.0
    else:
        h = s
    # Rounding of a polynomial next to its end must not leave [0, 1].
    return min(max(h, 0.0), 1.0)


def fade(
    code: int, sigma: float, lower: float, upper: float, rest_lower: float, rest_upper: float,
    unrest: float,
) -> float:  # fmt: skip
    """Evaluate how much of a direction with the eigenvalue σ is there.

    A buffer for what moves or has a way to go, and a lower one for what is nearly at rest at its
    target, mixed by the profile of ``unrest``: 0 at rest there, 1 far away or fast.
    """
    moving = profile(code, unrest)
    here = 0.0
    if moving > 0.0:
        here = moving * profile(code, (sigma - lower) / (upper - lower))
    if moving < 1.0:
        here += (1.0 - moving) * profile(code, (sigma - rest_lower) / (rest_upper - rest_lower))
    return here


def unrest_of(near: float, error: float, speed: float, reference: float) -> float:
    """Evaluate the square of what a row adds to how far its level is from rest at its target.

    Args:
        near: 1/e₀, 1/m or 1/rad; 0 for rows that are never at rest.
        error: x_d − x, m or rad.
        speed: ‖Lᵀ q̇‖, √J: the square root of twice the kinetic energy.
        reference: σ that is usual for the row, 1/kg or 1/(kg·m²).

    Returns:
        (e/e₀)² + ‖Lᵀ q̇‖² reference/(e₀ `HURRY`)²: the arm as a whole moves a row as fast as that.
    """
    if near == 0.0:
        return 1.0
    hurry = speed / HURRY
    return near * near * (error * error + hurry * hurry * reference)


def remembered_unrest(kept: float, now: float, passed: float) -> float:
    """Evaluate how far a row has been from rest lately, from 0 to `MOST_UNREST`.

    Args:
        kept: The same at the tick before, m.
        now: How far it is now, a: the square root of `unrest_of`.
        passed: Time since the tick before, Δt, s; more than `LONGEST_LESSON` counts as that.

    Returns:
        m + (min(a, `MOST_UNREST`) − m) Δt/(τ + Δt), τ = `REST_TIME`: a low pass by implicit Euler.
    """
    passed = min(max(passed, 0.0), LONGEST_LESSON)
    return kept + (min(now, MOST_UNREST) - kept) * passed / (REST_TIME + passed)


def profile_derivatives(code: int, s: float) -> tuple[float, float]:
    """Evaluate dh/ds and d²h/ds²."""
    if s <= 0.0 or s >= 1.0 or code == STEP:
        return 0.0, 0.0
    if code == QUINTIC:
        return 30.0 * s * s * (1.0 - s) ** 2, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    if code == CUBIC:
        return 6.0 * s * (1.0 - s), 6.0 - 12.0 * s
    if code == HALF_SINE:
        angle = math.pi * s
        return 0.5 * math.pi * math.sin(angle), 0.5 * math.pi**2 * math.cos(angle)
    if code == TANH:
        return _tanh_derivatives(s)
    return 1.0, 0.0


def _tanh(s: float) -> float:
    if not TANH_EDGE < s < 1.0 - TANH_EDGE:
        return 1.0 if s > 0.5 else 0.0
    return 0.5 * (1.0 + math.tanh(1.0 / (1.0 - s) - 1.0 / s))


def _tanh_derivatives(s: float) -> tuple[float, float]:
    if not TANH_EDGE < s < 1.0 - TANH_EDGE:
        return 0.0, 0.0
    argument = 1.0 / (1.0 - s) - 1.0 / s
    slope = 1.0 / (1.0 - s) ** 2 + 1.0 / s**2
    curvature = 2.0 / (1.0 - s) ** 3 - 2.0 / s**3
    sech2 = 1.0 / math.cosh(argument) ** 2
    return 0.5 * sech2 * slope, 0.5 * sech2 * (curvature - 2.0 * math.tanh(argument) * slope**2)


# --- Activations in time, see `opspace.Ramp` ---------------------------------------------------------


def ramp_phase(
    t: float, target: float, start_time: float, duration: float, phase: float,
    rate: float, acceleration: float, width: float, cruise: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Evaluate s(t) of a ramp and its first two derivatives.

    The rate of s is led by a cubic Hermite segment of this width from (rate, acceleration) to
    (cruise, 0), and stays there until the ramp arrives.
    """
    if t >= start_time + duration:  # the time that requests and `settled` go by, to the last bit
        return target, 0.0, 0.0
    tau = max(t - start_time, 0.0)
    if tau >= width:
        covered = width * ((rate + cruise) / 2.0 + width * acceleration / 12.0)
        return phase + covered + cruise * (tau - width), cruise, 0.0
    x = tau / width
    s = phase + width * (
        rate * (x**4 / 2 - x**3 + x)
        + acceleration * width * (x**4 / 4 - 2 * x**3 / 3 + x**2 / 2)
        + cruise * (x**3 - x**4 / 2)
    )
    ds = (
        rate * (2 * x**3 - 3 * x**2 + 1)
        + acceleration * width * (x**3 - 2 * x**2 + x)
        + cruise * (3 * x**2 - 2 * x**3)
    )
    dds = (cruise - rate) * (6 * x - 6 * x**2) / width + acceleration * (3 * x**2 - 4 * x + 1)
    return s, ds, dds


def ramp(
    t: float, code: int, target: float, start_time: float, duration: float, phase: float,
    rate: float, acceleration: float, width: float, cruise: float,
) -> float:  # fmt: skip
    """Evaluate h(t) of a ramp with the profile of this code."""
    s, _, _ = ramp_phase(t, target, start_time, duration, phase, rate, acceleration, width, cruise)
    return profile(code, s)


# --- Blends, see `opspace.stack.Blending` and `opspace.law.blending` ----------------------------------

NO_GROUP, EXACT, CHAINED = range(3)
"""How an activation is blended: not at all, exactly, by the chain. Members of the chain have numbers
of their own: ``CHAINED`` plus a rank that nobody else in it has while they move."""

REACH = 0.1
"""How far the members of a smooth chain lean, as activations. Two lean apart by at most twice this:
nearer to each other than that, they are blended as if either might come first."""


def lean(rank: int) -> float:
    """Direction −1 to 1 that the member with this rank leans in: first the ends, then between them."""
    if rank < 2:
        return 2.0 * rank - 1.0
    x, part, k = 0.0, 0.5, rank - 1
    while k > 0:  # van der Corput: the digits of a number, mirrored
        x += part * (k % 2)
        part *= 0.5
        k //= 2
    return 2.0 * x - 1.0


def leaning(h: float, rank: int, reach: float) -> float:
    """How far an activation leans; never out of [0, 1], and the order of equal leans stays."""
    return 4.0 * reach * lean(rank) * h * (1.0 - h)


def spread(y: float) -> tuple[float, float]:
    """∫ ρ and ∫ y ρ from 0 to y of the density ρ(y) = 6 y (1 − y)."""
    square = y * y
    return square * (3.0 - 2.0 * y), square * y * (2.0 - 1.5 * y)


# --- Joint limits, see `opspace.JointLimits`; everything is counted towards the limit -----------------

RETURN_SPEED = 0.5
"""Speed at which a joint that is outside its limits is brought back, rad/s or m/s."""

CREEP = 2e-4
"""Speed below which nobody hurries, because it may be noise, rad/s or m/s."""
USUAL_PERIOD = 1e-3
"""Time between two ticks where none is given, s."""

PASSED = 5e-5
"""A joint that will come to rest less than this beyond a limit is not told lost: measured speeds are
noisy, rad or m."""
TOO_FAST = 5e-5
"""A joint that is too fast by less loses it before it passes its limit by more, rad/s or m/s."""

LONGEST_LESSON = 0.05
"""Ticks further apart tell nothing about one torque, s."""

ADMISSIBLE, BUFFER = range(2)


class Approach(NamedTuple):
    """How a joint moves towards one of its limits.

    Attributes:
        d: Distance, rad.
        towards: Speed towards the limit, rad/s.
        brake: Acceleration with which the joint can be counted on to brake, rad/s².
        most: Largest speed, rad/s.
    """

    d: float
    towards: float
    brake: float
    most: float


class LimitLaw(NamedTuple):
    """How a joint limit acts.

    Attributes:
        code: Its number in compiled code.
        command: (d, towards, brake, most, k1, k2, kp, buffer) → acceleration towards the limit, rad/s².
        presence: (d, towards, brake, buffer, profile) → activation h of the limit's task set.
        bound: Whether the command is the most that the joint may do, kept by the projection.
    """

    code: int
    command: Callable[[float, float, float, float, float, float, float, float], float]
    presence: Callable[[float, float, float, float, int], float]
    bound: bool

    def commands(
        self, joints: Sequence[Approach], k1: float, k2: float, kp: float, buffer: float
    ) -> list[float]:
        """Evaluate the command of every limit."""
        return [self.command(*joint, k1, k2, kp, buffer) for joint in joints]

    def presences(self, joints: Sequence[Approach], buffer: float, code: int) -> list[float]:
        """Evaluate the activation of every limit, with the profile of this code."""
        return [self.presence(d, towards, brake, buffer, code) for d, towards, brake, _ in joints]

    def hurries(
        self, joints: Sequence[Approach], most: Sequence[float], k1: float, period: float
    ) -> list[tuple[float, float]]:
        """Evaluate `stopping_command` and `last_command` of every limit that is a bound."""
        if not self.bound:
            return [(math.inf, math.inf)] * len(joints)
        return [
            (
                stopping_command(d, towards, brake, braking, k1, period),
                last_command(d, towards, brake, k1),
            )
            if towards > 0.0
            else (math.inf, math.inf)
            for (d, towards, brake, _), braking in zip(joints, most, strict=True)
        ]


EASE = 1.5
"""What is left of an admissible speed where distances may already change twice as fast, m/s."""

SOON = 0.02
"""A distance is lost that would be closing faster than it may within this time, s."""

TICK_ROOM = 1e-4
"""By how much more than the margin distances are kept, for what a tick of a millisecond adds, m."""

ROUNDED = 0.3
"""Part of a direction along an axis of a box from which on the edge there counts as round."""


def allowed_speed(d: float, brake: float, k1: float) -> tuple[float, float]:
    """Evaluate v_adm(d), from which a joint still stops within d, and its slope dv_adm/dd."""
    if d < 0.0:
        x = k1 * d / RETURN_SPEED
        return RETURN_SPEED * math.tanh(x), k1 / math.cosh(min(-x, 300.0)) ** 2
    knee = brake * (1.0 / (k1 * k1))
    if d <= knee:
        return k1 * d, k1
    v = math.sqrt(2.0 * brake * (d - 0.5 * knee))
    return v, brake / v


def admissible_command(
    d: float, towards: float, brake: float, most: float,
    k1: float, k2: float, kp: float, buffer: float,
) -> float:  # fmt: skip
    """Evaluate q̈_adm at distance d and speed ``towards``, for the largest speed ``most``."""
    allowed, slope = allowed_speed(d, brake, k1)
    return min(position_command(towards, allowed, slope, k2), k2 * (most - towards))


def position_command(towards: float, allowed: float, slope: float, k2: float) -> float:
    """Evaluate q̈_adm of a joint that may be as fast as it likes far from its limit.

    Args:
        towards: Speed towards the limit.
        allowed: v_adm(d), see `allowed_speed`.
        slope: dv_adm/dd.
        k2: With which the speed goes to v_adm, 1/s.
    """
    return -towards * slope + k2 * (allowed - towards)


def closing_command(
    d: float, towards: float, own: float, share: float, brake: float, k1: float, k2: float
) -> float:
    """Evaluate how fast two bodies at distance d that close at speed ``towards`` may close faster.

        v̇ ≤ −s v v_adm'(d) + e min(k₂ (1 + (e/`EASE`)⁴), 1/`SOON`),   e = s v_adm(d) − v_own

    The power, where e is above zero, lets what is far and slow change as it likes. Of two that avoid
    each other one has the share s and moves at v_own towards the other; alone s is 1, v_own is v.
    """
    allowed, slope = allowed_speed(d, brake, k1)
    left = share * allowed - own
    ease = max(left, 0.0) / EASE
    return left * min(k2 * (1.0 + ease**4), 1.0 / SOON) - share * towards * slope


def last_closing_command(
    d: float, towards: float, own: float, share: float, brake: float, k1: float, command: float
) -> float:
    """Evaluate how fast two bodies that are told ``command`` may close faster before a speed is lost.

        v̇ ≤ −s v v_adm'(d) + e/`SOON`   for e > 0, see `closing_command`

    With less than that e stays positive from tick to tick, whatever is asked of it.
    """
    allowed, slope = allowed_speed(d, brake, k1)
    left = share * allowed - own
    return left / SOON - share * towards * slope if left > 0.0 else command


TINY = 1e-12
"""What is smaller than another number by this is nothing beside it."""
HOPEFUL = 0.25
"""Part of the brake that every distance counts as asking for where things pass each other, so that one
that nothing can change asks for too much, whatever its bound."""
PASSING = 0.25
"""What moves slower than this past something else counts as asking for less, m/s."""
CREEPING = 1e-3
"""What moves slower than this past something else counts as asking for no less, m/s."""


def asked_for(speed: float, brake: float) -> float:
    """Evaluate what a distance counts as asking for, whatever its bound, m/s².

        ε brake √((v² + v₀²) / (v² + v₁²)),   ε = `HOPEFUL`, v₀ = `CREEPING`, v₁ = `PASSING`

    What passes slowly turns its row slowly, so that it may be held with the smaller means that it needs.

    Args:
        speed: v at which one passes the other, m/s.
        brake: With which distances can be counted on to stop shrinking, m/s².
    """
    square = speed * speed
    return (
        HOPEFUL * brake * math.sqrt((square + CREEPING * CREEPING) / (square + PASSING * PASSING))
    )


def yielding(most: float, reach: float, least: float) -> float:
    """Evaluate how much softer the bound of a distance is that motors cannot keep.

        need = (√(most² + (2 least)²) − most) / 2,   4 max(0, need/reach − 1)²

    need is what a bound below zero asks for, rounded off at zero. The softness is once continuously
    differentiable and grows with the square of need/reach, so that what a bound moves goes to zero with
    what motors can move.

    Args:
        most: The bound, m/s².
        reach: How much motors can change about the distance, m/s²; inf where nobody says.
        least: What it counts as asking for where its bound is zero, above 0, m/s²; see `asked_for`.

    Returns:
        What is added to the softness of the row of unit length; inf where nothing changes the distance.
    """
    if reach == math.inf:
        return 0.0
    # For a bound above zero the difference of two large numbers is avoided.
    size = math.sqrt(most * most + 4.0 * least * least)
    need = 2.0 * least * least / (size + most) if most > 0.0 else 0.5 * (size - most)
    if need <= reach:
        return 0.0
    if reach <= TINY * need:
        return math.inf
    return 4.0 * (need / reach - 1.0) ** 2


def stopping_command(
    d: float, towards: float, brake: float, most: float, k1: float, period: float
) -> float:
    """Evaluate what a joint may do that is faster than v_adm(d), inf where it is not.

        q̈ ≤ −min(v_adm' v² / (v_adm + v_adm' v Δt/2), most)

    Without Δt the joint would stop within v_adm/2 v_adm', which is no more than d: it has to brake at
    once and can let go later. Δt keeps the ratio of v to d from tick to tick, and v from changing its
    sign. ``most`` is what can be had, twice the brake where nothing says so.
    """
    allowed, slope = allowed_speed(d, brake, k1)
    if towards <= max(allowed, 0.0):
        return math.inf
    slope = slope if d >= 0.0 else k1
    ahead = max(allowed, 0.0) + 0.5 * slope * towards * (period if period > 0.0 else USUAL_PERIOD)
    need = slope * towards * towards / (ahead + CREEP)
    return -min(need, most if most < UNBOUNDED else 2.0 * brake)


def last_command(d: float, towards: float, brake: float, k1: float) -> float:
    """Evaluate the most with which a joint that is too fast still does not pass, inf where it is not."""
    allowed, _ = allowed_speed(d, brake, k1)
    if not math.isfinite(d) or towards <= max(allowed, 0.0) + TOO_FAST:
        return math.inf
    return -towards * towards / (2.0 * (max(d, 0.0) + PASSED))


def admissible_presence(
    d: float, towards: float, brake: float, buffer: float, code: int
) -> float:  # fmt: skip
    """No task set stands for the limit: it is a bound."""
    return 0.0


def buffer_command(
    d: float, towards: float, brake: float, most: float,
    k1: float, k2: float, kp: float, buffer: float,
) -> float:  # fmt: skip
    """Evaluate f* of Eq. 24 with the inner edge of a position buffer as target."""
    return kp * (d - buffer) - 2.0 * math.sqrt(kp) * towards


def buffer_presence(d: float, towards: float, brake: float, buffer: float, code: int) -> float:
    """Rise with the position (Fig. 7) from the inner edge, which retreats by v²/2a, to the limit."""
    ahead = max(towards, 0.0)
    inner = buffer + ahead * ahead / (2.0 * brake)
    return profile(code, (d - inner) / (0.0 - inner))


LIMIT_LAWS: Mapping[str, LimitLaw] = MappingProxyType(
    {
        "admissible": LimitLaw(ADMISSIBLE, admissible_command, admissible_presence, bound=True),
        "buffer": LimitLaw(BUFFER, buffer_command, buffer_presence, bound=False),
    }
)
"""``admissible``: a bound on what the stack may ask for, the most that the joint can still brake.
``buffer``: a task set, active by position near the limit, as in Section 4.2 of the paper."""


def limit_command(
    code: int, d: float, towards: float, brake: float, most: float,
    k1: float, k2: float, kp: float, buffer: float,
) -> float:  # fmt: skip
    """Evaluate the command of the law with this code."""
    if code == BUFFER:
        return buffer_command(d, towards, brake, most, k1, k2, kp, buffer)
    return admissible_command(d, towards, brake, most, k1, k2, kp, buffer)


def limit_presence(
    code: int, d: float, towards: float, brake: float, buffer: float, profile_code: int
) -> float:
    """Evaluate the activation of the law with this code."""
    if code == BUFFER:
        return buffer_presence(d, towards, brake, buffer, profile_code)
    return admissible_presence(d, towards, brake, buffer, profile_code)


# --- Tracking ----------------------------------------------------------------------------------------

BRANCH_HOLD = 0.25 * math.pi
"""How far past half a turn the direction chosen before is kept, rad. Noise and overshoot near half a
turn are far smaller; at a full turn the direction would be lost, so it cannot be kept for ever."""

BRANCH_END = 0.75 * math.pi
"""How far past half a turn the error has become that of the short way, rad."""

LONGEST_WAY = math.cos(0.5 * (math.pi + BRANCH_END))

FOLLOWED = math.cos(0.5 * 1.0)
"""A rotation that differs by more than 1 rad from the one before is no motion but a new target or a
new state, and takes the short way."""

LARGEST_STEP = 0.05
"""A target that moves by more than this from one tick to the next, rad, is another target: a reference
at 1 kHz moves by thousandths of it, and one that a person assigns anew by far more."""

SIGNS = 48
"""Signs that are remembered as the bits of one whole number, exact as a floating-point number, too."""


def goes_on(agreement: float, w: float) -> bool:
    """Tell whether a rotation error goes on the long way round.

    Args:
        agreement: Product of its unit quaternion, w >= 0, with the one before.
        w: Its real part; that of the long way round, cos(angle / 2), is −w.
    """
    return agreement < -FOLLOWED and -w >= LONGEST_WAY


def error_length(angle: float) -> float:
    """Length of the error of a rotation that has gone this far about its axis, rad.

    It is the angle up to ``BRANCH_HOLD`` past half a turn. Then it falls through zero, smoothly, and
    from ``BRANCH_END`` on it is angle − 2π: the same vector as that of the short way, to which one
    can therefore change without a step. Where it is zero the task asks for nothing: it has to be so
    somewhere on the way from one direction to the other.

    Args:
        angle: Angle, 0 to 2π, rad.
    """
    past = angle - math.pi - BRANCH_HOLD
    if past <= 0.0:
        return angle
    return angle - 2.0 * math.pi * profile(QUINTIC, past / (BRANCH_END - BRANCH_HOLD))


def without_turns(error: float, known: bool, negative: bool) -> float:
    """Error of a joint that turns without end, less whole turns.

    It is the short way, at most half a turn; past half a turn the direction chosen before goes on, as
    that of a rotation does.

    Args:
        error: x_d − x, rad.
        known: Whether the direction chosen before is known.
        negative: Whether that error was below zero.
    """
    short = error
    if abs(error) > math.pi:
        short = error - 2.0 * math.pi * math.ceil(error / (2.0 * math.pi) - 0.5)
    if known and negative != (short < 0.0):
        long = short - 2.0 * math.pi if negative else short + 2.0 * math.pi
        if abs(long) <= math.pi + BRANCH_HOLD:
            return long
    return short


def speed_scale(speed: float, limit: float) -> float:
    """Factor on the error with which kp/kv · error is no faster than the limit (Khatib 1987)."""
    return limit / speed if speed > limit else 1.0


# --- Contact of a force task, see `opspace.tasks.force` -----------------------------------------------

RISE, FALL = 0.01, 0.03
"""Time constants of the confidence when it grows and when it shrinks, s."""
FOLLOW = 0.02
"""Time constant with which what follows the tool follows it in contact, s."""
LONGEST_TICK = 0.1
"""A pause longer than this is none between two ticks, s."""
WRENCH_FILTER = 0.003
"""Time constant of the measured wrench, s."""
FRICTION_FILTER = 0.03
"""Time constant of the force along the surface that is fed through, s: where the tool sticks this is a
loop, and the lag is what keeps it slow."""
SLIDING_SPEED = 0.02
"""Speed along a surface from which the direction of sliding is known, m/s."""
UNLOAD = 0.1
"""Time constant with which the integral empties out of contact, s."""
STALE_AFTER = 0.01
"""Without a new wrench for so long, what was measured last counts for nothing any more, s."""
LEVER = 0.1
"""Moment that counts like a force, over that force, m."""
LIGHTEST = 1e-9
"""A row that moves less than this mass in the inverse needs no damping of its own, 1/kg."""


def passed(t: float, before: float) -> float:
    """Time between two ticks, 0 where it is not one tick's."""
    dt = t - before
    return dt if 0.0 < dt <= LONGEST_TICK else 0.0


def lag(dt: float, time: float) -> float:
    """Part of the way that a first-order lag with this time constant goes in a tick, 0 to 1."""
    return dt / (time + dt)


def is_fresh(age: float) -> bool:
    """Tell whether a wrench of this age [s] counts."""
    # Times are sums of floating-point numbers: a millionth more is no time.
    return age <= STALE_AFTER * (1.0 + 1e-6)


def confidence(c: float, force: float, off: float, on: float, dt: float) -> float:
    """How sure it is that something is touched, one tick later: continuous in time whatever comes.

        c ← c + Δt/(τ + Δt) (P((F − off)/(on − off)) − c)

    P is the quintic profile, τ is `RISE` while c grows and `FALL` while it shrinks.

    Args:
        c: Confidence of the tick before.
        force: Measured force, N.
        off: Force at and below which nothing is touched, N.
        on: Force at and above which the touch is certain, N.
        dt: Time since the tick before, s.
    """
    wanted = profile(QUINTIC, (force - off) / (on - off))
    return c + lag(dt, RISE if wanted > c else FALL) * (wanted - c)


def floor_of(floor: float, travel: float, c: float, beyond: float, dt: float) -> float:
    """Where the surface was felt last along the way in, one tick later: ṡ_f = c (s − s_f)/τ, m.

    Infinite before the first touch; it begins ``beyond`` [m] behind the tool.
    """
    if c <= 0.0:
        return floor
    if math.isinf(floor):
        floor = travel + beyond
    return floor + c * lag(dt, FOLLOW) * (travel - floor)


def approach(floor: float, reach: float, travel: float, most: float, slope: float) -> float:
    """Speed v_a = clip(k (s_f + reach − s), ± v) with the slope k [1/s], m/s."""
    return min(max(slope * (floor + reach - travel), -most), most)


def integral_after(
    integral: float, missing: float, force: float, bound: float, ki: float, c: float, dt: float
) -> float:
    """İ = c K_i clip(F_d − F_m, ±|F_d|) − (1 − c) I/`UNLOAD`, one tick later, within ± ``bound``.

    An impact of many times the force, of a few milliseconds, must not unwind it.
    """
    most = bound if force == 0.0 else abs(force)
    grown = c * ki * min(max(missing, -most), most)
    emptied = (1.0 - c) / UNLOAD * integral
    return min(max(integral + dt * (grown - emptied), -bound), bound)


# --- Levels, motors, bounds --------------------------------------------------------------------------

RANK_TOLERANCE = 1e-8
"""Singular values of a projected level below this fraction of the level's largest unprojected one
are rounding noise of the projection: 16 digits, halved by ill-conditioned levels above."""

SHARE = 0.95
"""Part of the torque that is left which a level may use. The rest is for the levels below: without it
a level below would be all there or not at all as its torque at a saturated joint changes sign."""

SCALED = 1e-12
"""A level that gets less than one by more than this has given way."""

LEVEL_RATIO = 10.0
"""How much more an acceleration of a level counts than one of the level below, where not all can be
had. A larger ratio protects the upper levels more, and makes the answer steeper: it turns into one law
after the other, which is not continuous."""
MOST_WEIGHT = 1e3
"""No level counts more than this times the last one, or the answer becomes as steep as with a larger
ratio."""


def level_weight(below: float) -> float:
    """Weight of a level with this many levels below it, those on their way counted in part."""
    return min(LEVEL_RATIO**below, MOST_WEIGHT)


TURN_PER_METRE = 1.0 / 0.3
"""A task in radians is as near its target with so many times the error of one in metres, rad/m."""
HURRY = 1.0 / 3.0
"""What goes from anything but rest to its target in 1/HURRY seconds moves fast, 1/s."""
REST_TIME = 0.3
"""Time constant with which a row is taken for one at rest, and for one that is not, s."""
MOST_UNREST = 2.0
"""More than this is not remembered: a level is anything but at rest from 1."""
REST_LOWER, REST_RELEASE, REST_UPPER = 0.2, 0.6, 1.0
"""Edges of the buffers at rest, as multiples of the lower edge of those in motion."""
LEFT = 0.5
"""Part of what a limit allows its joint that levels may use which are not the first."""
UNSEEN = 1e5
"""How much more an acceleration counts that levels above see than one that they do not: these may give
way to a limit before the others by so much."""
ROOM_SOFT = 7e-3
"""A limit whose joint the levels below move by less than this part of its mobility is hardly any of
theirs: what they would have to do about it grows without end as that part goes to zero."""
ROOM_CLEANINGS = 8
"""How often they are projected, each time on what softness left before: one joint of which they have
the part s keeps (ROOM_SOFT / (s + ROOM_SOFT))⁸ of its excess."""

SOFT = 1e-7
"""How soft bounds on accelerations are; where they contradict each other or the motors, the excess is
shared."""
SOFT_APART = 1.5e-2
"""How soft bounds on distances are in the first projections: where rows of neighbouring balls are nearly
one, the answer goes from one to the other over as much of their difference. What is left of an excess is
small then, and projected away with harder bounds."""
SOFT_AFTER = 1e-3
"""How soft bounds on distances are then: where one contradicts a joint's bound, as a body that drives an
arm against its limits does, it is the distance that gives way, to all but a ten-thousandth."""
HANDOVERS = 2
"""How many projections are as soft."""
CLEANINGS = 3
"""How often the projection is made: each one starts from the answer of the one before, and what that
left of an excess because its bounds are soft becomes smaller by their softness."""


def hardened(softness: float) -> float:
    """Softness of a bound after `HANDOVERS` projections; only distances are as soft as `SOFT_APART`."""
    return softness - SOFT_APART + SOFT_AFTER if softness >= SOFT_APART else softness


HARD = 1e-12
"""How soft bounds on torques are: softer than rounding, harder than those on accelerations."""
ROUNDING = 1e-13
"""A bound that is broken by less than this part of the numbers involved is kept."""
BROKEN = 1e-9
"""A bound is broken by more than this part of itself, or by more than this."""
LOST = 1e-3
"""A bound that is still broken by more than this part of itself, or by more than this, is lost."""
LOOKS = 6
"""How often the middle of a tick is looked at, at most."""
SEEN = 1e-4
"""What joints do more in the middle of a tick is known to this part of itself, or to this, rad/s²."""


NO_DISTANCE = 1e-3
"""Centres of balls that come closer than this are in each other; no distance of theirs is left, m."""


def room_for(part: np.ndarray, torque: np.ndarray, limit: np.ndarray) -> float:
    """Largest s in [0, 1] with which every joint stays inside its share of what is left.

        s = min(1, min_j SHARE (limit_j ∓ Γ_j) / |γ_j|),   the room in the direction of γ_j

    s is continuous in Γ and γ as long as there is room, and s γ leaves at least 1 − SHARE of it; so a
    chain of levels is continuous wherever the torque that it starts from is inside the limits. A level
    that adds nothing takes nothing, whence levels may come and go.

    Args:
        part: (n,) torque γ that a level adds, N·m.
        torque: (n,) torque Γ before it, inside the limits, N·m.
        limit: (n,) largest torque of each joint, N·m; inf where there is none.

    Returns:
        s.
    """
    s = 1.0
    for j in range(part.shape[0]):
        if part[j] >= 0.0:
            room, asked = SHARE * (limit[j] - torque[j]), part[j]
        else:
            room, asked = SHARE * (limit[j] + torque[j]), -part[j]
        if asked > room:
            s = min(s, room / asked)
    return s


# --- Contacts of a floating base, see `opspace.law.contact_forces` ----------------------------------

STILLING = 20.0
"""Rate at which what is left of a contact's motion is taken away, 1/s."""
NEARNESS = 3e-2
"""How much the nearness of the forces counts beside that of the motion: it keeps the answer from
turning sharply where a limit comes to act, and costs nothing while none does."""
LEAST_REGULAR = 1e-9
"""Part of the trace that is added where forces are shared, and refined away again."""
REFINEMENTS = 2
UNMOVED = 1e-10
"""A bound whose row the equations of motion leave less of than this part is out of reach."""
MOTOR_SOFT = 1e-10
"""How soft bounds on torques are beside cones, which are physics."""
ENTERING = 100.0 * MOST_WEIGHT
"""Weight in the metric of a contact on its way in."""
HARDEST = 1e4
"""Where h/(1 − h) ends, with which that grows."""
MAY_GIVE_UP = 0.01
"""Part of the weight that a removal may cost before the contact waits."""
BARELY = 1e-6
"""Part of the largest force below which nothing presses."""
NOTICED, FALLING = 1e-3, 0.3
"""Parts of the weight from which a wrench counts as given up, and from which the robot falls."""


def entering_weight(h: float) -> float:
    """Weigh in the metric the rows of a contact that is on its way in, at 0 < h < 1."""
    return ENTERING * min(h / (1.0 - h), HARDEST)
