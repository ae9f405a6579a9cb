"""What is drawn of contacts, as lines: forces, cones, soles, and the ground that a robot stands on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from opspace.robots.protocol import Robot
from opspace.view.frame import ContactFrame

CONE = 0.12
"""Height of a cone on the page, m."""
LONGEST = 0.45
"""Length of an arrow of the robot's whole weight, m."""
HEAD = 0.25
"""Part of an arrow that its head takes, of at most `MOST_HEAD`."""
MOST_HEAD = 0.03
LEVEL = 0.7
"""Contacts whose normal is steeper than this, its vertical part, carry on the ground."""
ABOVE = 0.003
"""How high above the ground lines are drawn, m."""


@dataclass(frozen=True)
class ContactPlace:
    """Where a contact is in one tick.

    Attributes:
        point: (3,) m.
        axes: (3, 3) its axes in the world, as columns, z out of the surface.
        corners: (k, 3) corners of what touches, m.
    """

    point: np.ndarray
    axes: np.ndarray
    corners: np.ndarray


def place_of(about: Mapping[str, Any], robot: Robot) -> ContactPlace:
    """Find where a contact is.

    Args:
        about: What the recording says about it.
        robot: The robot, updated.
    """
    frame = robot.frame_id(about["frame"])
    rotation = robot.rotation(frame)
    point = robot.position(frame) + rotation @ np.array(about["offset"])
    if about["half"] is None:
        return ContactPlace(point, _axes_about(np.array(about["normal"])), point[None])
    x, y = about["half"]
    if about.get("along") is not None:
        line = x * rotation @ np.array(about["along"])
        axes = _axes_about(np.array(about["normal"]), line)
        return ContactPlace(point, axes, np.array([point + line, point - line]))
    corners = [
        point + rotation @ (a * x, b * y, 0.0) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]
    return ContactPlace(point, rotation, np.array(corners))


def _axes_about(normal: np.ndarray, along: np.ndarray | None = None) -> np.ndarray:
    """Axes with z along a normal, and x as far as can be along a line."""
    if along is None:
        x = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    else:
        x = along - normal * (normal @ along)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal], axis=1)


def pressure_point(place: ContactPlace, contact: ContactFrame) -> np.ndarray:
    """Give the centre of pressure in the world, (3,) m."""
    return place.point + place.axes[:, :2] @ np.nan_to_num(contact.cop)


def arrow(start: np.ndarray, force: np.ndarray, weight: float) -> np.ndarray:
    """Draw a force as an arrow from where it acts, (k, 2, 3); nothing where it is none."""
    size = float(np.linalg.norm(force))
    if not size > 1e-3 * weight:
        return np.empty((0, 2, 3))
    along = force / size
    length = LONGEST * size / weight
    head = min(HEAD * length, MOST_HEAD)
    side = _axes_about(along)[:, 0] * head * 0.5
    tip = start + length * along
    back = tip - head * along
    return np.array([[start, tip], [tip, back + side], [tip, back - side]])


def cone(place: ContactPlace, friction: float) -> np.ndarray:
    """Draw the friction pyramid at a contact, (8, 2, 3)."""
    rays = [
        place.point + CONE * place.axes @ (friction * a, friction * b, 1.0)
        for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]
    edges = [[place.point, ray] for ray in rays]
    return np.array([*edges, *([a, b] for a, b in pairwise([*rays, rays[0]]))])


def outline(corners: np.ndarray) -> np.ndarray:
    """Draw a closed line through corners, (k, 2, 3); nothing where there is a single one."""
    if len(corners) < 2:
        return np.empty((0, 2, 3))
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def support(places: Sequence[ContactPlace]) -> np.ndarray:
    """Give the polygon over which a robot can stand still, (k, 3) on the ground, in order.

    Args:
        places: Contacts that carry; walls do not count.
    """
    level = [place for place in places if place.axes[2, 2] > LEVEL]
    if not level:
        return np.empty((0, 3))
    points = np.concatenate([place.corners for place in level])
    hull = _hull(points[:, :2])
    return np.column_stack([hull, np.full(len(hull), points[:, 2].min() + ABOVE)])


def _hull(points: np.ndarray) -> np.ndarray:
    """Return the convex hull of points in a plane, counter-clockwise (Andrew's chains)."""
    ordered = sorted(map(tuple, points.tolist()))

    def chain(found: Sequence[tuple[float, ...]]) -> list[tuple[float, ...]]:
        kept: list[tuple[float, ...]] = []
        for p in found:
            while len(kept) > 1 and _turns_right(kept[-2], kept[-1], p):
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return np.array([*chain(ordered), *chain(ordered[::-1])] or ordered)


def _turns_right(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0.0


def plumb(com: np.ndarray, ground: float) -> np.ndarray:
    """Draw a line from the centre of mass to the ground and a cross where it ends, (3, 2, 3)."""
    foot = np.array([com[0], com[1], ground + ABOVE])
    cross = [[foot - d, foot + d] for d in (np.array([0.03, 0, 0]), np.array([0, 0.03, 0]))]
    return np.array([[com, foot], *cross])


def known(contact: ContactFrame) -> bool:
    """Tell whether a contact is in the stack."""
    return not math.isnan(contact.progress)
