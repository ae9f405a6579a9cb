"""Activation profiles and ramps by number."""

from __future__ import annotations

import math

from opspace.law.activation import PROFILES
from opspace.machine.jit import jit

LINEAR, CUBIC, QUINTIC, HALF_SINE, TANH, STEP = range(6)

PROFILE_CODE = {name: code for code, name in enumerate(PROFILES)}
"""Number of each profile by name."""


@jit
def profile(code, s):
    """Evaluate h(s) of `opspace.law.Profile`, clamped to [0, 1]."""
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
    return min(max(h, 0.0), 1.0)


@jit
def _tanh(s):
    if not 4e-3 < s < 1.0 - 4e-3:
        return 1.0 if s > 0.5 else 0.0
    return 0.5 * (1.0 + math.tanh(1.0 / (1.0 - s) - 1.0 / s))


@jit
def ramp(t, code, target, start_time, duration, phase, rate, acceleration, width, cruise):
    """Evaluate h(t) of `opspace.law.Ramp`, whose fields these are."""
    tau = max(t - start_time, 0.0)
    if tau >= duration:
        return target
    if tau >= width:
        covered = width * ((rate + cruise) / 2.0 + width * acceleration / 12.0)
        return profile(code, phase + covered + cruise * (tau - width))
    x = tau / width
    s = phase + width * (
        rate * (x**4 / 2 - x**3 + x)
        + acceleration * width * (x**4 / 4 - 2 * x**3 / 3 + x**2 / 2)
        + cruise * (x**3 - x**4 / 2)
    )
    return profile(code, s)
