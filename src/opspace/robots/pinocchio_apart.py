"""Take a Pinocchio model apart into the tree of a URDF, which both dynamics libraries are given."""

# The compiled module pinocchio has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from opspace.errors import ModelError
from opspace.robots.description import Description, ModelOrigin, unused
from opspace.robots.joint_roles import JointChoice
from opspace.robots.link_inertia import MOMENTS
from opspace.robots.pinocchio_model import inertia_on_world
from opspace.robots.urdf import Urdf, describe_urdf, limit_warnings, reduce_urdf
from opspace.robots.urdf_pose import matrix_rpy

UNLIMITED = 1e30
"""Pinocchio writes the largest number there is where a limit is missing."""
LINKS = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)


class _Link(NamedTuple):
    """A link: its name, the joint that moves it, and its place on that."""

    name: str
    joint: int
    place: Any


def urdf_of(model: Any, floating_base: bool, choice: JointChoice) -> tuple[Urdf, bool]:
    """Read a model as if it were a URDF.

    Args:
        model: The ``pinocchio.Model``.
        floating_base: Whether to free the root link where the model does not.
        choice: Which joints are controlled, and where others are held.

    Returns:
        The robot's tree, and whether its root moves freely.

    Raises:
        ModelError: A joint is no hinge, slide or free base, or gravity is not that of a URDF.
        UnknownNameError: No joint has a name that is asked for.
    """
    origin = ModelOrigin(f"pinocchio.Model {model.name!r}", model.name or "the model", "robot")
    if not np.allclose(model.gravity.linear, pin.Model.gravity981):
        raise ModelError(f"{origin}: gravity other than 0 0 -9.81 m/s² is not supported")
    free = model.njoints > 1 and model.joints[1].shortname() == "JointModelFreeFlyer"
    first = 1 if free else 0
    tree = _Tree(model, first)
    root = ET.Element("robot", name=model.name or origin.robot)
    for link in tree.links:
        _write_link(root, link.name, tree.inertia(link))
    for name, link, parent in tree.fixed():
        _write_joint(root, name, "fixed", parent, link.name, parent.place.inverse() * link.place)
    for j in range(first + 1, model.njoints):
        _write_moving(root, model, j, tree, origin)
    urdf = reduce_urdf(root, origin, choice, floating_base or free)
    armature = {
        str(model.names[j]): float(model.armature[model.joints[j].idx_v])
        for j in range(first + 1, model.njoints)
    }
    joints = tuple(replace(j, armature=armature.get(j.name, 0.0)) for j in urdf.joints)
    return replace(urdf, joints=joints), floating_base or free


def describe_pinocchio(model: Any, urdf: Urdf, free: bool) -> Description:
    """Describe a model by its tree and the postures that it brings.

    Args:
        model: The ``pinocchio.Model``.
        urdf: Its tree.
        free: Whether its root moves freely.

    Returns:
        The description.
    """
    found = describe_urdf(urdf, free)
    names = [j.name for j in urdf.moving_joints]
    there = [str(name) for name in model.names if str(name) in names]
    stuck = [
        j for j in urdf.moving_joints if model.upperPositionLimit[_place(model, j.name)] == 0.0
    ]
    warnings = (*urdf.roles.warnings, *limit_warnings(stuck))
    if there != names:
        order = ", ".join(names)
        warnings += (f"the joints are in the order of a URDF, not of the model: {order}",)
    return replace(
        found,
        warnings=warnings,
        configurations={
            str(entry.key()): _configuration(model, np.array(entry.data()), names, found)
            for entry in model.referenceConfigurations
        },
    )


class _Tree:
    """Frames as links: one for each joint, that carries its mass, and what is fixed to it.

    Args:
        model: The ``pinocchio.Model``.
        first: The joint that the root link is on; 0 is the world.
    """

    def __init__(self, model: Any, first: int) -> None:
        self._model = model
        self._of_frame: dict[int, _Link] = {}
        self.own: dict[int, _Link] = {}
        for i, frame in enumerate(model.frames):
            if frame.type in LINKS and frame.parentJoint >= first:
                link = _Link(str(frame.name), int(frame.parentJoint), frame.placement)
                self._of_frame[i] = link
                if link.joint not in self.own and np.allclose(link.place.homogeneous, np.eye(4)):
                    self.own[link.joint] = link
        taken = {link.name for link in self._of_frame.values()}
        for j in range(first, model.njoints):
            if j not in self.own:
                name = unused(str(model.names[j]) if j else "base", taken)
                taken.add(name)
                self.own[j] = _Link(name, j, pin.SE3.Identity())

    @property
    def links(self) -> list[_Link]:
        """List the links."""
        invented = [link for link in self.own.values() if link not in self._of_frame.values()]
        return [*invented, *self._of_frame.values()]

    def fixed(self) -> Iterator[tuple[str, _Link, _Link]]:
        """List the links that are fixed to others, with the name of the joint between."""
        taken = {str(name) for name in self._model.names}
        for i, link in self._of_frame.items():
            if link is self.own[link.joint]:
                continue
            above = self._model.frames[self._model.frames[i].parentFrame]
            told = above.type == pin.FrameType.FIXED_JOINT and above.parentFrame != i
            name = unused(str(above.name) if told else f"{link.name} fixed", taken)
            taken.add(name)
            yield name, link, self.before(i, link.joint)

    def before(self, frame: int, joint: int) -> _Link:
        """Return the link on a joint that a frame hangs on."""
        frames, i = self._model.frames, frame
        while frames[i].parentFrame != i:
            i = int(frames[i].parentFrame)
            link = self._of_frame.get(i)
            if link is not None and link.joint == joint:
                return link
        return self.own[joint]

    def inertia(self, link: _Link) -> Any:
        """Return what a link weighs; a joint's own link carries all that is fixed to it."""
        if link is not self.own[link.joint]:
            return pin.Inertia.Zero()
        if link.joint > 0:
            return self._model.inertias[link.joint]
        return inertia_on_world(self._model)


