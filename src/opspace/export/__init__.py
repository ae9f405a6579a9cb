"""Recordings as files of other programs: Foxglove, PlotJuggler, Rerun, and whatever reads CSV."""

from opspace.export.files import FORMATS as FORMATS
from opspace.export.files import export as export
from opspace.export.files import format_of as format_of
