"""Scalar laws and numbers that the readable and the compiled form share; each stands here once."""

from __future__ import annotations

import math

# How far past half a turn the direction chosen before is kept, rad. Noise and overshoot near half
# a turn are far smaller; at a full turn the direction would be lost, so it cannot be kept for ever.
BRANCH_HOLD = 0.5 * math.pi
