"""A short run to draw, and whether there is anything to draw with."""

import mujoco
import pytest

from opspace.pictures.offscreen import SnapshotUnavailableError, canvas
from opspace.robots import load_robot
from tests.plots import synthetic


@pytest.fixture(scope="module")
def robot():
    return load_robot("puma560")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    directory = tmp_path_factory.mktemp("run") / "transition"
    return synthetic.write_run(directory, "joint-limit", "transition", 0.05)


@pytest.fixture(scope="module")
def opengl():
    try:
        model = mujoco.MjModel.from_xml_string(
            "<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>"
        )
        with canvas(model, (120, 90)):
            pass
    except SnapshotUnavailableError as error:
        pytest.skip(str(error))
