"""Columns of ``Tick.limit``.

Side, rad, rad/s², rad/s², rad/s², rad/s, rad/s², then rad/s² as the others.
"""

from __future__ import annotations

SIGN, POSITION, BRAKE, MARGIN, COMMAND = range(5)
SPEED, DISTURBANCE, HASTE, LAST, SHIFT = range(5, 10)
BY_POSITION = 10
