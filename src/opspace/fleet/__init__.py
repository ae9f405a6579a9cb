"""The tick for many robots at once, on a processor or a graphics card."""

from opspace.fleet.fleet import Fleet as Fleet
from opspace.fleet.force_arrays import ForceArrays as ForceArrays
from opspace.fleet.mujoco_reader import MujocoWarpReader as MujocoWarpReader
from opspace.fleet.task_arrays import TaskArrays as TaskArrays
