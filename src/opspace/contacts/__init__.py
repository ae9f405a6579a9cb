"""What a robot can stand on and hold on to: contacts, each motion and force of one frame."""

from opspace.contacts.contact import Contact as Contact
from opspace.contacts.contact import ContactTerms as ContactTerms
from opspace.contacts.point import PointContact as PointContact
from opspace.contacts.sole import SoleContact as SoleContact
