"""Hand a URDF tree on as text for a parser."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from opspace.robots.urdf import Urdf


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
