"""What the simulated robot carries: a body of its own on every frame that has a load."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from opspace.robots.adapter import AdapterBase
from opspace.robots.payload import tensor_of
from opspace.robots.protocol import Robot

OF_SITE = "site:"
"""Before the name of a site that is named like a body."""


def loads_by_frame(robot: Robot) -> dict[str, np.ndarray]:
    """Tell what the frames of a robot carry, (10,) each as `opspace.robots.payload.load`, by name."""
    if not isinstance(robot, AdapterBase):
        return {}
    return {robot.frame_names[frame]: numbers for frame, numbers in robot.loads.items()}


def add_loads(spec: Any, loads: Mapping[str, np.ndarray]) -> None:
    """Fix a body to every frame that carries something, in a MuJoCo specification."""
    for frame, numbers in loads.items():
        place = place_of(spec, frame)
        assert place is not None, frame
        body, rotation, origin = place
        if numbers[0] > 0.0:
            carried = body.add_body(pos=origin, quat=_quaternion(rotation))
            _set_load(carried, numbers)


def _set_load(body: Any, numbers: np.ndarray) -> None:
    mass, centre = float(numbers[0]), numbers[1:4] / numbers[0]
    about = tensor_of(numbers) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    moments, axes = np.linalg.eigh(about)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] *= -1.0
    moments = np.maximum(moments, 0.0)
    # A flat body is at the edge of what one can have, and rounding must not take it over.
    moments[2] = min(moments[2], moments[0] + moments[1])
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat, body.inertia = mass, centre, _quaternion(axes), moments


def place_of(spec: Any, frame: str) -> tuple[Any, np.ndarray, np.ndarray] | None:
    """Find the body of a frame, and rotation (3, 3) and origin (3,) m of the frame in it.

    Returns:
        None where there is no body or site of this name.
    """
    import mujoco  # noqa: PLC0415 - an extra, and slow to import

    body = spec.body(frame)
    if body is not None:
        return body, np.eye(3), np.zeros(3)
    site = spec.site(frame) or spec.site(frame.removeprefix(OF_SITE))
    if site is None:
        return None
    # The compiler knows what angles, axes and frames around it come to.
    model = spec.compile()
    matrix, i = np.zeros(9), model.site(site.name).id
    mujoco.mju_quat2Mat(matrix, model.site_quat[i])
    return site.parent, matrix.reshape(3, 3), np.array(model.site_pos[i])


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    import mujoco  # noqa: PLC0415 - an extra, and slow to import

    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).reshape(9))
    return quaternion
