"""What the compiled tick reads and writes: one record of arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from opspace.command import Status

# Kinds of tasks.
OWN, MOTION, JOINTS = range(3)
# Where motion is measured.
WORLD, RELATIVE, CENTRE_OF_MASS = range(3)
# What is controlled of a motion.
POSITION, ORIENTATION, POSE = range(3)
# How joint limits work.
ADMISSIBLE, BUFFER = range(2)

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
) = range(13)
KIND_SIZE = 13

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

# Columns of Tick.variable: an activation in time, as `opspace.kernels.profiles.ramp` takes it.
PROFILE = 0
RAMP = 1
VARIABLE_SIZE = 9

# Entries of Tick.option.
(
    SINGULAR,
    SIGMA_LOWER,
    SIGMA_UPPER,
    SIGMA_PROFILE,
    DAMPING,
    TASK_BIAS,
    ROOM,
    LIMIT_MODE,
    LIMIT_PROFILE,
    LIMIT_WEIGHT,
    LIMIT_K1,
    LIMIT_K2,
    LIMIT_KP,
    LIMIT_RETURN_SPEED,
    LIMIT_BUFFER,
    KEEP_TORQUE,
) = range(16)
OPTION_SIZE = 16

# What a tick answers when there is no torque.
STATE_NOT_FINITE, NOT_FINITE, NOT_POSITIVE_DEFINITE = -1, -2, -3
SOLVE = 1 << max(Status).bit_length()
"""What a hard torque counts in its answer, above every combination of `opspace.Status`."""


class Tick(NamedTuple):
    """Everything that one tick reads, writes and works with.

    The robot: ``q``, ``v``, ``M``, ``bias``, ``axes``, ``placement`` and ``parent`` of
    `opspace.robots.motion_axes.MotionAxes`; ``mass_place`` (links, 2) body and joint, ``mass``
    (links, 4) kg and centre on the body.

    The plan, which changes when a transition begins or ends: ``kind`` and ``numbers`` of each task;
    of each row ``coordinate`` (joint tasks), ``select`` (rows, 6), ``goal`` (rows, 3: position,
    velocity, acceleration of joint tasks), ``kp``, ``kv``, ``row_weight`` = 1/√reference;
    ``variable`` and ``group`` of each activation that moves or rests, the tasks' presences first;
    ``slots`` (slots, 3: depth, first row, rows) in the order of the levels,
    ``slot_on`` and ``slot_off``: variables that must be on or off for a task to be there,
    ``slot_place``: those of them that choose its place; ``own``: activation of each task by its
    own function; ``limit_joint`` and ``limit`` (limits, 7: side, position, braking acceleration,
    margin, what it asks for, largest speed, disturbance) of joint limits; ``torque_limit``; ``option``.

    What it writes, all in one block of memory: ``tau``, ``h`` of each task, ``share`` of each slot,
    ``error`` and ``wanted`` of each row, ``limit_h``, ``limit_wanted``, ``scale`` of each level (joint
    limits first, what damps the rest last), and for the report of the levels ``Jw`` (rows, n),
    whitened, and the memory of the walk.

    The rest is scratch.
    """

    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    bias: np.ndarray
    axes: np.ndarray
    placement: np.ndarray
    parent: np.ndarray
    mass_place: np.ndarray
    mass: np.ndarray
    kind: np.ndarray
    numbers: np.ndarray
    coordinate: np.ndarray
    select: np.ndarray
    goal: np.ndarray
    kp: np.ndarray
    kv: np.ndarray
    row_weight: np.ndarray
    variable: np.ndarray
    group: np.ndarray
    slots: np.ndarray
    slot_on: np.ndarray
    slot_off: np.ndarray
    slot_place: np.ndarray
    own: np.ndarray
    limit_joint: np.ndarray
    limit: np.ndarray
    torque_limit: np.ndarray
    option: np.ndarray
    tau: np.ndarray
    h: np.ndarray
    share: np.ndarray
    error: np.ndarray
    wanted: np.ndarray
    limit_h: np.ndarray
    limit_wanted: np.ndarray
    scale: np.ndarray
    Jw: np.ndarray
    J: np.ndarray
    drift: np.ndarray
    fw: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    motion: np.ndarray
    motion_J: np.ndarray
    motion_error: np.ndarray
    value: np.ndarray
    chained: np.ndarray
    order: np.ndarray
    corner_on: np.ndarray
    corner_weight: np.ndarray
    limit_on: np.ndarray
    limit_weight: np.ndarray
    limit_order: np.ndarray
    rest: np.ndarray
    u: np.ndarray
    drop: np.ndarray
    joint_acceleration: np.ndarray
