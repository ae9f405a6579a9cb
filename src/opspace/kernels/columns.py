"""Columns and codes of the arrays of a tick; `opspace.plan.records` describes the arrays."""

from __future__ import annotations

from opspace.command import Status

# Kinds of tasks.
OWN, MOTION, JOINTS, MOMENTUM, FORCE = range(5)
# Where motion is measured.
WORLD, RELATIVE, CENTRE_OF_MASS = range(3)
# What is controlled of a motion.
POSITION, ORIENTATION, POSE = range(3)

# Columns of Tick.kind: a task as whole numbers.
(
    KIND,
    FIRST_ROW,
    ROWS,
    SOURCE,
    QUANTITY,
    TOOL_AXES,
    BODY,
    JOINT,
    OTHER_BODY,
    OTHER_JOINT,
    SPEED_LIMITED,
    COVERS_ALL,
    REMEMBERS,
    CARRIES,
    PRESS,
    SPRING,
    TOUCH,
) = range(17)
KIND_SIZE = 17
# PRESS: row of ``Tick.press`` of a force task. TOUCH: one plus the row of the force task whose
# confidence multiplies the activation; below zero, minus that, where either of both is enough.

# Columns of Tick.numbers: a task as numbers. Rotations are by rows, placements by columns.
LOCAL = 0
OTHER_LOCAL = 12
OFFSET = 24
GOAL_ROTATION = 27
GOAL_POSITION = 36
GOAL_VELOCITY = 39
GOAL_ACCELERATION = 45
MAX_SPEED = 51
TURN = 53
NUMBERS_SIZE = 57
# TURN: of a motion its last rotation, a quaternion; of joints the signs of their last errors, as bits
# of four whole numbers.

# Columns of Tick.variable: an activation in time, as `opspace.law.scalars.ramp` takes it.
PROFILE = 0
RAMP = 1
VARIABLE_SIZE = 9

# Entries of Tick.option.
(
    SINGULAR,
    SIGMA_LOWER,
    SIGMA_UPPER,
    SIGMA_PROFILE,
    RELEASE_UPPER,
    SIGMA_DAMPING,
    REST_LOWER,
    REST_RELEASE,
    REST_UPPER,
    DAMPING,
    TASK_BIAS,
    ROOM,
    REACH,
    LIMIT_LAW,
    LIMIT_PROFILE,
    LIMIT_WEIGHT,
    LIMIT_K1,
    LIMIT_K2,
    LIMIT_KP,
    LIMIT_BOUND,
    LIMIT_BUFFER,
    KEEP_TORQUE,
    PERIOD,
    BASE,
) = range(24)
OPTION_SIZE = 24

# What a tick answers when there is no torque.
STATE_NOT_FINITE, NOT_FINITE, NOT_POSITIVE_DEFINITE = -1, -2, -3
SOLVE = 2 * max(map(int, Status))
"""What a hard torque counts in its answer, above every combination of statuses."""


def slot_bit(k: int) -> int:
    """Bit of slot k in a corner: earlier slots are higher, so that corners sort like the levels."""
    return 1 << (61 - k)
