"""Other ways to change tasks, under the same protocol, scenario and measures."""

from opspace.compare.methods import METHODS as METHODS
from opspace.compare.methods import Method as Method
from opspace.compare.run_methods import Comparison as Comparison
from opspace.compare.run_methods import compare_scenario as compare_scenario
