"""Read a URDF file once, so that both dynamics libraries are given the same robot."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from opspace.errors import ModelError, unknown_name
from opspace.robots.description import (
    BASE_JOINT,
    WORLD,
    Description,
    ModelOrigin,
    mid_range,
    unused,
)
from opspace.robots.joint_roles import (
    Coupling,
    FileJoint,
    JointChoice,
    JointRoles,
    assign_roles,
)
from opspace.robots.link_inertia import MOMENTS, inertia_warnings
from opspace.robots.tool_choice import hand_of, is_called_tool, senses
from opspace.robots.urdf_pose import held_at

VECTORS = {"xyz", "rpy"}
NUMBERS = VECTORS | {
    *MOMENTS,
    "value",
    "lower",
    "upper",
    "effort",
    "velocity",
    "multiplier",
    "offset",
}
MOVING = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True)
class UrdfJoint:
    """One joint of the tree; limits are infinite where the file gives none.

    Attributes:
        armature: Inertia of its motor, kg·m² or kg. URDF has no word for it; a model in memory may
            bring one.
    """

    name: str
    kind: str
    parent: str
    child: str
    lower: float
    upper: float
    velocity: float
    effort: float
    axis: tuple[float, ...]
    element: ET.Element
    armature: float = 0.0

    @property
    def moving(self) -> bool:
        """Whether the joint has a degree of freedom."""
        return self.kind in MOVING


@dataclass(frozen=True)
class Urdf:
    """A URDF reduced to its kinematics and inertias, joints in depth-first order."""

    name: str
    origin: ModelOrigin
    root: str
    links: dict[str, ET.Element | None]
    joints: tuple[UrdfJoint, ...]
    roles: JointRoles

    @property
    def moving_joints(self) -> tuple[UrdfJoint, ...]:
        """The joints with a degree of freedom, in the order of q."""
        return tuple(j for j in self.joints if j.moving)


def read_urdf(
    path: Path,
    locked: Collection[str] | Mapping[str, float | None] = (),
    floating_base: bool = False,
    joints: Collection[str] | None = None,
    armature: float = 0.0,
) -> Urdf:
    """Read a URDF file; shapes and transmissions are left out.

    Args:
        path: The file.
        locked: Joints to hold fixed, and where, rad or m; at zero where only names are given.
        floating_base: Whether the root link is to move freely.
        joints: Joints to control; None for all.
        armature: Inertia of the motor at every joint, kg·m² or kg.

    Returns:
        The robot's tree.

    Raises:
        ModelError: The file does not exist, is no URDF, is not one tree, or its root cannot float.
        UnknownNameError: A joint that is asked for or followed is not in the file.
    """
    choice = replace(JointChoice.of(joints, locked), armature=armature)
    return reduce_urdf(_parse(path), ModelOrigin.of(path), choice, floating_base)


def reduce_urdf(
    root: ET.Element, origin: ModelOrigin, choice: JointChoice, floating_base: bool = False
) -> Urdf:
    """Read the outermost element of a URDF; see `read_urdf`.

    Args:
        root: The element.
        origin: Where it comes from.
        choice: Which joints are controlled, and where others are held.
        floating_base: Whether the root link is to move freely.

    Returns:
        The robot's tree.

    Raises:
        ModelError: It is no URDF, is not one tree, or its root cannot float.
        UnknownNameError: A joint that is asked for or followed is not there.
    """
    _check_numbers(root, origin)
    bodies = [_name(link, origin) for link in root.findall("link")]
    for repeated in (n for n in bodies if bodies.count(n) > 1):
        raise ModelError(f"{origin}: link {repeated!r} occurs twice")
    links = dict(zip(bodies, (link.find("inertial") for link in root.findall("link")), strict=True))
    elements = [joint for joint in root.findall("joint") if joint.get("type") is not None]
    names = [_name(joint, origin) for joint in elements]
    for repeated in (n for n in names if names.count(n) > 1):
        raise ModelError(f"{origin}: joint {repeated!r} occurs twice")
    roles = assign_roles(_file_joints(elements, origin), choice, origin.name)
    built = {
        _name(e, origin): replace(_joint(e, roles.locked, links, origin), armature=choice.armature)
        for e in elements
    }
    base, ordered = _depth_first(built, links, origin)
    if floating_base and base == WORLD:
        raise ModelError(f"{origin}: the root link {WORLD!r} cannot float")
    return Urdf(root.get("name") or origin.robot, origin, base, links, ordered, roles)


def describe_urdf(urdf: Urdf, floating_base: bool) -> Description:
    """Collect names, limits and a mid-range posture.

    Args:
        urdf: The robot's tree.
        floating_base: Whether the root link moves freely.

    Returns:
        The description.
    """
    moving = urdf.moving_joints
    base_v, base_q = (6, 7) if floating_base else (0, 0)
    free = np.full(base_v, math.inf)
    lower = np.concatenate([-free, [j.lower for j in moving]])
    upper = np.concatenate([free, [j.upper for j in moving]])
    q = np.zeros(base_q + len(moving))
    q[base_q:] = mid_range(lower[base_v:], upper[base_v:])
    if floating_base:
        q[3] = 1.0
    own = [j.name for j in moving]
    names = [unused(f"{BASE_JOINT}/{i}", own) for i in range(base_v)] + own
    units = ["m"] * (base_v // 2) + ["rad"] * (base_v // 2)
    units += ["m" if j.kind == "prismatic" else "rad" for j in moving]
    frames = ([] if WORLD in urdf.links else [WORLD]) + list(urdf.links)
    return Description(
        name=urdf.name,
        source=urdf.origin.file,
        nq=len(q),
        nv=len(names),
        joint_names=tuple(names),
        joint_units=tuple(units),
        frame_names=tuple(frames),
        tool=_tool(urdf),
        q_reference=q,
        q_lower=lower,
        q_upper=upper,
        velocity_limit=np.concatenate([free, [j.velocity for j in moving]]),
        torque_limit=np.concatenate([free, [j.effort for j in moving]]),
        actuated=np.arange(len(names)) >= base_v,
        quaternions=(3,) if floating_base else (),
        floating_base=floating_base,
        couplings=urdf.roles.couplings,
        locked=urdf.roles.locked,
        warnings=(
            *urdf.roles.warnings,
            *limit_warnings(moving),
            *inertia_warnings(_moved(urdf, floating_base)),
        ),
    )


def _moved(urdf: Urdf, floating_base: bool) -> dict[str, ET.Element | None]:
    """Return the links that move."""
    _, above = _above(urdf)
    return {
        link: inertial
        for link, inertial in urdf.links.items()
        if floating_base or above[link] is not None
    }


def limit_warnings(joints: Iterable[UrdfJoint]) -> Iterator[str]:
    """Say where a limit is there that limits nothing."""
    stuck = [j.name for j in joints if j.kind != "continuous" and math.isinf(j.upper)]
    if stuck:
        yield f"the lower and the upper limit of {', '.join(stuck)} are both 0: taken as no limit"


def _parse(path: Path) -> ET.Element:
    try:
        root = ET.parse(path).getroot()
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}") from None
    except (ET.ParseError, ValueError) as error:
        raise ModelError(f"{path}: not XML ({error})") from None
    if root.tag != "robot":
        raise ModelError(f"{path}: the outermost element is <{root.tag}>, not <robot>")
    if not root.findall("link"):
        raise ModelError(f"{path}: no <link> in the robot")
    return root


def _check_numbers(root: ET.Element, origin: ModelOrigin) -> None:
    for owner in (*root.findall("link/inertial"), *root.findall("joint")):
        for element in owner.iter():
            for key in NUMBERS & set(element.attrib):
                try:
                    values = [float(x) for x in element.attrib[key].split()]
                except ValueError:
                    values = []
                size = 3 if key in VECTORS else 1
                if len(values) != size or not np.isfinite(values).all():
                    text = element.attrib[key]
                    raise ModelError(
                        f"{origin}: {key}={text!r} of <{element.tag}> is not {size} number(s)"
                    )


def _name(element: ET.Element, origin: ModelOrigin) -> str:
    name = element.get("name")
    if not name:
        raise ModelError(f"{origin}: a <{element.tag}> has no name")
    return name


def _file_joints(elements: Sequence[ET.Element], origin: ModelOrigin) -> list[FileJoint]:
    moving = {_name(e, origin): e for e in elements if e.get("type") in MOVING}
    names = [_name(e, origin) for e in elements]
    return [_file_joint(name, e, moving, names, origin) for name, e in moving.items()]


def _file_joint(
    name: str,
    element: ET.Element,
    moving: Collection[str],
    names: Sequence[str],
    origin: ModelOrigin,
) -> FileJoint:
    mimic = element.find("mimic")
    if mimic is None:
        return FileJoint(name)
    leader = mimic.get("joint", "")
    if leader not in names:
        raise unknown_name(f"joint that {name!r} of {origin.name} mimics,", leader, names)
    ratio, offset = float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))
    if leader not in moving:
        return FileJoint(name, offset, "a fixed joint leads", never=True)
    return FileJoint(name, coupling=Coupling(name, leader, ratio, offset))


def _joint(
    element: ET.Element,
    locked: Mapping[str, float | None],
    links: Collection[str],
    origin: ModelOrigin,
) -> UrdfJoint:
    name, kind = _name(element, origin), element.get("type", "")
    if kind not in (*MOVING, "fixed"):
        raise ModelError(
            f"{origin}: joint {name!r} has type {kind!r}, not fixed or one of {MOVING}"
        )
    ends = {}
    for end in ("parent", "child"):
        tag = element.find(end)
        ends[end] = tag.get("link", "") if tag is not None else ""
        if ends[end] not in links:
            raise ModelError(f"{origin}: {end} link {ends[end]!r} of joint {name!r} does not exist")
    limit = element.find("limit")
    if kind in ("revolute", "prismatic") and limit is None:
        raise ModelError(f"{origin}: joint {name!r} has no <limit>")
    given = limit.attrib if limit is not None else {}
    lower, upper = float(given.get("lower", 0.0)), float(given.get("upper", 0.0))
    if kind in ("revolute", "prismatic") and lower > upper:
        raise ModelError(f"{origin}: lower limit of joint {name!r} is above its upper limit")
    if kind in ("revolute", "prismatic") and lower == upper != 0.0 and name not in locked:
        raise ModelError(
            f"{origin}: lower and upper limit of joint {name!r} are both {lower:g}: it cannot move; "
            "make it a fixed joint, or give it a range"
        )
    if kind == "continuous" or lower == upper:
        lower, upper = -math.inf, math.inf
    axis, slides = _axis(element, origin), kind == "prismatic"
    held = locked.get(name)
    return UrdfJoint(
        name=name,
        kind="fixed" if name in locked else kind,
        parent=ends["parent"],
        child=ends["child"],
        lower=lower,
        upper=upper,
        velocity=_largest(given, "velocity", name, origin),
        effort=_largest(given, "effort", name, origin),
        axis=axis,
        element=element if held is None else held_at(element, axis, slides, held),
    )


def _largest(limit: Mapping[str, str], key: str, joint: str, origin: ModelOrigin) -> float:
    """Return a limit of both directions; 0 and −1 are how files say that there is none."""
    value = float(limit.get(key, 0.0))
    if value in (0.0, -1.0):
        return math.inf
    if value < 0.0:
        raise ModelError(
            f"{origin}: {key}={value:g} of joint {joint!r} is below zero; 0 or -1 is no limit"
        )
    return value


def _axis(element: ET.Element, origin: ModelOrigin) -> tuple[float, ...]:
    tag = element.find("axis")
    text = tag.get("xyz", "1 0 0") if tag is not None else "1 0 0"
    direction = np.array(text.split(), dtype=float)
    length = float(np.linalg.norm(direction))
    if length == 0.0 and element.get("type") in MOVING:
        raise ModelError(f"{origin}: axis of joint {element.get('name')!r} has length zero")
    return tuple((direction / (length or 1.0)).tolist())


def _depth_first(
    joints: dict[str, UrdfJoint], links: Collection[str], origin: ModelOrigin
) -> tuple[str, tuple[UrdfJoint, ...]]:
    children = {j.child for j in joints.values()}
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        raise ModelError(f"{origin}: {len(roots)} root links {roots}, not one")
    below: dict[str, list[UrdfJoint]] = {}
    for name in sorted(joints, reverse=True):
        below.setdefault(joints[name].parent, []).append(joints[name])
    ordered, pending = [], list(below.get(roots[0], []))
    while pending:
        joint = pending.pop()
        ordered.append(joint)
        pending.extend(below.get(joint.child, []))
    if len(ordered) != len(links) - 1 or len(ordered) != len(joints):
        raise ModelError(f"{origin}: the joints do not connect the links to one tree")
    return roots[0], tuple(ordered)


def _tool(urdf: Urdf) -> str:
    """Return the last link of the longest chain, counted in controlled and then in all joints.

    Links behind a joint that is held, and those of a hand, are left out: a tool that other motors
    move is no frame of the arm's own. So are sensors. Of what the chain moves last, the tool is the
    link that carries the fingers of a hand, or what is fixed to that; and one that is called a tool.
    """
    carrier, above = _above(urdf)
    soft = {name for c in urdf.roles.couplings for name in (c.follower, c.leader)}
    hand = hand_of(((j.name, above[j.parent], carrier[j.parent]) for j in urdf.moving_joints), soft)
    depth, beyond = {urdf.root: (0, 0)}, {urdf.root: False}
    palms = {joint.parent for joint in urdf.moving_joints if joint.name in hand}
    held: dict[str, bool] = {urdf.root: urdf.root in palms}
    for joint in urdf.joints:
        moving, total = depth[joint.parent]
        depth[joint.child] = (moving + joint.moving, total + 1)
        locked = joint.name in urdf.roles.locked and joint.element.get("type") in MOVING
        beyond[joint.child] = joint.name in hand if joint.moving else locked or beyond[joint.parent]
        on_palm = not joint.moving and held[joint.parent]
        held[joint.child] = on_palm or joint.child in palms
    own = [link for link in depth if not beyond[link] and not senses(link)] or [urdf.root]
    last = carrier[max(own, key=lambda link: depth[link])]
    return max(
        (link for link in own if carrier[link] == last),
        key=lambda link: (held[link], is_called_tool(link), depth[link]),
    )


def _above(urdf: Urdf) -> tuple[dict[str, str], dict[str, str | None]]:
    """Return by link the first link of its rigid body, and the joint that moves this body."""
    carrier: dict[str, str] = {urdf.root: urdf.root}
    above: dict[str, str | None] = {urdf.root: None}
    for joint in urdf.joints:
        carrier[joint.child] = joint.child if joint.moving else carrier[joint.parent]
        above[joint.child] = joint.name if joint.moving else above[joint.parent]
    return carrier, above
