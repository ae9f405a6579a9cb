"""What a tick has of tasks that are led to their targets on ways."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.kernels.led_columns import GOAL_SIZE
from opspace.law.way_columns import WAY_SIZE
from opspace.machine.field_table import Field, RecordTable

_told = partial(Field, writer="refresh", lives="plan")
_kept = partial(Field, writer="refresh, tick", lives="kept")
_whole = partial(_kept, dtype=np.int64)

LED = RecordTable(
    "Led",
    "Ways of tasks to their targets, in the order of the plan. See `opspace.kernels.led_goals`.",
    _told(
        "pace",
        ("led", 4),
        "largest speed and acceleration, those of a pose's turn after those of its place; 0 for no way",
        "m/s, m/s², rad/s, rad/s²",
    ),
    _whole(
        "asked", ("led",), "where a way is to begin, see `opspace.kernels.led_columns`; 0 for none"
    ),
    _whole("on", ("led",), "whether a task is on a way, or has come to its end"),
    _told(
        "asked_goal",
        ("led", GOAL_SIZE),
        "where a way that is asked for goes: a rotation by rows, a position",
        "m",
    ),
    _told("joint_asked", ("led_rows",), "the same of a task of joints", "rad, m"),
    _kept("goal", ("led", GOAL_SIZE), "where the way goes that has begun", "m"),
    _kept("joint_goal", ("led_rows",), "the same of a task of joints", "rad, m"),
    _told("more", ("led", 6), "what integral action adds to its acceleration", "m/s², rad/s²"),
    _told("joint_more", ("led_rows",), "the same of a task of joints", "rad/s², m/s²"),
    _kept("begun", ("led",), "when its way began", "s"),
    _kept("ends", ("led", 2), "when place and turn arrive", "s"),
    _kept("most", ("led", 2), "their largest acceleration", "m/s², rad/s²"),
    _kept("parts", ("led", 6, WAY_SIZE), "its way, three coordinates of place and three of turn"),
    _kept("start", ("led", 9), "orientation where that began, by rows"),
    _kept("joint_parts", ("led_rows", WAY_SIZE), "the ways of joints"),
    Field("place", (6, 3), "how far a way has come, its speed and its acceleration"),
    Field("joint_place", ("led_rows", 3), "the same of joints", "rad, m"),
)
