"""What the places in the arrays of compiled cycles mean, and why cycles end."""

from __future__ import annotations

ASKED, SILENT, FROZEN, JUMPED, BRAKED, STOPPED, OVER = range(1, 8)
"""Python is wanted; no state has come for too long; it is always the same; its time has jumped; the
robot has braked; a status ends the loop; the time is over."""

CYCLES, MISSED, OLD, LATE, STALE, JUMPS, LIMITED, OVERRUNS = range(8)
"""What is counted, as in `opspace.loop.loop_report.Counts`."""
COUNTS = 8

SEEN, SENT, FROZEN_FOR, RING, STATUSES, CLOCK, NAP, ADDS, STOP_ON, FAULT = range(10)
"""Whole numbers: what the state and the command have in their first word; states alike in a row; rows of
the ring that have been written; every status there was; the clock's number; nanoseconds to sleep,
0 for none; whether the robot adds gravity; statuses that end it; what a robot writes that has braked."""
WHOLES = 10

PERIOD, PATIENCE, LAST, HEARD, ENDS, LATE_AFTER, JUMP_AFTER, WOKE = range(8)
"""Numbers, s: period; how long to wait; time of the last state, and the computer's when it came; time of
the states at which to end; periods after which one is late, or has jumped; when the last one came."""
NUMBERS = 8
