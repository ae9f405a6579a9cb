"""Columnar recordings of a run: every column with its unit, readable after any kind of end."""

from opspace.record.format import Column as Column
from opspace.record.format import End as End
from opspace.record.format import package_versions as package_versions
from opspace.record.reader import Recording as Recording
from opspace.record.reader import load as load
from opspace.record.writer import Recorder as Recorder
