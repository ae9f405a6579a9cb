"""Scenarios: what a YAML file can say, and how it is read."""

from opspace.scenario.load import dump_scenario as dump_scenario
from opspace.scenario.load import load_scenario as load_scenario
from opspace.scenario.load import scenario_from as scenario_from
from opspace.scenario.load import shipped_scenarios as shipped_scenarios
from opspace.scenario.load import to_dict as to_dict
from opspace.scenario.schema import Scenario as Scenario
