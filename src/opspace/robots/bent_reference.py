"""A reference posture from which the tool can be moved and turned every way.

Many files say no posture, and the middle of every range is a stretched arm: there a direction of the
tool is lost, and targets along it are not reached.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, islice, product

import numpy as np

from opspace.robots.adapter import AdapterBase
from opspace.robots.joint_units import joint_units
from opspace.robots.sampled_postures import sample_postures

POSTURES = 32
"""Postures in which is looked what is usual."""
LOST = 0.3
"""Part of what is usual below which a posture is singular."""
ENOUGH = 1.0
"""Part that a bent posture has: as far from being stretched as others are, with room to move."""
NONE = 1e-6
"""Part of its strongest direction with which a block has no weakest one in any posture."""
BENDS = (0.5, -0.5, 1.0, -1.0, 1.5, -1.5)
"""By how much a joint is bent, rad."""
MOST = 2
"""Joints that are bent at most: an elbow and a wrist."""
LINEAR, ANGULAR = slice(0, 3), slice(3, 6)
ROOM = 0.1
"""Part of its range that a bent joint keeps from its ends."""


def bent_reference(robot: AdapterBase) -> np.ndarray | None:
    """Bend a reference posture that is singular, by as little and in as few joints as does.

    Args:
        robot: An arm in its reference posture, where it is left.

    Returns:
        (nq,) the posture; None where there is nothing to mend: the reference posture is no singular
        one, or the tool cannot be moved and turned every way in any posture.
    """
    if robot.floating_base or robot.nq != robot.nv:
        return None
    try:
        return _bent(robot)
    except np.linalg.LinAlgError:  # a joint that moves no mass, which a controller refuses
        return None
    finally:
        robot.update(robot.q_reference, np.zeros(robot.nv))


def _bent(robot: AdapterBase) -> np.ndarray | None:
    rows = [_rows(robot, q) for q in islice(sample_postures(robot), POSTURES)]
    blocks = np.array([[_ends(one[part]) for part in (LINEAR, ANGULAR)] for one in rows])
    usual, strongest = np.median(blocks, axis=0).T
    if np.any(usual <= NONE * strongest):
        return None
    # Both at once, in units in which both are alike; an arm of five joints has no such posture.
    scale = 1.0 / np.sqrt(np.repeat(usual, 3))[:, None]
    both, most = np.median([_ends(scale * one) for one in rows], axis=0)

    def freedom(q: np.ndarray) -> float:
        one = scale * _rows(robot, q)
        parts = [_ends(one[part])[0] for part in (LINEAR, ANGULAR)]
        return min(*parts, _ends(one)[0] / both if both > NONE * most else np.inf)

    best = freedom(robot.q_reference)
    if best >= LOST:
        return None
    found = None
    for q in _bends(robot):
        score = freedom(q)
        if score >= ENOUGH:
            return q
        # Postures that are mirror images are the same but for rounding: the first is taken.
        if score > best + 1e-6:
            best, found = score, q
    return found if best >= LOST else None


def _bends(robot: AdapterBase) -> Iterator[np.ndarray]:
    """Bend hinges that move the tool, one before two and a little before more, within their ranges."""
    robot.update(robot.q_reference, np.zeros(robot.nv))
    moves = np.abs(robot.jacobian(robot.tool)).max(axis=0) > 0.0
    hinges = [i for i, unit in enumerate(joint_units(robot)) if unit == "rad" and moves[i]]
    width = robot.q_upper - robot.q_lower
    room = np.where(np.isfinite(width), ROOM * width, 0.0)
    for count in range(1, MOST + 1):
        for angles in sorted(product(BENDS, repeat=count), key=lambda those: np.abs(those).sum()):
            for joints in combinations(hinges, count):
                q = np.array(robot.q_reference)
                q[list(joints)] += angles
                if np.all((robot.q_lower + room <= q) | (q == robot.q_reference)) and np.all(
                    (q <= robot.q_upper - room) | (q == robot.q_reference)
                ):
                    yield q


def _rows(robot: AdapterBase, q: np.ndarray) -> np.ndarray:
    """Return J L⁻ᵀ of the tool, M = L Lᵀ: rows (6, n) whose products are J M⁻¹ Jᵀ."""
    robot.update(q, np.zeros(robot.nv))
    return np.linalg.solve(np.linalg.cholesky(robot.M), robot.jacobian(robot.tool).T).T


def _ends(rows: np.ndarray) -> tuple[float, float]:
    """Return the smallest and the largest eigenvalue of J M⁻¹ Jᵀ."""
    sigma = np.linalg.eigvalsh(rows @ rows.T)
    return float(sigma[0]), float(sigma[-1])
