"""What cycles without Python read and write beside a plan."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.kernels.columns import KIND_SIZE, NUMBERS_SIZE
from opspace.kernels.cycle_columns import COUNTS, NUMBERS, WHOLES
from opspace.kernels.led_columns import GOAL_SIZE
from opspace.machine.field_table import Field, RecordTable

_INT = np.int64
_caller = partial(Field, writer="caller")
_own = partial(Field, lives="kept")

CYCLES = RecordTable(
    "Cycles",
    "What a loop without Python has beside its plan. State and command lie in memory that the robot's "
    "program sees, too: a number that is odd while they are written, their words, and the sum of these.",
    _caller("asked", (1,), "not 0 where Python wants the loop back", dtype=_INT),
    _caller("wanted", (1,), "what driver and robot want of each other", dtype=_INT),
    _caller(
        "state",
        ("told + 2",),
        "t, q, v and the accepted torque, as the robot writes them",
        dtype=_INT,
    ),
    _own("command", ("n + 2",), "the command, as the robot reads it", dtype=_INT),
    _own("read", ("told",), "the last state", "s, rad, rad/s, N·m"),
    _own("read_words", ("told",), "its words: the same memory", dtype=_INT),
    _own("tau", ("n",), "the command that is being made", "N·m"),
    _own("tau_words", ("n",), "its words: the same memory", dtype=_INT),
    _own("before", ("n",), "the command before", "N·m"),
    _caller("step", ("n",), "the most by which a command differs from the one accepted", "N·m"),
    _own("whole", (WHOLES,), "whole numbers, see `opspace.kernels.cycle_columns`", dtype=_INT),
    _own("number", (NUMBERS,), "numbers, see there", "s"),
    _own("count", (COUNTS,), "what is counted, see there", dtype=_INT),
    _own("frozen_for_too_long", (1,), "not 0 where the state is the same for too long", dtype=_INT),
    _own("time", (4,), "seconds and nanoseconds: what the clock told, and a nap", dtype=_INT),
    _caller("address", (2,), "where these two are", dtype=_INT),
    _own("ring", ("ring", "2 n + nq + 3"), "the last cycles, see `opspace.loop.history.History`"),
    _caller(
        "mail", (2,), "number of the letter that follows, and of the last one taken", dtype=_INT
    ),
    _caller("goal", ("rows", 3), "as in the plan", "rad, rad/s, rad/s²"),
    _caller("kp", ("rows",), "as in the plan", "1/s²"),
    _caller("kv", ("rows",), "as in the plan", "1/s"),
    _caller("kind", ("tasks", KIND_SIZE), "as in the plan, for what limits the speed", dtype=_INT),
    _caller("numbers", ("tasks", NUMBERS_SIZE), "as in the plan, for goals and speeds"),
    _caller("forgets", ("tasks",), "not 0 where angles take the short way", dtype=_INT),
    _caller("pace", ("led", 4), "as in `opspace.plan.led_records.LED`"),
    _caller("asked_way", ("led",), "where a new way is to begin, 0 for none", dtype=_INT),
    _caller("way_goal", ("led", GOAL_SIZE), "where it goes", "m"),
    _caller("joint_way_goal", ("led_rows",), "the same of a task of joints", "rad, m"),
)
