"""The plant and the one loop around it."""

from opspace.sim.disturbances import Disturbances as Disturbances
from opspace.sim.disturbances import Push as Push
from opspace.sim.loop import Observer as Observer
from opspace.sim.loop import Outcome as Outcome
from opspace.sim.loop import StopRule as StopRule
from opspace.sim.loop import simulate as simulate
from opspace.sim.plant import Plant as Plant
