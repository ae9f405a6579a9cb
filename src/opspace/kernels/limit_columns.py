"""Columns of ``Tick.limit``: side, rad, rad/s², rad/s², rad/s², rad/s, rad/s²."""

from __future__ import annotations

SIGN, POSITION, BRAKE, MARGIN, COMMAND, SPEED, DISTURBANCE = range(7)
