"""The mathematics of continuous task transitions: arrays in, arrays out, no robot."""

from opspace.law.activation import Activation, Buffer, Profile, Ramp
from opspace.law.blending import BLENDINGS, Weighted, combined, corners, leaning_chain
from opspace.law.hierarchy import levels_of, whiten
from opspace.law.leave_room import RoomLeft, Stacks, leave_room, motions_left, wants_more
from opspace.law.nearest import (
    Nearest,
    excess,
    excess_of_rows,
    levels_below,
    nearest_acceleration,
    task_metric,
)
from opspace.law.scalars import BROKEN, LOST, PROFILES
from opspace.law.singular_directions import SigmaBuffer
from opspace.law.tasksets import TaskSet
from opspace.law.torque import COUPLINGS, LawInfo, blended_torque, intermediate_values, task_torque
from opspace.law.tree import Motors

__all__ = [
    "BLENDINGS",
    "BROKEN",
    "COUPLINGS",
    "LOST",
    "PROFILES",
    "Activation",
    "Buffer",
    "LawInfo",
    "Motors",
    "Nearest",
    "Profile",
    "Ramp",
    "RoomLeft",
    "SigmaBuffer",
    "Stacks",
    "TaskSet",
    "Weighted",
    "blended_torque",
    "combined",
    "corners",
    "excess",
    "excess_of_rows",
    "intermediate_values",
    "leaning_chain",
    "leave_room",
    "levels_below",
    "levels_of",
    "motions_left",
    "nearest_acceleration",
    "task_metric",
    "task_torque",
    "wants_more",
    "whiten",
]
