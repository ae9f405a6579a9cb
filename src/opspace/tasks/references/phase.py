"""The minimum-jerk phase that moves from 0 to 1."""

from __future__ import annotations


def minimum_jerk_phase(t: float, start_time: float, duration: float) -> tuple[float, float, float]:
    """Return s = 10 u³ − 15 u⁴ + 6 u⁵ of u = (t − start_time) / duration, and its rates.

    Before the start s is 0, after the end 1; velocity and acceleration are zero at both ends.

    Args:
        t: Time, s.
        start_time: Time at which s leaves 0, s.
        duration: Time that s takes, s.

    Returns:
        s, ds/dt in 1/s, d²s/dt² in 1/s².
    """
    u = (t - start_time) / duration
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    rest = 1.0 - u
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    rate = 30.0 * (u * rest) ** 2 / duration
    curvature = 60.0 * u * rest * (rest - u) / duration**2
    return s, rate, curvature
