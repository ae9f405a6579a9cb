"""What a tool may touch, as shapes: tables and buttons with their rims, plates with holes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import trimesh

PIECE = 0.25
"""Radius of the piece that is drawn of what has no end, m."""
THICK = 0.008
"""How thick a surface is drawn, m."""
RIM = 8
"""Pieces of the curve of a rim."""
AROUND = 64
"""Corners of a circle."""


def touched_mesh(about: Mapping[str, Any]) -> trimesh.Trimesh:
    """Draw a surface or a hole, whichever an entry of a scenario's plant describes, in the world.

    Args:
        about: A surface, or a hole, which has a ``diameter``.
    """
    profile = _hole(about) if "diameter" in about else _surface(about)
    mesh = trimesh.creation.revolve(np.array(profile), sections=AROUND)
    mesh.apply_transform(trimesh.geometry.align_vectors([0.0, 0.0, 1.0], about["normal"]))
    mesh.apply_translation(about["point"])
    return mesh


def _surface(about: Mapping[str, Any]) -> Sequence[tuple[float, float]]:
    """Give radius and height of the outline of a surface, from below to its middle."""
    flat, bevel = about["size"] or PIECE, about["bevel"]
    rim: list[tuple[float, float]] = []
    if bevel > 0.0:
        past = np.linspace(bevel, 0.0, RIM + 1)
        rim = [(flat + p, -0.5 * p * p / bevel) for p in past.tolist()]
    else:
        rim = [(flat, 0.0)]
    return [(0.0, -THICK - bevel), (rim[0][0], -THICK - bevel), *rim, (0.0, 0.0)]


def _hole(about: Mapping[str, Any]) -> Sequence[tuple[float, float]]:
    """Give the outline of a plate with a blind hole, from below to the bottom of the hole."""
    radius = 0.5 * (about["diameter"] + about["clearance"])
    depth, chamfer = about["depth"], about["chamfer"]
    plate = 3.0 * math.hypot(radius, depth)
    return [
        (0.0, -depth - THICK),
        (plate, -depth - THICK),
        (plate, 0.0),
        (radius + chamfer, 0.0),
        (radius, -chamfer),
        (radius, -depth),
        (0.0, -depth),
    ]
