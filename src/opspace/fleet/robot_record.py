"""What one robot of a fleet is told and remembers, beside the arrays of its tick."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.fleet.led_targets import TOLD_SIZE
from opspace.law.way_columns import WAY_SIZE
from opspace.machine.field_table import Field, RecordTable

_given = partial(Field, writer="caller")
_whole = partial(Field, writer="caller", dtype=np.int64)

ROBOT = RecordTable(
    "Robot",
    "One robot of a fleet; its tasks are in the order of the plan.",
    _given(
        "target", ("tasks", 7), "target position, then quaternion wxyz, of tasks of motion", "m"
    ),
    _given("velocity", ("tasks", 6), "its rate", "m/s, rad/s"),
    _given("acceleration", ("tasks", 6), "the rate of that", "m/s², rad/s²"),
    _given("stiffness", ("rows",), "K of the springs of tasks that are some", "N/m, N·m/rad"),
    _given("spring_force", ("rows",), "force beside it", "N, N·m"),
    _given("damping_ratio", ("tasks",), "ζ of each spring, 1 is critical"),
    _given("pose", ("given", 7), "given motion of a task: position, quaternion wxyz", "m"),
    _given("jacobian", ("given", 6, "n"), "its Jacobian, linear rows first", "m, 1"),
    _given("drift", ("given", 6), "J̇ q̇ of it", "m/s², rad/s²"),
    _given("joint_target", ("rows",), "target of tasks of joints", "rad, m"),
    _given("joint_velocity", ("rows",), "its rate", "rad/s, m/s"),
    _given("joint_acceleration", ("rows",), "the rate of that", "rad/s², m/s²"),
    _given(
        "limit_rest", ("limits",), "what seven digits leave of the positions of limits", "m, rad"
    ),
    _given("ki", ("tasks",), "integral gain, 0 for none", "1/s³"),
    _given("max_integral", ("tasks",), "error whose pull the integral adds at most", "m, rad"),
    _given("integral", ("tasks", 6), "what it adds to tasks of motion", "m/s², rad/s²"),
    _given("joint_integral", ("rows",), "what it adds to tasks of joints", "rad/s², m/s²"),
    _given("wrench", ("tasks", 6), "measured wrench of force tasks, on the environment", "N, N·m"),
    _given(
        "contact",
        ("tasks", 2),
        "forces between which confidence rises, or 0",
        "N",
    ),
    _whole("fresh", ("tasks",), "whether it has been measured since the tick before"),
    _given("learned", ("rows",), "errors that it adds up in this tick", "m, rad"),
    _given("since", (1,), "time since the tick before", "s"),
    _whole("epoch", ("tasks",), "how often the task has begun, as its owner counts"),
    _whole("seen", ("tasks",), "the same, as far as the robot has noticed"),
    _whole("holds", ("tasks",), "whether the task holds what it finds when it begins"),
    _whole("found", ("tasks",), "whether it has found that in this tick"),
    _whole("remembers", ("tasks",), "whether the way round is known"),
    _given("turn", ("tasks", 4), "which it was, as in ``TURN``"),
    _given("before", ("tasks", 4), "target orientation of the tick before, quaternion wxyz"),
    _given("joint_before", ("rows",), "joint targets of the tick before", "rad, m"),
    _whole("status", (1,), "what happened, in the numbers of `opspace.Status`"),
    _whole("solves", (1,), "hard torques that were computed"),
)

WAYS = RecordTable(
    "Ways",
    "The ways of one robot of a fleet to new targets, of all its tasks where any has one.",
    _given("pace", ("ways", 4), "speed and acceleration of a task's ways, of a turn after that"),
    _given("age", ("ways",), "time since its way began", "s"),
    _given("told", ("ways", TOLD_SIZE), "what a task of motion was told last"),
    _given("goal", ("ways", TOLD_SIZE), "what it is told in this tick"),
    _given("parts", ("ways", 6, WAY_SIZE), "its way, three coordinates of place and three of turn"),
    _given("turned", ("ways", 4), "orientation where that began, quaternion wxyz"),
    _given("place", ("ways", 6, 3), "where it is beside that, its speed and acceleration"),
    _given("joint_told", ("way_rows", 3), "what tasks of joints were told last", "rad, m"),
    _given("joint_parts", ("way_rows", WAY_SIZE), "their ways"),
    _given("joint_place", ("way_rows", 3), "where they are, as ``place``", "rad, m"),
    _whole("known", ("ways",), "whether the task has been told anything since it began"),
    _whole("led", ("ways",), "whether it is on a way or has come to its end"),
    _whole("begins", ("ways",), "whether that begins in this tick"),
)
