"""Tables of the shapes of a robot and of the pairs of links that are kept apart."""

from __future__ import annotations

import math
from collections.abc import Sequence

from opspace.robots.shapes import LinkCapsule
from opspace.tasks import CollisionAvoidance


def shapes_table(shapes: Sequence[LinkCapsule]) -> tuple[list[str], list[list[str]]]:
    """Write capsules, one row each.

    Returns:
        Heads with units, and rows.
    """
    heads = ["frame", "radius [mm]", "length [mm]", "balls"]
    rows: list[list[str]] = []
    for shape in shapes:
        length = math.dist(shape.start, shape.end)
        balls, _ = shape.balls()
        numbers = f"{1e3 * shape.radius:.0f}", f"{1e3 * length:.0f}", str(len(balls))
        rows.append([shape.frame, *numbers])
    return heads, rows


def pairs_table(guard: CollisionAvoidance) -> tuple[list[str], list[list[str]]]:
    """Write which pairs of links a guard keeps apart, and why others not.

    Returns:
        Heads, and rows.
    """
    kept = [[f"{one}/{two}", "kept apart"] for one, two in guard.pairs]
    left = [[f"{one}/{two}", why] for (one, two), why in guard.left_out.items()]
    return ["pair", "what becomes of it"], kept + left
