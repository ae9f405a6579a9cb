"""Turn a robot file into a robot on one dynamics library."""

# Each backend is imported where it is chosen.
# ruff: noqa: PLC0415

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from opspace.errors import ModelError, missing_extra
from opspace.robots.adapter import AdapterBase
from opspace.robots.description import Description
from opspace.robots.joint_roles import ALL_WITH_A_MOTOR, JointChoice
from opspace.robots.urdf import Urdf, describe_urdf, read_urdf

if TYPE_CHECKING:
    from opspace.robots.mujoco_model import MjcfRobot

SUFFIXES = (".urdf", ".xml")


@dataclass(frozen=True)
class RobotFile:
    """A robot file that has been read.

    Attributes:
        description: What it says besides dynamics; may be replaced before ``build`` is called.
        build: Makes the robot from a description.
    """

    description: Description
    build: Callable[[Description], AdapterBase]


def read_robot(
    path: Path, backend: str, floating_base: bool, choice: JointChoice = ALL_WITH_A_MOTOR
) -> RobotFile:
    """Read a URDF or MJCF file for one dynamics library.

    Args:
        path: The file; .urdf or .xml.
        backend: "pinocchio" or "mujoco".
        floating_base: Whether to free the root link.
        choice: Which joints are controlled, and where others are held.

    Returns:
        The file, ready to be built.

    Raises:
        ModelError: The file does not exist, cannot be used, or has nothing that moves.
        MissingExtraError: MuJoCo is needed and not installed.
    """
    if not path.is_file():
        raise ModelError(f"{path}: no such file")
    if path.suffix not in SUFFIXES:
        raise ModelError(f"{path}: a robot file ends in {' or '.join(SUFFIXES)}")
    if choice.armature and path.suffix != ".urdf":
        raise ModelError(f"{path}: an MJCF file says itself what armature its joints have")
    read = _read_urdf if path.suffix == ".urdf" else _read_mjcf
    try:
        robot = read(path, backend, floating_base, choice)
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        # It also reads MJCF for Pinocchio, so that both see the same model.
        raise missing_extra("mujoco", "sim") from None
    if robot.description.nv == 0:
        raise ModelError(f"{path}: the robot has no joint that moves")
    return robot


def _read_urdf(path: Path, backend: str, floating_base: bool, choice: JointChoice) -> RobotFile:
    urdf = read_urdf(path, choice.locked, floating_base, choice.joints, choice.armature)
    description = replace(describe_urdf(urdf, floating_base), armature=choice.armature)
    return robot_of_urdf(urdf, description, backend, floating_base)


def robot_of_urdf(
    urdf: Urdf, description: Description, backend: str, floating_base: bool
) -> RobotFile:
    """Hand what was read of a URDF, or of a model in memory, to a dynamics library.

    Raises:
        ModelError: The library cannot use it.
    """
    if backend == "pinocchio":
        from opspace.robots.pinocchio import PinocchioRobot
        from opspace.robots.pinocchio_model import model_from_urdf

        pinocchio_model = model_from_urdf(urdf, floating_base)
        return _file(description, lambda d: PinocchioRobot(d, pinocchio_model))
    from opspace.robots.mujoco import MujocoRobot
    from opspace.robots.mujoco_model import compile_urdf, urdf_spec

    mujoco_model = compile_urdf(urdf_spec(urdf, floating_base), urdf.origin)
    return _file(description, lambda d: MujocoRobot(d, mujoco_model))


def _read_mjcf(path: Path, backend: str, floating_base: bool, choice: JointChoice) -> RobotFile:
    from opspace.robots.mujoco_model import mjcf_spec

    return robot_of_mjcf(mjcf_spec(path, floating_base, choice), backend)


def robot_of_mjcf(read: MjcfRobot, backend: str) -> RobotFile:
    """Compile what was read of an MJCF file, or of a model in memory.

    Raises:
        ModelError: MuJoCo cannot use it, or nothing of it moves.
    """
    from opspace.robots.mujoco_model import compile_spec, describe_mujoco

    compiled = compile_spec(read.spec, read.origin)
    if compiled.nv == 0:
        raise ModelError(f"{read.origin}: the robot has no joint that moves")
    description = describe_mujoco(compiled, read)
    if backend == "pinocchio":
        from opspace.robots.pinocchio import PinocchioRobot
        from opspace.robots.pinocchio_model import carried_from_mujoco, model_from_mujoco

        model, carried = model_from_mujoco(compiled), carried_from_mujoco(compiled)
        return _file(description, lambda d: PinocchioRobot(d, model, carried))
    from opspace.robots.mujoco import MujocoRobot

    return _file(description, lambda d: MujocoRobot(d, compiled))


def _file(description: Description, build: Callable[[Description], AdapterBase]) -> RobotFile:
    """Leave the joints that lead, where others follow them."""
    if not description.couplings:
        return RobotFile(description, build)
    from opspace.robots.coupled import CoupledRobot, coupled_description

    return RobotFile(
        coupled_description(description), lambda d: CoupledRobot(d, build(description))
    )
