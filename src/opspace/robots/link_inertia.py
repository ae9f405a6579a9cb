"""Mass and inertia of a link as a URDF writes them, and whether a body can have them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping

import numpy as np

from opspace.robots.urdf_pose import attribute_floats, rpy_matrix

MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
ROUGH = 0.01
"""Part of the largest moment that is put down to rounding in the file."""


def inertia_of(inertial: ET.Element | None) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre of mass and rotational inertia of a link, in the link's frame.

    Args:
        inertial: Its element of this name; None is no mass.

    Returns:
        Mass in kg, centre of mass (3,) in m, inertia (3, 3) in kg·m² about the centre of mass.
    """
    if inertial is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    origin, mass, tensor = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    rotation = rpy_matrix(attribute_floats(origin, "rpy"))
    entries = tensor.attrib if tensor is not None else {}
    xx, xy, xz, yy, yz, zz = (float(entries.get(key, 0.0)) for key in MOMENTS)
    local = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return (
        float(mass.get("value", 0.0)) if mass is not None else 0.0,
        attribute_floats(origin, "xyz"),
        (rotation @ local @ rotation.T),
    )


def is_impossible(moments: np.ndarray, slack: float = 0.0) -> bool:
    """Tell whether no rigid body has these principal moments: the largest is more than the others' sum.

    Args:
        moments: (3,) kg·m².
        slack: Part of the largest by which it may be.
    """
    return bool(2.0 * moments.max() > moments.sum() + slack * moments.max())


def inertia_warnings(links: Mapping[str, ET.Element | None]) -> Iterator[str]:
    """Say which links have an inertia that no rigid body has.

    Args:
        links: The element ``inertial`` of links by name.
    """
    moments = {name: np.linalg.eigvalsh(inertia_of(link)[2]) for name, link in links.items()}
    odd = [name for name, found in moments.items() if is_impossible(found, ROUGH)]
    if odd:
        yield (
            f"no body has the inertia of {', '.join(odd)}, where one moment is more than the sum of the "
            "others: taken as the file has it"
        )
