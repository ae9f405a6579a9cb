"""Find robots by name or by file."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias
from warnings import warn

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import ModelError, ModelWarning, missing_extra, unknown_name
from opspace.robots.adapter import AdapterBase
from opspace.robots.bent_reference import bent_reference
from opspace.robots.catalogue import CATALOGUE, SHIPPED, CatalogueEntry, locate
from opspace.robots.description import Description
from opspace.robots.from_memory import is_model, read_model
from opspace.robots.joint_roles import JointChoice
from opspace.robots.loading import SUFFIXES, RobotFile, read_robot

if TYPE_CHECKING:
    import mujoco
    import pinocchio

    # Compiled modules without type stubs.
    Model: TypeAlias = (
        mujoco.MjModel  # pyright: ignore[reportAttributeAccessIssue]
        | mujoco.MjSpec  # pyright: ignore[reportAttributeAccessIssue]
        | pinocchio.Model  # pyright: ignore[reportAttributeAccessIssue]
    )

BACKENDS = ("pinocchio", "mujoco")


@dataclass(frozen=True)
class RobotInfo:
    """One robot that can be loaded by name.

    Attributes:
        name: Name for ``load_robot``.
        dof: Number of velocity coordinates.
        description: One line about it.
        package: Package that its files come from.
        installed: Whether the files are there.
        kind: "arm", "humanoid" or "quadruped".
    """

    name: str
    dof: int
    description: str
    package: str
    installed: bool
    kind: str


def available_robots() -> list[RobotInfo]:
    """List every robot that has a name, whether or not its files are installed.

    Returns:
        One record per robot, the shipped ones first.
    """
    return [
        RobotInfo(name, e.dof, e.description, e.package, locate(e) is not None, e.kind)
        for name, e in CATALOGUE.items()
    ]


def load_robot(
    source: str | Path | Model,
    *,
    backend: str = "pinocchio",
    floating_base: bool = False,
    joints: Collection[str] | None = None,
    locked: Collection[str] | Mapping[str, float] = (),
    tool: str | None = None,
    reference: ArrayLike | Mapping[str, float] | None = None,
    armature: float | None = None,
) -> AdapterBase:
    """Load a robot by name, from a URDF or MJCF file, or from a model in memory.

    The robot has the joints that are controlled. What carries the others is held fixed; joints
    that follow a controlled one (mimic in URDF, an equality of two joints in MJCF) move with it,
    and count in its inertia and its load.

    Args:
        source: A name that ``available_robots`` lists, a path ending in .urdf or .xml, or a
            ``mujoco.MjModel``, ``mujoco.MjSpec`` or ``pinocchio.Model``. A model is read as its
            file would be, and left as it is.
        backend: Library that computes the dynamics, "pinocchio" or "mujoco".
        floating_base: Free the root link. Humanoids and quadrupeds loaded by name are always free.
        joints: Names or patterns ("left_*") of the joints to control; those that have a motor
            where this is not given. All joints of a URDF count as having one, and so do those of
            an MJCF file that has no actuator at all.
        locked: Names or patterns of joints to hold, with the position in rad or m; names alone are
            held where the file has them: in the key frame ``home`` or the first, else at zero.
        tool: Default tool frame; the last of the longest chain where this is not given, short of
            hands and of joints that are held.
        reference: Reference posture: one number per coordinate, or positions by joint in rad or m;
            joints that are not named stay where the file has them. Where nothing is given it is the
            key frame ``home`` or the first, else the middle of every range; where that is a singular
            posture of an arm that has others, as little bent as does.
        armature: Inertia of the motor at every joint, rotor times gear ratio squared, kg·m² (kg of a
            slide), for which URDF has no word; None is 0.01 for humanoids by name, else 0. Without it
            a light joint, such as an ankle, has next to no inertia. MJCF files bring their own.

    Returns:
        The robot, updated at its reference posture at rest. What its file says and the controller
        does not follow is a `ModelWarning`, and stands in ``robot.description.warnings``.

    Raises:
        UnknownNameError: No robot, backend, joint or frame has this name.
        MissingExtraError: The robot's files are not installed.
        ModelError: The file does not exist or cannot be used, or a joint is asked to move in a way
            that it cannot.
    """
    if backend not in BACKENDS:
        raise unknown_name("backend", backend, BACKENDS)
    choice = JointChoice.of(joints, locked)
    if armature is not None:
        if not (math.isfinite(armature) and armature >= 0.0):
            raise ModelError(f"armature must be finite and at least 0, got {armature}")
        choice = replace(choice, armature=float(armature))
    if is_model(source):
        if choice.armature:
            raise ModelError("a model in memory says itself what armature its joints have")
        file = read_model(source, backend, floating_base, choice)
        return _built(file, _chosen(file.description, tool, reference), reference is not None)
    if not isinstance(source, str | Path):
        raise ModelError(
            "a robot is loaded by name, from a file, or from a mujoco.MjModel, mujoco.MjSpec or "
            f"pinocchio.Model, not from a {type(source).__name__}"
        )
    if isinstance(source, Path) or Path(source).suffix in SUFFIXES:
        file = read_robot(Path(source), backend, floating_base, choice)
        return _built(file, _chosen(file.description, tool, reference), reference is not None)
    entry = _entry(source)
    path = locate(entry)
    if path is None:
        raise missing_extra(entry.package, "robots")
    free = floating_base or entry.floating_base
    if joints is None:
        choice = replace(choice, locked={**dict.fromkeys(entry.locked_joints), **choice.locked})
    if armature is None:
        choice = replace(choice, armature=entry.armature)
    file = read_robot(path, backend, free, choice)
    named = _named(file.description, source, entry)
    return _built(file, _chosen(named, tool, reference), chosen=True)


def _chosen(
    description: Description,
    tool: str | None,
    reference: ArrayLike | Mapping[str, float] | None,
) -> Description:
    """Apply tool and reference posture that somebody asked for."""
    if tool is not None:
        if tool not in description.frame_names:
            raise unknown_name(f"frame of {description.name}", tool, description.frame_names)
        description = replace(description, tool=tool)
    if reference is None:
        return description
    if isinstance(reference, Mapping):
        q, base = np.array(description.q_reference), description.nq - description.nv
        for joint, position in reference.items():
            if joint not in description.joint_names:
                raise unknown_name(f"joint of {description.name}", joint, description.joint_names)
            q[base + description.joint_names.index(joint)] = position
    else:
        q = np.array(reference, dtype=float)
    if q.shape != (description.nq,) or not np.isfinite(q).all():
        raise ModelError(
            f"the reference posture of {description.name} must be {description.nq} finite numbers"
        )
    return replace(description, q_reference=q)


def _built(file: RobotFile, description: Description, chosen: bool) -> AdapterBase:
    """Build the robot; where nobody has chosen its reference posture, one that is not singular."""
    for sentence in description.warnings:
        warn(f"{description.name}: {sentence}", ModelWarning, stacklevel=3)
    robot = file.build(description)
    if chosen or description.configurations:
        return robot
    bent = bent_reference(robot)
    return robot if bent is None else file.build(replace(description, q_reference=bent))


def _entry(name: str) -> CatalogueEntry:
    try:
        return CATALOGUE[name]
    except KeyError:
        error = unknown_name("robot", name, CATALOGUE)
        raise error.reworded(f"{error}; a robot file ends in {' or '.join(SUFFIXES)}") from None


def _named(description: Description, name: str, entry: CatalogueEntry) -> Description:
    """Apply the catalogue's name, tool and posture; the shipped files have their own."""
    if entry.package == SHIPPED:
        return replace(description, name=name)
    q = np.array(description.q_reference)
    base = description.nq - sum(description.actuated)
    joints = description.joint_names[description.nv - (description.nq - base) :]
    q[base:] = [entry.posture.get(joint, 0.0) for joint in joints]
    if entry.floating_base:
        q[2] = entry.height
    return replace(
        description,
        name=name,
        tool=entry.tool or description.tool,
        q_reference=q,
        configurations={"reference": q},
    )
