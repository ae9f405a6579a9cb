"""The record of the distances that a tick keeps: balls, convex sets, and a row for each pair."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.machine.field_table import Field, RecordTable

_INT = np.int64
_plan = partial(Field, writer="plan", lives="plan")
_refresh = partial(Field, writer="plan, refresh", lives="plan")

DISTANCES = RecordTable(
    "Distances",
    "Balls of the robot and convex sets that they keep away from, see `opspace.law.convex`; obstacles "
    "are the last ones and stand in the world.",
    _plan("limits", (4,), "margin, k1, k2 and brake", "m, 1/s, m/s²"),
    _plan("ball_place", ("balls", 2), "body and joint of each ball, −1 for none", dtype=_INT),
    _plan("ball", ("balls", 4), "its centre on the body, and its radius", "m"),
    _plan("set_place", ("sets", 2), "body and joint of each set, −1 for none", dtype=_INT),
    _refresh("set_local", ("sets", 12), "its rotation on the body by columns, its position", "m"),
    _plan("extent", ("sets", 7), "where it begins and ends, and by how much it is grown", "m"),
    _plan("mesh", ("sets", 2), "first of its faces, and how many; none of a box", dtype=_INT),
    _plan(
        "face", ("faces", 12), "three corners and the normal of each, in the axes of its set", "m"
    ),
    _plan("motors", ("n",), "what the motors give, inf where nobody says", "N·m", start=np.inf),
    _plan("share", ("sets",), "of what closes, for the robot; 0 where the set just goes on"),
    _refresh("twist", ("sets", 6), "motion of an obstacle at its origin", "m/s, rad/s"),
    _plan("row", ("distances", 2), "a ball and a set each", dtype=_INT),
    Field("ball_motion", ("balls", 9), "where it is, its velocity and drift", "m, m/s, m/s²"),
    Field("set_axes", ("sets", 12), "rotation by columns, position", "m"),
    Field("set_motion", ("sets", 12), "motion at the origin of the world, and its rate"),
    Field("G", ("distances", "n"), "by how much accelerations let each shrink faster"),
    Field("most", ("distances",), "how fast that may be", "m/s²"),
    Field("last", ("distances",), "how fast before it closes faster than it may", "m/s²"),
    Field("asked", ("distances",), "what each counts as asking for", "m/s²"),
    Field("way", ("n",), "what changes a distance"),
    Field("held", ("distances",), "whether the projection has taken it in", dtype=_INT),
)
