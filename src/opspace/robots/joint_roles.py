"""Which joints of a file are controlled, which are held, and which follow another."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from opspace.errors import ModelError, unknown_name


@dataclass(frozen=True)
class Coupling:
    """A joint that is where another one puts it: ratio times the leader's position, plus offset."""

    follower: str
    leader: str
    ratio: float = 1.0
    offset: float = 0.0

    def __str__(self) -> str:
        offset = f" {self.offset:+g}" if self.offset else ""
        return f"{self.follower} = {self.ratio:g} {self.leader}{offset}"


@dataclass(frozen=True)
class JointChoice:
    """What somebody asks of the joints of a file.

    Attributes:
        joints: Names or patterns ("left_*") of those to control; None for all that have a motor.
        locked: Names or patterns of those to hold, and where, rad or m; names alone are held where
            the file has them.
        armature: Inertia of the motor at every joint of a URDF, kg·m² or kg, which has no word for it.
    """

    joints: tuple[str, ...] | None = None
    locked: Mapping[str, float | None] = field(default_factory=dict)
    armature: float = 0.0

    @classmethod
    def of(
        cls,
        joints: Collection[str] | None = None,
        locked: Collection[str] | Mapping[str, float | None] = (),
    ) -> JointChoice:
        """Read the arguments of ``load_robot``.

        Raises:
            ModelError: A name alone where several are asked for, or a position that is no number.
        """
        for what, given in (("joints", joints), ("locked", locked)):
            if isinstance(given, str):
                raise ModelError(f"{what} is a collection of names, not the text {given!r}")
        held: dict[str, float | None] = dict.fromkeys(locked)
        if isinstance(locked, Mapping):
            for name, value in locked.items():
                if value is not None and not math.isfinite(value):
                    raise ModelError(f"joint {name!r} cannot be locked at {value}")
                held[name] = None if value is None else float(value)
        return cls(None if joints is None else tuple(joints), held)


ALL_WITH_A_MOTOR = JointChoice()


@dataclass(frozen=True)
class FileJoint:
    """A joint as its file describes it.

    Attributes:
        name: Its name.
        home: Where the file has it, rad or m; None for a joint with several coordinates.
        why_held: Why it is held unless somebody asks for it, such as "no motor drives"; empty for
            a joint that is controlled.
        never: Whether it is held even then.
        base: Whether it is the free joint of the robot's own base.
        coupling: What it follows, if it does.
        thing: What else to call it, such as the body that a joint without a name moves.
    """

    name: str
    home: float | None = 0.0
    why_held: str = ""
    never: bool = False
    base: bool = False
    coupling: Coupling | None = None
    thing: str = ""


@dataclass(frozen=True)
class JointRoles:
    """What became of the joints.

    Attributes:
        locked: Where joints are held, rad or m; None for those with several coordinates, which
            are held where the file has them.
        couplings: Joints that follow a controlled one.
        warnings: Which joints are held although nobody asked for it, a sentence per reason.
    """

    locked: Mapping[str, float | None] = field(default_factory=dict)
    couplings: tuple[Coupling, ...] = ()
    warnings: tuple[str, ...] = ()


def assign_roles(found: Sequence[FileJoint], choice: JointChoice, file: str) -> JointRoles:
    """Decide which joints are controlled.

    Args:
        found: The joints of the file.
        choice: What is asked for.
        file: To name in errors.

    Returns:
        Their roles.

    Raises:
        UnknownNameError: No joint has a name that is asked for.
        ModelError: A joint is asked to move in a way that it cannot.
    """
    names = [joint.name for joint in found]
    held: dict[str, float | None] = {}
    for pattern, value in choice.locked.items():
        held.update(dict.fromkeys(_matching(pattern, names, file), value))
    asked = None
    if choice.joints is not None:
        asked = {n for pattern in choice.joints for n in _matching(pattern, names, file)}
        for name in sorted(asked & set(held)):
            raise ModelError(f"{file}: joint {name!r} cannot be controlled and locked")
    couplings = {j.name: j.coupling for j in found if j.coupling is not None}
    locked: dict[str, float | None] = {}
    reasons: dict[str, list[str]] = {}
    for joint in found:
        name = joint.name
        if name in held:
            value = held[name]
            if joint.home is None and value is not None:
                raise ModelError(
                    f"{file}: joint {name!r} has several coordinates and is held where the file "
                    "has it; lock it without a position"
                )
            locked[name] = joint.home if value is None else value
        elif name in couplings:
            if asked is not None and name in asked and _is_exact(choice.joints, name):
                raise ModelError(
                    f"{file}: joint {name!r} follows {couplings[name].leader!r}, which is the one "
                    "to control"
                )
        elif asked is not None and name not in asked:
            if not joint.base:
                locked[name] = joint.home
        elif joint.why_held and (asked is None or joint.never):
            if asked is not None:
                raise ModelError(
                    f"{file}: joint {name!r} cannot be controlled: {joint.why_held} it"
                )
            locked[name] = joint.home
            reasons.setdefault(joint.why_held, []).append(joint.thing or name)
    followers = _follow(couplings, locked, file)
    warnings = tuple(
        f"{why} {', '.join(those)}: held fixed; joints= and locked= of load_robot choose"
        for why, those in reasons.items()
    )
    return JointRoles(locked, followers, warnings)


def _follow(
    couplings: Mapping[str, Coupling], locked: dict[str, float | None], file: str
) -> tuple[Coupling, ...]:
    """Lock the followers of locked joints; return the others, each of one that follows nothing."""
    free: list[Coupling] = []
    for name, coupling in couplings.items():
        ratio, offset, leader, passed = coupling.ratio, coupling.offset, coupling.leader, {name}
        while leader in couplings and leader not in locked:
            if leader in passed:
                raise ModelError(f"{file}: joints {', '.join(sorted(passed))} follow each other")
            passed.add(leader)
            before = couplings[leader]
            ratio, offset = ratio * before.ratio, offset + ratio * before.offset
            leader = before.leader
        if leader in locked:
            locked.setdefault(name, ratio * (locked[leader] or 0.0) + offset)
        elif name in locked:
            raise ModelError(
                f"{file}: joint {name!r} follows {leader!r} and cannot be locked alone; lock "
                f"{leader!r}"
            )
        else:
            free.append(Coupling(name, leader, ratio, offset))
    return tuple(free)


def _matching(pattern: str, names: Sequence[str], file: str) -> list[str]:
    found = [n for n in names if n == pattern] or [n for n in names if fnmatchcase(n, pattern)]
    if not found:
        raise unknown_name(f"joint of {file}", pattern, names)
    return found


def _is_exact(joints: Collection[str] | None, name: str) -> bool:
    return joints is not None and name in joints
