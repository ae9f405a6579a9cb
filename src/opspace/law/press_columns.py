"""What a force task remembers, number by number in one row; the readable form and the kernels share it.

Places of N, N·m, s, m, m/s and 1/kg as `opspace.tasks.force` uses them; wrenches and rows have six.
"""

# pyright: strict
from __future__ import annotations

# Time of the last tick, whether there was one, and when the wrench was given; PASSED is how long the
# last tick came after the one before.
WHEN, BEGUN, GIVEN_AT = 0, 1, 2
# Whether the integral stays what it is, and whether the wrench is fresh.
FROZEN, FRESH = 3, 4
CONFIDENCE, FLOOR, SIGMA, SPEED, TRAVEL = 5, 6, 7, 8, 9
# Confidence, travel and direction of the tick before.
EARLIER, EARLIER_TRAVEL, EARLIER_AHEAD = 10, 11, 12
GIVEN = 15
WRENCH = 21
ALONG = 27
AHEAD = 30
INTEGRAL = 33
PUSH = 39
MEASURED = 45
COMMANDED = 51
PASSED = 57
SLIDING = 58
MEMORY_SIZE = 61

# What it was built with, behind what it remembers.
FORCES, FRICTION = 61, 62
KI, KP, MAX_INTEGRAL = 63, 64, 65
APPROACH_SPEED, FORCE_RATE, FOLLOWED = 66, 67, 68
OFF, ON = 69, 70
WANTED = 71
PRESS_SIZE = 77
