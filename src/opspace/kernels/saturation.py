"""Torque limits that keep priority, compiled; see `opspace.law.saturation`."""

from __future__ import annotations

from opspace.law import saturation
from opspace.machine.jit import jit

room_for = jit(saturation.room_for)
"""`opspace.law.saturation.room_for`."""
