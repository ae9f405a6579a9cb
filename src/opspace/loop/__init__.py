"""The one loop around a plant and a controller, its pace, and what is asked of it meanwhile."""

from opspace.loop.any_plant import AnyPlant as AnyPlant
from opspace.loop.driver import Driver as Driver
from opspace.loop.driver import DriverFacts as DriverFacts
from opspace.loop.driver import RobotState as RobotState
from opspace.loop.loop import Observer as Observer
from opspace.loop.loop import Outcome as Outcome
from opspace.loop.loop import Stepping as Stepping
from opspace.loop.loop import StopRule as StopRule
from opspace.loop.loop import simulate as simulate
from opspace.loop.loop_report import LoopReport as LoopReport
from opspace.loop.real_time import RealTime as RealTime
from opspace.loop.robot_loop import Loop as Loop
from opspace.loop.shared_history import SharedHistory as SharedHistory
