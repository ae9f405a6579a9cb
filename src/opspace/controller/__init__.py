"""The controller: one tick from state to torque, in readable and in compiled form."""

from opspace.controller.controller import Controller as Controller
from opspace.controller.falling import FallRule as FallRule
from opspace.controller.reference import ReferenceController as ReferenceController
