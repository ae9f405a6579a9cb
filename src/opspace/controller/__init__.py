"""The controller: one tick from state to torque."""

from opspace.controller.calibration import Calibration as Calibration
from opspace.controller.command import Command as Command
from opspace.controller.command import LevelStatus as LevelStatus
from opspace.controller.command import Status as Status
from opspace.controller.command import TaskStatus as TaskStatus
from opspace.controller.controller import Controller as Controller
from opspace.controller.options import Singularity as Singularity
from opspace.controller.tick import ReferenceController as ReferenceController
