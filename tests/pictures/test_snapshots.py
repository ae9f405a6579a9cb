"""Snapshots show the robot of a recording, from one place, with nothing cut off."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from opspace.errors import InputError, OpspaceError, UnknownNameError
from opspace.pictures.offscreen import SnapshotUnavailableError, camera_axes, fit_view
from opspace.pictures.snapshots import snapshot_strip, snapshots
from opspace.pictures.touched_drawn import TouchedDrawn
from opspace.robots import load_robot
from opspace.runs.run import run_scenario
from opspace.scenario import load_scenario
from tests.plots import inspection

SIZE = (120, 90)
TIMES = (0.0, 2.0, 3.5)
EMPTY = "<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>"


@pytest.mark.usefixtures("opengl")
def test_each_time_has_its_picture(run, robot):
    images = snapshots(run, robot, TIMES, size=SIZE)
    assert [image.shape for image in images] == [(90, 120, 3)] * 3
    assert all(inspection.contrast(image) > 20.0 for image in images)
    assert inspection.contrast(images[0].astype(float) - images[2]) > 5.0


@pytest.mark.usefixtures("opengl")
def test_the_same_time_has_the_same_picture(run, robot):
    first, second = snapshots(run, robot, (1.0, 1.01), size=SIZE)
    assert np.array_equal(first, second)


@pytest.mark.usefixtures("opengl")
def test_the_sphere_is_at_the_desired_position(run, robot):
    """Without the task there is no sphere; the pixels that differ are red where it is."""
    options = {"size": SIZE, "direction": (200.0, -20.0)}
    shown = snapshots(run, robot, [3.5], **options)[0].astype(int)
    assert np.sum((shown[..., 0] > 150) & (shown[..., 1] < 90)) > 3
    hidden = snapshots(run, robot, [3.5], task="none", **options)[0].astype(int)
    assert np.sum((hidden[..., 0] > 150) & (hidden[..., 1] < 50)) == 0


@pytest.fixture(scope="module")
def pressing(tmp_path_factory):
    """A run that presses from 0.55 s on."""
    scenario = load_scenario("wipe", ["duration=0.8"])
    return run_scenario(scenario, tmp_path_factory.mktemp("pressing") / "run").recording


def test_a_force_is_an_arrow_as_long_as_it_is(pressing):
    drawn = TouchedDrawn(pressing)
    wrench = pressing.group("wrench/tool")[:, :3]
    found = drawn.arrow(750)
    np.testing.assert_allclose(found, 0.02 * wrench[750])
    peak = int(np.argmin(wrench[:, 2]))
    assert np.linalg.norm(drawn.arrow(peak)) <= 0.6 + 1e-12
    in_the_air = [drawn.arrow(row) for row in range(0, 400, 10)]
    assert all(arrow is None or np.linalg.norm(arrow) < 0.03 for arrow in in_the_air)


@pytest.mark.usefixtures("opengl")
def test_what_is_pressed_is_in_the_picture(pressing, robot, monkeypatch):
    def picture():
        return snapshots(pressing, robot, [0.75], size=(480, 420), task="none")[0].astype(int)

    shown = picture()
    monkeypatch.setattr(TouchedDrawn, "draw", lambda *given: None)
    changed = shown - picture()
    assert np.sum(np.abs(changed).max(axis=2) > 10) > 5000  # the table
    assert np.sum(changed[..., 0] - changed[..., 2] > 30) > 50  # the arrow


@pytest.mark.usefixtures("opengl")
def test_a_strip_has_room_for_all_pictures_and_captions(run, robot, tmp_path):
    path = snapshot_strip(run, robot, TIMES, tmp_path / "new" / "strip.png", size=SIZE)
    image = np.asarray(Image.open(path))
    assert image.shape[1] >= 3 * SIZE[0]
    assert image.shape[0] > SIZE[1]
    captions = image[SIZE[1] :]
    assert all(inspection.contrast(c) > 10.0 for c in np.array_split(captions, 3, axis=1))


@given(
    hnp.arrays(float, (12, 3), elements=st.floats(-2.0, 2.0)),
    st.floats(0.0, 360.0),
    st.floats(-80.0, 80.0),
    st.floats(20.0, 80.0),
)
def test_a_fitted_view_shows_every_point(points, azimuth, elevation, fovy):
    size = (400, 300)
    view = fit_view(points, size, (azimuth, elevation), fovy)
    axes = camera_axes(azimuth, elevation)
    x, y, z = axes @ (points - (view.lookat - view.distance * axes[2])).T
    vertical = np.tan(np.radians(fovy / 2.0))
    assert np.all(np.abs(y) <= z * vertical + 1e-9)
    assert np.all(np.abs(x) <= z * vertical * size[0] / size[1] + 1e-9)


def test_camera_axes_are_those_of_mujoco():
    """Looking along y, x is at the right and z is up."""
    assert np.allclose(camera_axes(90.0, 0.0), [[1, 0, 0], [0, 0, 1], [0, 1, 0]])


def test_without_opengl_the_reason_is_said(run, robot, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(SnapshotUnavailableError, match="MUJOCO_GL is 'off'") as caught:
        snapshots(run, robot, TIMES, size=SIZE)
    assert isinstance(caught.value, OpspaceError)


def test_an_opengl_that_fails_is_named():
    """In a process of its own: PyOpenGL settles on a platform once."""
    code = (
        "import mujoco\n"
        "from opspace.pictures.offscreen import *\n"
        f"model = mujoco.MjModel.from_xml_string({EMPTY!r})\n"
        "try:\n"
        "    with canvas(model, (9, 9)): pass\n"
        "except SnapshotUnavailableError as error: print(error)\n"
    )
    environment = {"MUJOCO_GL": "egl", "PYOPENGL_PLATFORM": "glx", "PATH": ""}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert "OpenGL by egl says ImportError" in done.stdout


def test_pictures_that_cannot_be_made_are_refused(run, robot, tmp_path):
    with pytest.raises(InputError, match="needs a time"):
        snapshots(run, robot, [])
    with pytest.raises(InputError, match="size"):
        snapshots(run, robot, [0.0], size=(0, 90))
    with pytest.raises(UnknownNameError, match="panda_joint1"):
        snapshots(run, _panda(tmp_path), [0.0])


def _panda(tmp_path):
    path = tmp_path / "panda.xml"
    joint = "<joint name='panda_joint1'/><geom name='link' size='.1'/>"
    path.write_text(f"<mujoco><worldbody><body name='b'>{joint}</body></worldbody></mujoco>")
    return load_robot(path)
