"""Robots from models that are in memory: of MuJoCo, compiled or not, and of Pinocchio."""

# Each library is imported where a model of it is given.
# ruff: noqa: PLC0415

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from opspace.errors import ModelError
from opspace.robots.description import ModelOrigin
from opspace.robots.joint_roles import JointChoice
from opspace.robots.loading import RobotFile, robot_of_mjcf, robot_of_urdf

if TYPE_CHECKING:
    from opspace.robots.mujoco_model import MjcfRobot

KINDS = ("MjSpec", "MjModel", "Model")


def is_model(source: object) -> bool:
    """Tell whether something is a model of MuJoCo or Pinocchio, without importing MuJoCo for it."""
    kind = type(source)
    return kind.__name__ in KINDS and kind.__module__.split(".")[0] in ("mujoco", "pinocchio")


def read_model(model: Any, backend: str, floating_base: bool, choice: JointChoice) -> RobotFile:
    """Read a model for one dynamics library; it is left as it is.

    Args:
        model: ``mujoco.MjModel``, ``mujoco.MjSpec`` or ``pinocchio.Model``.
        backend: "pinocchio" or "mujoco".
        floating_base: Whether to free the root link.
        choice: Which joints are controlled, and where others are held.

    Returns:
        The robot, ready to be built.

    Raises:
        ModelError: It cannot be used, or has nothing that moves.
    """
    kind = type(model).__name__
    if kind != "Model":
        return robot_of_mjcf(_mujoco(model, kind, floating_base, choice), backend)
    from opspace.robots.pinocchio_apart import describe_pinocchio, urdf_of

    urdf, free = urdf_of(model, floating_base, choice)
    description = describe_pinocchio(model, urdf, free)
    if not urdf.moving_joints:
        raise ModelError(f"{urdf.origin}: the robot has no joint that moves")
    return robot_of_urdf(urdf, description, backend, free)


def _mujoco(model: Any, kind: str, floating_base: bool, choice: JointChoice) -> MjcfRobot:
    from opspace.robots.mujoco_apart import spec_of
    from opspace.robots.mujoco_model import reduce_spec

    compiled = kind == "MjModel"
    name = model.names.split(b"\0")[0].decode() if compiled else model.modelname
    origin = ModelOrigin(f"{kind} {name!r}", name or "the model", name or "robot")
    spec = spec_of(model, origin) if compiled else model.copy()
    return reduce_spec(spec, origin, floating_base, choice)
