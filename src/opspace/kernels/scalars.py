"""Scalar laws of `opspace.law.scalars`, compiled."""

from __future__ import annotations

from opspace.law import scalars
from opspace.machine.jit import jit

rises = jit(scalars.rises)
"""`opspace.law.scalars.rises`."""