def _write_link(root: ET.Element, name: str, inertia: Any) -> None:
    element = ET.SubElement(root, "link", name=name)
    if inertia.mass == 0.0:
        return
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(inertia.lever))
    ET.SubElement(inertial, "mass", value=repr(float(inertia.mass)))
    tensor = np.array(inertia.inertia)[np.triu_indices(3)]
    ET.SubElement(
        inertial,
        "inertia",
        {key: repr(float(value)) for key, value in zip(MOMENTS, tensor, strict=True)},
    )


def _write_joint(
    root: ET.Element, name: str, kind: str, parent: _Link, child: str, place: Any
) -> ET.Element:
    joint = ET.SubElement(root, "joint", name=name, type=kind)
    rpy = matrix_rpy(np.array(place.rotation))
    ET.SubElement(joint, "origin", xyz=_numbers(place.translation), rpy=_numbers(rpy))
    ET.SubElement(joint, "parent", link=parent.name)
    ET.SubElement(joint, "child", link=child)
    return joint


def _write_moving(root: ET.Element, model: Any, j: int, tree: _Tree, origin: ModelOrigin) -> None:
    joint, name = model.joints[j], str(model.names[j])
    kind, axis = _motion(model, j, origin)
    limit = _limit(model, joint, name, kind, origin)
    if kind == "revolute" and "lower" not in limit:
        kind = "continuous"
    at = next((i for i, f in enumerate(model.frames) if _is_joint(f, j)), 0)
    parent = tree.before(at, int(model.parents[j]))
    place = parent.place.inverse() * model.jointPlacements[j]
    element = _write_joint(root, name, kind, parent, tree.own[j].name, place)
    ET.SubElement(element, "axis", xyz=_numbers(axis))
    ET.SubElement(element, "limit", limit)


def _is_joint(frame: Any, j: int) -> bool:
    return frame.type == pin.FrameType.JOINT and int(frame.parentJoint) == j


def _motion(model: Any, j: int, origin: ModelOrigin) -> tuple[str, np.ndarray]:
    """Return how a joint moves in the words of a URDF, and its axis."""
    joint = model.joints[j]
    data = joint.createData()
    joint.calc(data, pin.neutral(model))
    S = np.array(data.S, float).reshape(6, -1)
    linear, angular = S[:3], S[3:]
    if joint.nv == 1 and angular.any() and not linear.any():
        return "revolute" if joint.nq == 1 else "continuous", angular[:, 0]
    if joint.nv == 1 and linear.any() and not angular.any():
        return "prismatic", linear[:, 0]
    raise ModelError(
        f"{origin}: joint {str(model.names[j])!r} is a {joint.shortname()}, not a hinge, a slide "
        "or a free base"
    )


def _limit(model: Any, joint: Any, name: str, kind: str, origin: ModelOrigin) -> dict[str, str]:
    limit: dict[str, str] = {}
    v, q = int(joint.idx_v), int(joint.idx_q)
    lower, upper = float(model.lowerPositionLimit[q]), float(model.upperPositionLimit[q])
    ends = [abs(lower) < UNLIMITED, abs(upper) < UNLIMITED]
    if kind != "continuous" and any(ends):
        if not all(ends):
            raise ModelError(f"{origin}: joint {name!r} has a limit on one side only")
        limit |= {"lower": repr(lower), "upper": repr(upper)}
    effort = float(model.effortLimit[v])
    if hasattr(model, "lowerEffortLimit"):  # since Pinocchio 4
        effort = min(effort, -float(model.lowerEffortLimit[v]))
    for key, value in (("effort", effort), ("velocity", float(model.velocityLimit[v]))):
        if math.isfinite(value) and abs(value) < UNLIMITED:
            limit[key] = repr(value)
    return limit


def _configuration(
    model: Any, q: np.ndarray, names: list[str], description: Description
) -> np.ndarray:
    """Arrange a posture of the model as the robot has it."""
    found = np.array(description.q_reference)
    base = description.nq - len(names)
    if base:
        found[:base] = q[[0, 1, 2, 6, 3, 4, 5]] if model.joints[1].nq == 7 else found[:base]
    for i, name in enumerate(names):
        joint = model.joints[model.getJointId(name)]
        at = int(joint.idx_q)
        found[base + i] = q[at] if joint.nq == 1 else math.atan2(q[at + 1], q[at])
    return found


def _place(model: Any, name: str) -> int:
    """Return where in q a joint begins."""
    return int(model.joints[model.getJointId(name)].idx_q)


def _numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)
