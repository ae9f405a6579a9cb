"""Positions of joint limits where numbers have seven digits, in the language of kernels.

The speed that a joint may have goes with the root of its distance from the limit; at a limit, seven
digits of where that is leave three of the speed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from opspace.kernels.limit_columns import POSITION, SIGN
from opspace.kernels.limit_rows import distance_to_limit
from opspace.kernels.task_rows import joint_position


def exact_distance_to_limit(work, i):
    """How far the joint of limit i is from it: what seven digits leave of its position is added last."""
    limit = work.limit[i]
    near = limit[POSITION] - joint_position(work, work.limit_joint[i])
    return limit[SIGN] * (near + work.robot.limit_rest[i])


EXACTLY: Mapping[Callable[..., Any], Callable[..., Any]] = {
    distance_to_limit: exact_distance_to_limit
}
"""What is called in single precision, by what is called otherwise."""


def rests_of(limits: np.ndarray) -> np.ndarray:
    """Return what seven digits leave of the positions of limits, (limits, columns), rad or m."""
    positions = limits[:, POSITION]
    return positions - positions.astype(np.float32)
