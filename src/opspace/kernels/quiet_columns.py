"""Entries of the arrays that tell whether a tick is quiet, see `opspace.plan.quiet_records`."""

from __future__ import annotations

# Quiet.times: of the last tick, NaN before the first; and before which nothing begins by itself.
NOW, NEXT = range(2)
# Quiet.watch: time of the last tick, NaN for none; what may have passed since, more than and at most.
LAST, SHORTEST, LONGEST = range(3)

LOOK_FIRST = -4
"""What such a tick answers where it leaves everything to Python, beside what any tick answers."""
