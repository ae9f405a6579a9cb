"""A hole that a round peg on the tool can be put into: where they touch, and what that pushes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from opspace.errors import InputError
from opspace.sim.surfaces import CREEP

EDGE_POINTS = 96
"""Points of a circle that may touch: between two of them it bends by 5e-4 of its radius."""
SHARING = 8
"""Of many points of a circle that touch the deepest carry nearly all: the p of a p-norm of depths."""


@dataclass(frozen=True)
class Hole:
    """A round blind hole in a flat plate, and the round peg on the tool that it is for.

    The peg ends at the origin of the tool, along whose z axis it points. Its rim touches the plate, the
    chamfer, the wall and the bottom; the two edges of the hole touch its side and its face. What
    each of these circles stores is ½ k D², with the p-norm D of the depths of its points: that is how
    deep the deepest is, without a kink where another takes its place. Friction is Coulomb's.

    Attributes:
        point: (3,) middle of its mouth, m.
        normal: (3,) direction out of it.
        diameter: Of the peg, m.
        clearance: What the hole is wider by, in diameter, m.
        depth: From the mouth to the bottom, m.
        chamfer: Width of the chamfer at the mouth, at 45°, m.
        stiffness: k, N/m.
        friction: μ.
        damping: b of the motion into what is touched, N·s/m.
    """

    point: Sequence[float]
    normal: Sequence[float] = (0.0, 0.0, 1.0)
    diameter: float = 0.02
    clearance: float = 1e-4
    depth: float = 0.02
    chamfer: float = 1e-3
    stiffness: float = 1e5
    friction: float = 0.1
    damping: float = 50.0

    def __post_init__(self) -> None:
        for name in ("point", "normal"):
            found = np.asarray(getattr(self, name), dtype=float)
            if found.shape != (3,) or not np.all(np.isfinite(found)):
                raise InputError(f"{name} of a hole must be 3 finite numbers, got {found}")
        if not np.linalg.norm(self.normal) > 0.0:
            raise InputError("the normal of a hole must point somewhere")
        for name in ("diameter", "clearance", "depth", "stiffness"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InputError(
                    f"{name} of a hole must be finite and above 0, got {getattr(self, name)}"
                )
        for name in ("friction", "damping", "chamfer"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise InputError(
                    f"{name} of a hole must be finite and >= 0, got {getattr(self, name)}"
                )
        if self.chamfer >= self.depth:
            raise InputError(
                f"the chamfer of a hole, {self.chamfer:g} m, must be less than its depth, "
                f"{self.depth:g} m"
            )

    @property
    def radius(self) -> float:
        """Of the hole below its chamfer, m."""
        return 0.5 * (self.diameter + self.clearance)

    @cached_property
    def axes(self) -> np.ndarray:
        """Axes of the hole as columns, (3, 3); z points out of it."""
        up = np.asarray(self.normal, dtype=float) / np.linalg.norm(self.normal)
        x = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(up, x), up])

    @cached_property
    def _edges(self) -> tuple[np.ndarray, ...]:
        """The edges of the hole in its axes, (3, k) m each."""
        bore = self.radius * _CIRCLE - [[0.0], [0.0], [self.chamfer]]
        return (bore,) if self.chamfer == 0.0 else (bore, (self.radius + self.chamfer) * _CIRCLE)

    def inserted(self, x: np.ndarray) -> float:
        """Return how deep the point x, (3,) m, is below the mouth, m."""
        return -float(self.axes[:, 2] @ (x - np.asarray(self.point, dtype=float)))

    def wrench(self, x: np.ndarray, rotation: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """Return the wrench on the peg.

        Args:
            x: (3,) end of the peg, m.
            rotation: (3, 3) of the tool.
            twist: (6,) velocity of the tool's origin and angular velocity, m/s and rad/s.

        Returns:
            (6,) N and N·m about the end of the peg; zero where nothing touches.
        """
        end = self.axes.T @ (x - np.asarray(self.point, dtype=float))
        # Wherever the peg points, what is left of it is above the plate.
        if end[2] > self.diameter:
            return np.zeros(6)
        turned = self.axes.T @ rotation
        speed = np.concatenate([self.axes.T @ twist[:3], self.axes.T @ twist[3:]])
        rim = 0.5 * self.diameter * (turned @ _CIRCLE)
        total = np.zeros(6)
        for depth, out in self._walls(rim + end[:, None]):
            total += self._pushed(rim, depth, out, speed)
        if math.hypot(end[0], end[1]) < self.radius + self.chamfer + self.diameter:
            for edge in self._edges:
                arm = edge - end[:, None]
                total += self._pushed(arm, *self._into_peg(arm, turned[:, 2]), speed)
        return np.concatenate([self.axes @ total[:3], self.axes @ total[3:]])

    def _walls(self, rim: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """How deep the rim is in the ring around the hole, and in its bottom, with the way out.

        Returns:
            Depths (k,) m, above 0 inside, and directions (3, k) of length 1, for each.
        """
        z, rho = rim[2], np.sqrt(rim[0] * rim[0] + rim[1] * rim[1])
        inwards = np.zeros_like(rim)
        inwards[:2] = -rim[:2] / np.maximum(rho, 1e-12)
        up = np.zeros_like(rim)
        up[2] = 1.0
        slope, wall = math.sqrt(0.5), rho - self.radius
        chamfer = slope * (wall - self.chamfer - z)
        depth = np.minimum(np.minimum(-z, chamfer), wall)
        out = np.where(depth == -z, up, np.where(depth == wall, inwards, slope * (inwards + up)))
        return (depth, out), (-self.depth - z, up)

    def _into_peg(self, edge: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How deep an edge (3, k) from the end is in the peg, and where that pushes it, (3, k)."""
        behind = -(axis @ edge)
        across = edge + behind * axis[:, None]
        rho = np.sqrt(np.sum(across * across, axis=0))
        side = 0.5 * self.diameter - rho
        push = np.where(side < behind, -across / np.maximum(rho, 1e-12), -axis[:, None])
        return np.minimum(side, behind), push

    def _pushed(
        self, arm: np.ndarray, depth: np.ndarray, out: np.ndarray, twist: np.ndarray
    ) -> np.ndarray:
        """Wrench (6,) of points ``arm`` (3, k) from the end, so deep (k,), pushed along ``out``."""
        inside = depth > 0.0
        if not inside.any():
            return np.zeros(6)
        depth, out, arm = depth[inside], out[:, inside], arm[:, inside]
        deepest = float(np.max(depth))
        part = depth / deepest
        norm = float(np.sum(part**SHARING)) ** (1.0 / SHARING)
        share = (part / norm) ** (SHARING - 1)
        v = twist[:3, None] + _cross(twist[3:, None], arm)
        along = np.sum(v * out, axis=0)
        normal = share * np.maximum(self.stiffness * deepest * norm - self.damping * along, 0.0)
        slip = v - along * out
        rubbing = self.friction / np.sqrt(np.sum(slip * slip, axis=0) + CREEP**2)
        force = normal * (out - rubbing * slip)
        return np.concatenate([force, _cross(arm, force)]).sum(axis=1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of columns, (3, k); NumPy's own takes most of a step."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


_ANGLES = 2.0 * math.pi * np.arange(EDGE_POINTS) / EDGE_POINTS
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(EDGE_POINTS)])
"""Points of a circle of radius 1 about z, (3, k)."""
