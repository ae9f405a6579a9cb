"""Draw docs/images/two-arms-and-reach.png: ``python docs/evidence/collision_pictures.py``.

Both scenarios run anew; the upper row is the arm beside another one, the lower row the humanoid.
"""

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import opspace as osc
from opspace.pictures.snapshots import snapshots
from opspace.runs.run import run_scenario
from opspace.scenario.load import load_scenario

IMAGE = Path(__file__).resolve().parents[1] / "images" / "two-arms-and-reach.png"
SIZE = (330, 330)
SCENES = {
    "two-arms": ((0.2, 2.0, 3.4), "position", (300.0, -60.0)),
    "humanoid-reach": ((0.2, 1.9, 3.8), "hand", (150.0, -15.0)),
}


def row(name, times, task, direction):
    """Give the pictures of a scenario beside each other."""
    with tempfile.TemporaryDirectory() as where:
        scenario = load_scenario(name)
        run_scenario(scenario, Path(where) / name)
        recording = osc.load(Path(where) / name)
        robot = osc.load_robot(scenario.robot)
        found = snapshots(recording, robot, times, size=SIZE, task=task, direction=direction)
    return np.concatenate(found, axis=1)


def main():
    """Write the picture."""
    rows = [row(name, *told) for name, told in SCENES.items()]
    Image.fromarray(np.concatenate(rows)).quantize(96).save(IMAGE, optimize=True)


if __name__ == "__main__":
    main()
