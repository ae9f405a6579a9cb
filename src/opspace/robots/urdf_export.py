"""Hand a URDF tree on: as text for a parser, and link by link."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from opspace.robots.urdf import MOMENTS, Urdf
from opspace.robots.urdf_pose import attribute_floats, rpy_matrix


def to_xml(
    urdf: Urdf, *, inertias: bool, prefix: str = "", compiler: dict[str, str] | None = None
) -> str:
    """Write the reduced URDF as text.

    Joints are sorted by name: URDF leaves the order open, Pinocchio sorts and MuJoCo does not.

    Args:
        urdf: The robot's tree.
        inertias: Whether to write the links' inertias.
        prefix: Put before every joint's name.
        compiler: MuJoCo's compiler options; None writes none.

    Returns:
        XML text.
    """
    out = ET.Element("robot", name=urdf.name)
    if compiler is not None:
        ET.SubElement(ET.SubElement(out, "mujoco"), "compiler", compiler)
    for name, inertial in urdf.links.items():
        link = ET.SubElement(out, "link", name=name)
        if inertias and inertial is not None:
            link.append(inertial)
    for joint in sorted(urdf.joints, key=lambda j: j.name):
        # Pinocchio gives a continuous joint two coordinates (cos, sin); a revolute joint has one.
        kind = "revolute" if joint.kind == "continuous" else joint.kind
        element = ET.SubElement(out, "joint", name=prefix + joint.name, type=kind)
        for tag in ("origin", "parent", "child", "dynamics"):
            element.extend(joint.element.findall(tag))
        if joint.moving:
            ET.SubElement(element, "axis", xyz=" ".join(map(repr, joint.axis)))
            # The range is a placeholder that the parsers demand; both adapters set the real one.
            ET.SubElement(element, "limit", lower="-1", upper="1", effort="0", velocity="0")
    return ET.tostring(out, encoding="unicode")


def inertia(urdf: Urdf, link: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre of mass and rotational inertia of a link, in the link's frame.

    Args:
        urdf: The robot's tree.
        link: Name of the link.

    Returns:
        Mass in kg, centre of mass (3,) in m, inertia (3, 3) in kg·m² about the centre of mass.
    """
    element = urdf.links[link]
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    origin, mass, tensor = (element.find(tag) for tag in ("origin", "mass", "inertia"))
    xyz = attribute_floats(origin, "xyz")
    rotation = rpy_matrix(attribute_floats(origin, "rpy"))
    entries = tensor.attrib if tensor is not None else {}
    xx, xy, xz, yy, yz, zz = (float(entries.get(key, 0.0)) for key in MOMENTS)
    local = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return (
        float(mass.get("value", 0.0)) if mass is not None else 0.0,
        xyz,
        (rotation @ local @ rotation.T),
    )
