"""Scalar laws and numbers that the readable and the compiled form share; each stands here once."""

from __future__ import annotations

import math

# How far past half a turn the direction chosen before is kept, rad. Noise and overshoot near half
# a turn are far smaller; at a full turn the direction would be lost, so it cannot be kept for ever.
BRANCH_HOLD = 0.5 * math.pi

LIMIT_PASSES = 4
"""How often joint limits are inserted with the accelerations just found; each pass can find the
joints that the ones before pushed against their own limits."""

LAST_BITS = 1e-9
"""What differs by less of itself, or by less than this, is the same."""


def rises(x: float, before: float) -> bool:
    """Tell whether a number is larger than before by more than its last bits."""
    return x - before > LAST_BITS * max(1.0, abs(x))
