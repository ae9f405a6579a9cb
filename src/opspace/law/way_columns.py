"""Columns of a coordinate that is on a way to a target."""

from __future__ import annotations

BEGAN, SPEED, ACCELERATION, MIRROR, AWAY, PUSH, TOP, STAY, END = range(9)
"""Its first value; its first speed and acceleration, along and across the way; the normal of the mirror
between the task's axes and those; how far it goes; its motion, as `opspace.law.swift_motion` has planned
it, and how long that takes."""
WAY_SIZE = 9

NO_MIRROR = 1e-30
"""Square of the normal, before it is one, below which the way goes along the first axis."""
