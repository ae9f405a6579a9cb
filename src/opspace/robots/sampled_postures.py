"""Postures all over the workspace of a robot, always the same ones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from opspace.robots.protocol import BASE, Robot

SAMPLES = 200


def sample_postures(robot: Robot) -> Iterator[np.ndarray]:
    """Visit postures uniformly distributed within the joint limits.

    Where there are none it is one turn of a hinge, and ±π m of a slide: how far one without an end
    goes no model tells. What carries mass further out than that has less σ than any posture here.

    Args:
        robot: A robot whose joints have one coordinate each, its base fixed or floating.

    Yields:
        Configurations (nq,).
    """
    rng = np.random.default_rng(0)
    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)
    base = BASE if robot.floating_base else 0
    for _ in range(SAMPLES):
        joints = rng.uniform(lower, upper)
        # Where a floating base is makes no difference to any scale.
        yield np.concatenate([robot.q_reference[: base + 1], joints[base:]]) if base else joints
