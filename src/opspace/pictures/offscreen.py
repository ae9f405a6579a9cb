"""Off-screen rendering by MuJoCo, without a window and without a change to the environment."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from opspace.errors import InputError, OpspaceError, missing_extra

try:
    import mujoco
except ImportError:
    raise missing_extra("mujoco", "sim") from None

_LARGEST = 4096
_MARGIN = 1.08
_OFF = ("disable", "disabled", "off", "false", "0")


class SnapshotUnavailableError(OpspaceError):
    """No picture can be rendered on this machine."""


class View(NamedTuple):
    """A camera.

    Attributes:
        lookat: (3,) the point it looks at [m].
        distance: Its distance from there [m].
        azimuth: Direction in which it looks, from x towards y [degrees].
        elevation: Direction in which it looks, upwards [degrees].
    """

    lookat: np.ndarray
    distance: float
    azimuth: float
    elevation: float


def check_size(size: tuple[int, int]) -> None:
    """Refuse a picture that has no pixels or more than any driver can hold.

    Args:
        size: Width and height in pixels.

    Raises:
        InputError: A side is too short or too long.
    """
    if not all(0 < side <= _LARGEST for side in size):
        raise InputError(f"the size of a picture must be 1 to {_LARGEST} pixels, not {size}")


def camera_axes(azimuth: float, elevation: float) -> np.ndarray:
    """Return right, up and forward of a camera as rows, (3, 3)."""
    a, e = np.radians([azimuth, elevation])
    forward = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return np.array([right, np.cross(right, forward), forward])


def fit_view(
    points: np.ndarray, size: tuple[int, int], direction: tuple[float, float], fovy: float
) -> View:
    """Place a camera as near as all points allow.

    Args:
        points: (k, 3) what must be in view [m].
        size: Width and height of the picture.
        direction: Azimuth and elevation in which the camera looks [degrees].
        fovy: Vertical field of view [degrees].

    Returns:
        The camera.

    Raises:
        InputError: The size cannot be used.
    """
    check_size(size)
    axes = camera_axes(*direction)
    points = points @ axes.T
    vertical = np.tan(np.radians(0.5 * fovy))
    tangents = np.array([vertical * size[0] / size[1], vertical]) / _MARGIN
    # A point at depth z is in view where |x − centre| <= (z + distance) tan; the two sides of the
    # frame give centre and distance in closed form.
    high = (points[:, :2] - points[:, 2:] * tangents).max(axis=0)
    low = (-points[:, :2] - points[:, 2:] * tangents).max(axis=0)
    centre, distance = 0.5 * (high - low), (0.5 * (high + low) / tangents).max()
    return View(centre @ axes[:2], float(distance), *direction)


class Canvas:
    """A picture of a model that can be drawn again and again.

    Attributes:
        scene: The shapes to draw; those of the model are put there by ``draw``, others may follow.
    """

    def __init__(
        self, model: mujoco.MjModel, size: tuple[int, int], context: mujoco.MjrContext
    ) -> None:
        """Use `canvas` instead, which looks after the context."""
        self.scene = mujoco.MjvScene(model, maxgeom=10_000)
        self._model, self._context, self._size = model, context, size
        self._box = mujoco.MjrRect(0, 0, *size)

    def show(self, data: mujoco.MjData, view: View) -> None:
        """Fill the scene with the model's shapes, seen from a camera."""
        camera = mujoco.MjvCamera()
        camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        camera.lookat[:] = view.lookat
        camera.distance, camera.azimuth, camera.elevation = view[1:]
        everything, option = mujoco.mjtCatBit.mjCAT_ALL.value, mujoco.MjvOption()
        mujoco.mjv_updateScene(self._model, data, option, None, camera, everything, self.scene)

    def add(
        self, shape: mujoco.mjtGeom, position: np.ndarray, radius: float, color: tuple[float, ...]
    ) -> mujoco.MjvGeom:
        """Add a shape to the scene and return it."""
        geom = self.scene.geoms[self.scene.ngeom]
        size, upright = np.full(3, radius), np.eye(3).flatten()
        rgba = np.array(color, dtype=np.float32)
        mujoco.mjv_initGeom(geom, shape, size, position, upright, rgba)
        self.scene.ngeom += 1
        return geom

    def pixels(self) -> np.ndarray:
        """Draw the scene, (height, width, 3) uint8."""
        image = np.empty((*self._size[::-1], 3), dtype=np.uint8)
        mujoco.mjr_render(self._box, self.scene, self._context)
        mujoco.mjr_readPixels(image, None, self._box, self._context)
        return np.flipud(image).copy()


@contextmanager
def canvas(model: mujoco.MjModel, size: tuple[int, int]) -> Iterator[Canvas]:
    """Give something to draw on; its OpenGL resources are released at the end.

    MuJoCo's own renderer is bound to what MUJOCO_GL said when mujoco was imported, which is a window
    where it said nothing. Here MUJOCO_GL is read now, and nothing means no window.

    Args:
        model: The model to draw; its off-screen size is changed.
        size: Width and height in pixels.

    Yields:
        The canvas.

    Raises:
        SnapshotUnavailableError: There is no OpenGL to render with.
        InputError: The size cannot be used.
    """
    check_size(size)
    model.vis.global_.offwidth, model.vis.global_.offheight = size
    gl, context = _open(model, size)
    try:
        yield Canvas(model, size, context)
    finally:
        context.free()
        gl.free()


def _open(model: mujoco.MjModel, size: tuple[int, int]) -> tuple[Any, mujoco.MjrContext]:
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in _OFF:
        raise SnapshotUnavailableError(f"pictures are off: MUJOCO_GL is {wanted!r}")
    known = wanted in ("egl", "osmesa", "glfw", "cgl")
    name = wanted if known else {"linux": "egl", "darwin": "cgl"}.get(sys.platform, "glfw")
    gl = None
    try:
        gl = importlib.import_module(f"mujoco.{name}").GLContext(*size)
        gl.make_current()
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, context)
    # OpenGL fails in as many ways as there are drivers.
    except Exception as error:
        if gl is not None:
            gl.free()
        raise SnapshotUnavailableError(
            f"no picture can be rendered: OpenGL by {name} says {type(error).__name__}: {error};"
            " MUJOCO_GL may name another of egl, osmesa and glfw"
        ) from error
    return gl, context
