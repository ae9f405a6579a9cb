"""Which frame a robot is led by where nobody says: none of a hand's fingers, and no camera."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

SENSOR = re.compile(r"camera|optical|(^|_)imu(_|$)|lidar", re.IGNORECASE)
"""How people call frames of what looks or feels from an arm."""

TOOL = re.compile(r"(^|_)(tool\d*|tcp|end_effector|ee)(_|$)", re.IGNORECASE)
"""How people call the frame that they lead."""


def is_called_tool(frame: str) -> bool:
    """Tell whether a file calls a frame a tool."""
    return TOOL.search(frame) is not None


def senses(frame: str) -> bool:
    """Tell whether a frame is that of a sensor by its name; nobody means one by a tool."""
    return SENSOR.search(frame) is not None


def hand_of(moving: Iterable[tuple[str, str | None, str]], soft: Collection[str]) -> set[str]:
    """Tell which joints belong to a hand, beyond which no tool is looked for.

    Args:
        moving: By joint its name, the controlled joint before it, and the rigid body that both
            hang on; a joint comes after the one before it.
        soft: Joints that follow or lead others.

    Returns:
        The followers and their leaders that carry no joint of another kind, the last joints that two
        or more branches of one body end with, and all joints of branches that are shorter, each, than
        the chain that leads to their body: fingers.
    """
    joints = list(moving)
    before = {name: parent for name, parent, _ in joints}
    arm: set[str | None] = set()
    for name, parent in before.items():
        above = parent if name not in soft else None
        while above is not None:
            arm.add(above)
            above = before[above]
    ends: dict[str, list[str]] = {}
    carrying = set(before.values())
    for name, parent, body in joints:
        if name not in carrying and parent is not None:
            ends.setdefault(body, []).append(name)
    fingers = {name for those in ends.values() if len(those) > 1 for name in those}
    return fingers | _short_branches(joints) | {n for n in before if n in soft and n not in arm}


def _short_branches(joints: Collection[tuple[str, str | None, str]]) -> set[str]:
    """Return the joints beyond a body from which two or more chains go on, all shorter than its own."""
    depth: dict[str | None, int] = {None: 0}
    for name, parent, _ in joints:
        depth[name] = depth[parent] + 1
    length = dict.fromkeys((name for name, _, _ in joints), 1)
    for name, parent, _ in reversed(list(joints)):
        if parent is not None:
            length[parent] = max(length[parent], length[name] + 1)
    branches: dict[tuple[str | None, str], list[str]] = {}
    for name, parent, body in joints:
        branches.setdefault((parent, body), []).append(name)
    fingers: set[str] = set()
    for name, parent, body in joints:
        beside = branches[parent, body]
        longest = max(length[branch] for branch in beside)
        if parent in fingers or (len(beside) > 1 and depth[parent] > longest):
            fingers.add(name)
    return fingers
