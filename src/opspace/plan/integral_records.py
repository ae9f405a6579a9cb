"""What integral action remembers of the tasks of a plan."""

from __future__ import annotations

from functools import partial

from opspace.machine.field_table import Field, RecordTable

_given = partial(Field, writer="caller", lives="plan")
_kept = partial(Field, writer="caller, tick", lives="kept")

INTEGRALS = RecordTable(
    "Integrals",
    "Integral action of tasks, in the order of the plan.",
    _given("ki", ("tasks",), "integral gain, 0 for none", "1/s³"),
    _given("max_integral", ("tasks",), "error whose pull the integral adds at most", "m, rad"),
    _kept("integral", ("tasks", 6), "what it adds to tasks of motion", "m/s², rad/s²"),
    _kept("joint_integral", ("rows",), "what it adds to tasks of joints", "rad/s², m/s²"),
    Field("learned", ("rows",), "errors that it adds up in this tick", "m, rad"),
    _given("since", (1,), "time since the tick before", "s"),
)
