"""Which links of a robot are to be kept apart, and why others are not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from opspace.robots.protocol import Robot
from opspace.robots.shapes import LinkCapsule, joints_that_move

POSTURES = 1000
"""Random postures in which distances are looked at; the same for every robot."""

ALWAYS = 0.95
"""Links that overlap in more of the postures than this are built so."""

OFTEN = 0.4
"""Of links that are within the margin in more of the postures than this capsules cannot tell where they
touch: such a pair would be at its bound wherever the arm goes."""

NEAR = 0.05
"""Links that never come nearer than this need not be watched, m."""


class Pairs(NamedTuple):
    """Pairs of links.

    Attributes:
        kept: Those that are to be kept apart, by frame.
        left_out: Why the others are not.
    """

    kept: tuple[tuple[str, str], ...]
    left_out: dict[tuple[str, str], str]


def pairs_of(
    robot: Robot,
    shapes: Sequence[LinkCapsule],
    margin: float,
    disabled: Mapping[frozenset[str], str] | None = None,
) -> Pairs:
    """Choose the pairs of links that can collide and do not always.

    Left out are links with at most one joint between them, links that are nearer than the margin in the
    reference posture, and by what random postures inside the joint limits show, links that overlap
    nearly always, links that are within the margin so often that their capsules are too coarse for
    them, and links that never come near each other.

    Args:
        robot: The robot; it is not changed.
        shapes: Its capsules.
        margin: Distance that is to be kept, m.
        disabled: Pairs that somebody has chosen to leave out, with reasons; then random postures
            leave out none.

    Returns:
        The pairs.
    """
    frames = list(dict.fromkeys(shape.frame for shape in shapes))
    moved = dict(zip(frames, joints_that_move(robot, frames), strict=True))
    placed = _placed(robot, shapes)
    kept: list[tuple[str, str]] = []
    left_out: dict[tuple[str, str], str] = {}
    for one, two in combinations(frames, 2):
        if len(moved[one] ^ moved[two]) <= 1:
            left_out[one, two] = "at most one joint between them"
            continue
        if disabled is not None and (why := disabled.get(frozenset((one, two)))):
            left_out[one, two] = f"disabled: {why}"
            continue
        gap = np.min(
            [
                segment_distance(placed[i], placed[j]) - shapes[i].radius - shapes[j].radius
                for i in range(len(shapes))
                for j in range(len(shapes))
                if shapes[i].frame == one and shapes[j].frame == two
            ],
            axis=0,
        )
        reason = _near(gap, margin) if disabled is not None else _reason(gap, margin)
        if reason:
            left_out[one, two] = reason
        else:
            kept.append((one, two))
    return Pairs(tuple(kept), left_out)


def carried_pairs(
    robot: Robot, shapes: Sequence[LinkCapsule], carried: Sequence[LinkCapsule], margin: float
) -> tuple[tuple[str, str], ...]:
    """Choose the links that something on one frame is to be kept from.

    Args:
        robot: The robot; it is not changed, and its state is where the thing has been taken.
        shapes: The capsules of its links.
        carried: Those of the thing, all on one frame.
        margin: Distance that is to be kept, m.

    Returns:
        Links with more than one joint between that are not within the margin now, each with the frame.
    """
    frame = carried[0].frame
    links = list(dict.fromkeys(shape.frame for shape in shapes))
    moved = joints_that_move(robot, [*links, frame])
    probe = robot.fresh()
    probe.update(robot.q, np.zeros(robot.nv))
    found: list[tuple[str, str]] = []
    for link, joints in zip(links, moved, strict=False):
        if len(joints ^ moved[-1]) <= 1:
            continue
        near = min(
            float(segment_distance(_ends(probe, one)[None], _ends(probe, two)[None])[0])
            - one.radius
            - two.radius
            for one in shapes
            if one.frame == link
            for two in carried
        )
        if near >= margin:
            found.append((link, frame))
    return tuple(found)


def _reason(gap: np.ndarray, margin: float) -> str:
    if np.mean(gap < 0.0) > ALWAYS:
        return f"they overlap in {100.0 * np.mean(gap < 0.0):.0f} % of all postures"
    if near := _near(gap, margin):
        return near
    if np.mean(gap < margin) > OFTEN:
        return (
            f"within {1e3 * margin:g} mm in {100.0 * np.mean(gap < margin):.0f} % of all postures"
        )
    if np.min(gap) > NEAR + margin:
        return f"never nearer than {1e3 * np.min(gap):.0f} mm"
    return ""


def _near(gap: np.ndarray, margin: float) -> str:
    return f"{1e3 * gap[0]:.0f} mm apart in the reference posture" if gap[0] < margin else ""


def _placed(robot: Robot, shapes: Sequence[LinkCapsule]) -> np.ndarray:
    """Ends of all capsules (shapes, postures, 2, 3) in the reference posture, then in random ones [m].

    A base that moves freely stays where it is; so do joints of several coordinates.
    """
    probe, still = robot.fresh(), np.zeros(robot.nv)
    rng = np.random.default_rng(0)
    reach = np.minimum(robot.q_upper - robot.q_lower, 2.0 * math.pi)
    middle = np.where(np.isfinite(robot.q_lower), robot.q_lower, -math.pi) + 0.5 * reach
    single = robot.actuated & np.isfinite(robot.q_lower) & np.isfinite(robot.q_upper)
    straight = robot.nq == robot.nv
    start = np.zeros(robot.nv)
    probe.update(robot.q_reference, still)
    found = [[_ends(probe, shape) for shape in shapes]]
    for _ in range(POSTURES):
        wanted = middle + (rng.uniform(size=robot.nv) - 0.5) * reach
        if straight:
            q = probe.integrate(robot.q_reference, wanted - robot.q_reference, 1.0)
        else:
            start = wanted - _present(robot)
            q = probe.integrate(robot.q_reference, np.where(single, start, 0.0), 1.0)
        probe.update(q, still)
        found.append([_ends(probe, shape) for shape in shapes])
    return np.swapaxes(np.array(found), 0, 1)


def _present(robot: Robot) -> np.ndarray:
    """Joint positions (nv,) in the reference posture, behind a base that moves freely [rad, m]."""
    found = np.zeros(robot.nv)
    if robot.floating_base and robot.nq == robot.nv + 1:
        found[6:] = robot.q_reference[7:]
    return found


def _ends(robot: Robot, shape: LinkCapsule) -> np.ndarray:
    frame = robot.frame_id(shape.frame)
    ends = np.array([shape.start, shape.end])
    return robot.position(frame) + ends @ robot.rotation(frame).T


def segment_distance(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Distance of segments, (k, 2, 3) each, m: the least of inner points and of either's ends.

    Returns:
        (k,) m.
    """
    p, u = one[:, 0], one[:, 1] - one[:, 0]
    q, w = two[:, 0], two[:, 1] - two[:, 0]
    uu, uw, ww = (np.einsum("ki,ki->k", a, b) for a, b in ((u, u), (u, w), (w, w)))
    away = p - q
    ua, wa = np.einsum("ki,ki->k", u, away), np.einsum("ki,ki->k", w, away)
    det = uu * ww - uw * uw
    inside = np.where(det > 1e-12, (uw * wa - ww * ua) / np.where(det > 1e-12, det, 1.0), 0.0)
    best = np.full(len(p), np.inf)
    for start in (inside, np.zeros(len(p)), np.ones(len(p))):
        s = np.clip(start, 0.0, 1.0)
        t = np.clip((wa + s * uw) / np.where(ww > 0.0, ww, 1.0), 0.0, 1.0)
        s = np.clip((t * uw - ua) / np.where(uu > 0.0, uu, 1.0), 0.0, 1.0)
        gap = away + s[:, None] * u - t[:, None] * w
        best = np.minimum(best, np.linalg.norm(gap, axis=1))
    return best
