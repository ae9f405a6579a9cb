"""Find robots by name or by file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from warnings import warn

import numpy as np

from opspace.errors import ModelWarning, missing_extra, unknown_name
from opspace.robots.catalogue import CATALOGUE, SHIPPED, CatalogueEntry, locate
from opspace.robots.description import Description
from opspace.robots.loading import SUFFIXES, RobotFile, read_robot
from opspace.robots.protocol import Robot

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
    name_or_path: str | Path, *, backend: str = "pinocchio", floating_base: bool = False
) -> Robot:
    """Load a robot by name or from a URDF or MJCF file.

    Args:
        name_or_path: A name that ``available_robots`` lists, or a path ending in .urdf or .xml.
        backend: Library that computes the dynamics, "pinocchio" or "mujoco".
        floating_base: Free the root link. Humanoids and quadrupeds loaded by name are always free.

    Returns:
        The robot, updated at its reference posture at rest. What its file says and the controller
        does not follow is a `ModelWarning`, and stands in ``robot.description.warnings``.

    Raises:
        UnknownNameError: No robot or backend has this name.
        MissingExtraError: The robot's files are not installed.
        ModelError: The file does not exist or cannot be used.
    """
    if backend not in BACKENDS:
        raise unknown_name("backend", backend, BACKENDS)
    if isinstance(name_or_path, Path) or Path(name_or_path).suffix in SUFFIXES:
        file = read_robot(Path(name_or_path), backend, floating_base)
        return _built(file, file.description)
    entry = _entry(name_or_path)
    path = locate(entry)
    if path is None:
        raise missing_extra(entry.package, "robots")
    free = floating_base or entry.floating_base
    file = read_robot(path, backend, free, entry.locked_joints)
    return _built(file, _named(file.description, name_or_path, entry))


def _built(file: RobotFile, description: Description) -> Robot:
    for sentence in description.warnings:
        warn(f"{description.name}: {sentence}", ModelWarning, stacklevel=3)
    return file.build(description)


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
