"""The mathematics of continuous task transitions: arrays in, arrays out, no robot."""

from opspace.law.activation import PROFILES, Activation, Buffer, Profile, Ramp
from opspace.law.blending import BLENDINGS
from opspace.law.singularity import SigmaBuffer
from opspace.law.tasksets import TaskSet
from opspace.law.torque import COUPLINGS, LawInfo, intermediate_values, task_torque

__all__ = [
    "BLENDINGS",
    "COUPLINGS",
    "PROFILES",
    "Activation",
    "Buffer",
    "LawInfo",
    "Profile",
    "Ramp",
    "SigmaBuffer",
    "TaskSet",
    "intermediate_values",
    "task_torque",
]
