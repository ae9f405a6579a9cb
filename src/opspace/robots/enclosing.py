"""The smallest capsule around points."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError


def enclosing_capsule(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Fit a capsule of little volume that holds every point, and so their convex hull.

    The distance to a segment is convex, so the farthest point of a hull is one of its corners.

    Args:
        points: (k, 3) m.

    Returns:
        Centres of its ends, (3,) each, and its radius, m.
    """
    corners = _corners(points)
    middle = corners.mean(axis=0)
    _, _, axes = np.linalg.svd(corners - middle, full_matrices=False)
    best, volume = np.concatenate([middle, middle]), math.inf
    for axis in axes:
        along = (corners - middle) @ axis
        wide = float(np.max(np.linalg.norm(corners - middle - np.outer(along, axis), axis=1)))
        low, high = min(along.min() + wide, 0.0), max(along.max() - wide, 0.0)
        start = np.concatenate([middle + low * axis, middle + high * axis])
        size = max(float(np.ptp(along)), 1e-3)
        simplex = np.concatenate([start[None], start + 0.1 * size * np.eye(6)])
        options = {"initial_simplex": simplex, "maxfev": 1500, "xatol": 1e-5, "fatol": 1e-10}
        found = minimize(_volume, start, (corners,), method="Nelder-Mead", options=options)
        if found.fun < volume:
            best, volume = found.x, float(found.fun)
    radius = float(np.max(_from_segment(best, corners)))
    return best[:3], best[3:], radius * (1.0 + 1e-9)


def _corners(points: np.ndarray) -> np.ndarray:
    try:
        return points[ConvexHull(points).vertices]
    except (QhullError, ValueError):  # flat, or too few
        return np.unique(points, axis=0)


def _volume(ends: np.ndarray, points: np.ndarray) -> float:
    radius = float(np.max(_from_segment(ends, points)))
    length = float(np.linalg.norm(ends[3:] - ends[:3]))
    return math.pi * radius * radius * (length + 4.0 / 3.0 * radius)


def _from_segment(ends: np.ndarray, points: np.ndarray) -> np.ndarray:
    start, way = ends[:3], ends[3:] - ends[:3]
    share = np.clip((points - start) @ way / max(float(way @ way), 1e-24), 0.0, 1.0)
    return np.linalg.norm(points - start - share[:, None] * way, axis=1)
