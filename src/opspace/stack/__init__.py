"""The tasks of a controller: who is in, at which level, and how that changes in time."""

from opspace.stack.contact_course import ContactMember as ContactMember
from opspace.stack.groups import Blending as Blending
from opspace.stack.members import Member as Member
from opspace.stack.members import Variable as Variable
from opspace.stack.members import presences as presences
from opspace.stack.members import variables_of as variables_of
from opspace.stack.mixture import Mixture as Mixture
from opspace.stack.mixture import Slot as Slot
from opspace.stack.mixture import mixture as mixture
from opspace.stack.rehearsal import Outlook as Outlook
from opspace.stack.stack import Stack as Stack
from opspace.stack.unrest_memory import UnrestMemory as UnrestMemory
