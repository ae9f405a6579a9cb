"""Pairs of links that an SRDF file says need not be checked for collisions."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

from opspace.errors import ModelError

SUFFIX = ".srdf"


def disabled_pairs(path: Path | str) -> dict[frozenset[str], str]:
    """Read which pairs of links an SRDF file disables.

    Args:
        path: The file.

    Returns:
        The reason that it gives, by the two links.

    Raises:
        ModelError: It cannot be read, is no SRDF, or disables no pair.
    """
    try:
        root = ET.parse(path).getroot()
    except (OSError, ET.ParseError) as error:
        raise ModelError(f"{path}: this SRDF file cannot be read: {error}") from None
    if root.tag != "robot":
        raise ModelError(f"{path}: an SRDF file begins with <robot>, not with <{root.tag}>")
    found: dict[frozenset[str], str] = {}
    for entry in root.iter("disable_collisions"):
        one, two = entry.get("link1"), entry.get("link2")
        if not one or not two:
            raise ModelError(f"{path}: an entry disable_collisions lacks link1 or link2")
        found[frozenset((one, two))] = entry.get("reason") or "no reason given"
    if not found:
        raise ModelError(f"{path}: this SRDF file disables no pair of links")
    return found
