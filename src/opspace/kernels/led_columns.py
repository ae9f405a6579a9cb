"""What the numbers of tasks mean that are led to their targets on ways."""

from __future__ import annotations

FROM_FOLLOWED, FROM_FOUND = 1, 2
"""Where a way that is asked for begins: with what is desired until now, or with what the robot has."""

GOAL_TURN, GOAL_PLACE = 0, 9
"""Columns of ``Led.goal`` and ``Led.asked_goal``: a rotation by rows, then a position."""
GOAL_SIZE = 12
