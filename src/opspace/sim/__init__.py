"""The simulated robot."""

from opspace.sim.disturbances import Disturbances as Disturbances
from opspace.sim.disturbances import Push as Push
from opspace.sim.ground import Board as Board
from opspace.sim.ground import Ground as Ground
from opspace.sim.ground import Wall as Wall
from opspace.sim.hole import Hole as Hole
from opspace.sim.mujoco_plant import Plant as Plant
from opspace.sim.surfaces import Surface as Surface
