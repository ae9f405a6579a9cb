"""A film has a picture for every moment, with the time and the activations beside it."""

import mujoco
import numpy as np
import pytest
from PIL import Image

from opspace.errors import InputError
from opspace.robots import load_robot
from opspace.sim.film import BAND, film
from opspace.sim.offscreen import SnapshotUnavailableError, canvas
from tests.plots import synthetic

SIZE = (120, 90)


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
        with canvas(model, SIZE):
            pass
    except SnapshotUnavailableError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("opengl")
def test_a_film_has_a_picture_for_every_moment(run, tmp_path):
    robot = load_robot("puma560")
    path = film(run, robot, tmp_path / "new" / "run.gif", fps=4.0, speed=2.0, size=SIZE)
    with Image.open(path) as moving:
        seconds = float(run.t[-1] - run.t[0])
        assert moving.n_frames == int(np.ceil(seconds / 2.0 * 4.0))
        assert moving.size == (SIZE[0] + BAND, SIZE[1])
        assert moving.info["duration"] == 250
        first = np.asarray(moving.convert("RGB")).astype(int)
        moving.seek(moving.n_frames // 2)
        middle = np.asarray(moving.convert("RGB")).astype(int)
    assert np.abs(first[:, BAND:] - middle[:, BAND:]).mean() > 1.0
    assert np.abs(first[:20, :BAND] - middle[:20, :BAND]).max() > 50  # the time


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("run.mp4", {}, r"ends in \.gif"),
        ("run.gif", {"fps": 0.0}, "fps must be"),
        ("run.gif", {"speed": float("nan")}, "speed must be"),
    ],
)
def test_bad_requests_are_refused(run, tmp_path, name, options, message):
    with pytest.raises(InputError, match=message):
        film(run, load_robot("puma560"), tmp_path / name, **options)
