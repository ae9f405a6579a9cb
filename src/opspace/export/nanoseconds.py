"""Time as other programs count it."""

from __future__ import annotations

import numpy as np

from opspace.errors import InputError
from opspace.record import Recording

_LAST = 2.0**63 * 1e-9


def nanoseconds(recording: Recording) -> np.ndarray:
    """Return the time of each row, to the nearest nanosecond.

    Args:
        recording: The run.

    Returns:
        (T,) int64, nanoseconds.

    Raises:
        InputError: A time is not finite, below zero or beyond 292 years.
        UnknownNameError: The recording has no column ``t``.
    """
    bad = ~((recording.t >= 0.0) & (recording.t < _LAST))
    if bad.any():
        row = int(bad.argmax())
        raise InputError(
            f"{recording.directory}: t = {recording.t[row]} s in row {row} is no time that this "
            "format can hold"
        )
    return np.rint(recording.t * 1e9).astype(np.int64)
