"""What a quiet tick reads and writes beside a plan."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.machine.field_table import Field, RecordTable

_kept = partial(Field, writer="caller, tick", lives="kept")

QUIET = RecordTable(
    "Quiet",
    "What tells whether a tick needs no look by Python, shared with whoever decides that.",
    _kept("times", (2,), "of the last tick, and before which nothing begins", "s"),
    _kept("watch", ("watched",), "of the watchdog, see `opspace.kernels.quiet_columns`", "s"),
    _kept("last_q", ("last_nq",), "configuration that it saw last", "rad, m"),
    _kept("last_v", ("last_n",), "velocity that it saw last", "rad/s, m/s"),
    _kept("behind", (1,), "not 0 where the robot's library has another state", dtype=np.int64),
)
