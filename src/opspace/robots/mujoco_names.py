"""Names of what a compiled MJCF model has: one for everything, and no two alike."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from opspace.robots.description import BASE_JOINT, unused

if TYPE_CHECKING:
    from mujoco import MjModel

FREE, BALL = 0, 1
WIDTHS = {FREE: 6, BALL: 3}
"""Velocity coordinates of the joints that have several."""


class NamedFrame(NamedTuple):
    """A body or a site under the name that the robot knows it by.

    Attributes:
        name: The file's, or "site:" and the file's for a site that is named like a body.
        body: Number of the body, or of the one that carries the site.
        site: Number of the site, −1 for a body.
    """

    name: str
    body: int
    site: int


def frames(model: MjModel) -> tuple[NamedFrame, ...]:
    """List the bodies and sites that have a name.

    MJCF keeps a list of names per kind, so that a body and a site may share one: the plain name is
    then the body's.
    """
    bodies = [(model.body(i).name, i) for i in range(model.nbody)]
    sites = [(model.site(i).name, i) for i in range(model.nsite)]
    found = [NamedFrame(name, i, -1) for name, i in bodies if name]
    taken = {name for name, _ in bodies}
    given = taken | {name for name, _ in sites}
    for name, i in sites:
        if name:
            own = unused(f"site:{name}", given, "site:{}") if name in taken else name
            given.add(own)
            found.append(NamedFrame(own, int(model.site_bodyid[i]), i))
    return tuple(found)


def shared_names(model: MjModel) -> dict[str, str]:
    """Tell what the sites are called that are named like a body, by that name."""
    return {
        name: frame.name
        for frame in frames(model)
        if frame.site >= 0 and (name := model.site(frame.site).name) != frame.name
    }


def joint_names(model: MjModel) -> tuple[str, ...]:
    """Name every joint, those without a name by their number."""
    names = [model.joint(j).name for j in range(model.njnt)]
    taken = {name for name in names if name}
    for j, name in enumerate(names):
        if not name:
            kind = int(model.jnt_type[j])
            names[j] = unused(BASE_JOINT if kind == FREE else f"joint{j}", taken)
            taken.add(names[j])
    return tuple(names)


def coordinate_names(model: MjModel) -> tuple[str, ...]:
    """Name every velocity coordinate; those of joints with several are numbered."""
    widths = [WIDTHS.get(int(kind), 1) for kind in model.jnt_type]
    joints = list(zip(joint_names(model), widths, strict=True))
    taken = {name for name, width in joints if width == 1}
    names: list[str] = []
    for joint, width in joints:
        own = [joint] if width == 1 else [f"{joint}/{i}" for i in range(width)]
        names += own if width == 1 else [unused(name, taken) for name in own]
    return tuple(names)


def key_names(model: MjModel) -> tuple[str, ...]:
    """Name every key frame, those without a name by their number."""
    names = [model.key(i).name for i in range(model.nkey)]
    taken = {name for name in names if name}
    for i, name in enumerate(names):
        if not name:
            names[i] = unused(f"key{i}", taken)
            taken.add(names[i])
    return tuple(names)
