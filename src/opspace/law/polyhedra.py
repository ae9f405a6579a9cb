"""Convex meshes: their faces, and how far points are from them."""

# jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingTypeStubs=false
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

FACE_ROWS = 4
"""Three corners of a face, and its normal."""


class Meshes(NamedTuple):
    """Which of some sets are meshes.

    Attributes:
        place: (k, 2) first face of each set and how many it has; none of a set that is a box.
        face: (faces, 4, 3) corners and outward normal of each in the axes of its set, m.
    """

    place: Int[np.ndarray, "k 2"]
    face: Float[np.ndarray, "f 4 3"]


def mesh_distance(
    point: Float[np.ndarray, " 3"], face: Float[np.ndarray, "f 4 3"]
) -> tuple[float, Float[np.ndarray, " 3"]]:
    """Signed distance of a point to a convex mesh, and where it grows.

    Inside it is that to the nearest face. Outside it is the least one to the faces, which are convex:
    to the foot on a face where that is inside it, and to the sides.

    Args:
        point: (3,) m.
        face: (f, 4, 3) corners, counter-clockwise seen from outside, and outward normal of each, m.

    Returns:
        The distance, below zero inside, and (3,) its gradient, of unit length.
    """
    corner, normal = face[:, :3], face[:, 3]
    height = np.einsum("fi,fi->f", normal, point - corner[:, 0])
    facing = int(np.argmax(height))
    if height[facing] <= 0.0:
        return float(height[facing]), normal[facing]
    side = np.roll(corner, -1, axis=1) - corner
    from_corner = point - corner
    share = np.einsum("fci,fci->fc", from_corner, side) / np.einsum("fci,fci->fc", side, side)
    nearest = (corner + np.clip(share, 0.0, 1.0)[..., None] * side).reshape(-1, 3)
    left_of = np.einsum("fci,fi->fc", np.cross(side, from_corner), normal)
    inside = np.all(left_of >= 0.0, axis=1) & (height > 0.0)
    foot = point - height[:, None] * normal
    apart = point - np.concatenate([nearest, foot[inside]])
    best = apart[np.argmin(np.einsum("ki,ki->k", apart, apart))]
    rho = float(np.linalg.norm(best))
    return (rho, best / rho) if rho > 0.0 else (float(height[facing]), normal[facing])
