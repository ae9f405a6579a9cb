"""Convex hulls of points as faces."""

from __future__ import annotations

import numpy as np

from opspace.errors import InputError


def hull_faces(points: np.ndarray, what: str) -> np.ndarray:
    """Find the triangles of a convex hull.

    Args:
        points: (k, 3) m.
        what: What they are called in an error.

    Returns:
        (f, 4, 3) three corners, counter-clockwise seen from outside, and the outward normal of each.

    Raises:
        InputError: Not (k, 3), not finite, or points without a volume.
    """
    from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415 - slow to import

    if points.ndim != 2 or points.shape[1:] != (3,) or not np.all(np.isfinite(points)):
        raise InputError(f"{what} must be finite numbers (k, 3), not of shape {points.shape}")
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise InputError(f"{what} must be at least four points that are not in a plane") from error
    corners, normals = points[hull.simplices], hull.equations[:, :3]
    sides = corners[:, 1:] - corners[:, :1]
    behind = np.einsum("fi,fi->f", np.cross(sides[:, 0], sides[:, 1]), normals) < 0.0
    corners[behind] = corners[behind][:, ::-1]
    return np.concatenate([corners, normals[:, None]], axis=1)
