"""A robot without a scenario is held where it is."""

import numpy as np
import pytest

from opspace.errors import UnknownNameError
from opspace.loop import simulate
from opspace.robots import available_robots
from opspace.scenario import load_scenario
from opspace.scenario.build import build
from opspace.scenario.of_robot import scenario_or_robot
from tests.robots.samples import MJCF, URDF

INSTALLED = [robot.name for robot in available_robots() if robot.installed]


@pytest.mark.parametrize("name", [n for n in ("puma560", "panda", "so101") if n in INSTALLED])
def test_a_robot_by_name_stays(name):
    built = build(scenario_or_robot(name))
    start = built.plant.q
    assert simulate(built.plant, built.controller, 0.2).completed
    np.testing.assert_allclose(built.plant.q, start, atol=1e-6)


@pytest.mark.parametrize(("file", "text"), [("arm.urdf", URDF), ("arm.xml", MJCF)])
def test_a_file_is_a_robot_and_may_be_overridden(tmp_path, file, text):
    (tmp_path / file).write_text(text)
    scenario = scenario_or_robot(str(tmp_path / file), ["duration=3"])
    assert scenario.duration == 3.0
    assert scenario.robot == str(tmp_path / file)


def test_a_scenario_goes_first_and_what_is_neither_names_both():
    assert scenario_or_robot("showpiece") == load_scenario("showpiece")
    with pytest.raises(UnknownNameError, match=r"showpiece.*puma560") as caught:
        scenario_or_robot("puma56")
    assert "puma560" in str(caught.value).split("valid")[0]
