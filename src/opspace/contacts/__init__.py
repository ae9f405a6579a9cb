"""What a robot can stand on and hold on to: contacts, each motion and force of one frame."""

from opspace.contacts.edge import EdgeContact as EdgeContact
from opspace.contacts.ground_contact import ContactTerms as ContactTerms
from opspace.contacts.ground_contact import GroundContact as GroundContact
from opspace.contacts.point import PointContact as PointContact
from opspace.contacts.sole import SoleContact as SoleContact
from opspace.contacts.surface_contact import SurfaceContact as SurfaceContact
