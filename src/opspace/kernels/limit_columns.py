"""Columns of ``Tick.limit``.

Side, rad, rad/s², rad/s², rad/s², rad/s, rad/s², then rad/s² as the others.
"""

from __future__ import annotations

SIGN, POSITION, BRAKE, MARGIN, COMMAND, SPEED, DISTURBANCE, HASTE, LAST, SHIFT = range(10)
