"""What the actuators of a compiled MJCF model can give each joint, as MuJoCo applies them."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from opspace.robots.mujoco_names import WIDTHS

# As numbers: elements of MuJoCo's arrays are no members of its enumerations.
SERIES = tuple(
    map(
        int, (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    )
)
"""Dynamics that hand on no more than they are given."""
INTEGRATOR = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
ON_JOINT = tuple(map(int, (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)))


class Span(NamedTuple):
    """From the least to the largest force or torque."""

    least: float
    most: float

    def times(self, factor: float) -> Span:
        """Return what a lever makes of it."""
        ends = (self.least * factor, self.most * factor) if factor else (0.0, 0.0)
        return Span(min(ends), max(ends))

    def plus(self, other: Span) -> Span:
        """Return what two give together."""
        return Span(self.least + other.least, self.most + other.most)

    def clipped(self, least: float, most: float) -> Span:
        """Return what is left of it between two bounds."""
        return Span(min(max(self.least, least), most), min(max(self.most, least), most))


NOTHING, ANYTHING = Span(0.0, 0.0), Span(-math.inf, math.inf)


class Actuation(NamedTuple):
    """What drives the joints.

    Attributes:
        spans: Per velocity coordinate what its actuators give together, N·m or N.
        servos: Actuators that pull although nothing is asked of them.
        unread: Actuators whose force on a joint depends on the posture.
        shared: Joints that one tendon drives together, by the tendon.
    """

    spans: tuple[Span, ...]
    servos: tuple[str, ...]
    unread: tuple[str, ...]
    shared: dict[str, tuple[str, ...]]

    @property
    def limit(self) -> np.ndarray:
        """Return the torque that every joint has in both directions, (nv,) N·m or N."""
        return np.array([max(0.0, min(-span.least, span.most)) for span in self.spans])

    @property
    def range(self) -> np.ndarray:
        """Return the least and the largest torque of every joint, (2, nv) N·m or N."""
        return np.array(self.spans).reshape(-1, 2).T

    def without(self, followers: Iterable[str]) -> Actuation:
        """Leave out joints that others move: what a tendon gives them is the leader's."""
        gone = set(followers)
        left = {t: tuple(n for n in names if n not in gone) for t, names in self.shared.items()}
        return self._replace(shared={t: names for t, names in left.items() if len(names) > 1})


def read_motors(model: mujoco.MjModel, joints: Sequence[str]) -> Actuation:
    """Read the actuators: control and force ranges, gears, tendons, and the ranges of joints.

    Args:
        model: The compiled model.
        joints: (nv,) names of the coordinates.

    Returns:
        What they give.
    """
    driven: dict[int, Span] = {}
    pulled: dict[int, Span] = {}
    unread: list[str] = []
    working = [i for i in range(len(model.actuator_trntype)) if _works(model, i)]
    for i in working:
        kind, target = model.actuator_trntype[i], int(model.actuator_trnid[i, 0])
        if kind in ON_JOINT and model.jnt_type[target] not in WIDTHS:
            dof = int(model.jnt_dofadr[target])
            driven[dof] = driven.get(dof, NOTHING).plus(_geared(model, i))
        elif kind == mujoco.mjtTrn.mjTRN_TENDON and levers(model, target):
            pulled[target] = pulled.get(target, NOTHING).plus(_geared(model, i))
        else:
            unread.append(_name(model, i))
    shared: dict[str, tuple[str, ...]] = {}
    for tendon, given in pulled.items():
        force = given
        if model.tendon_actfrclimited[tendon]:
            force = force.clipped(*model.tendon_actfrcrange[tendon])
        arms = levers(model, tendon)
        for dof, arm in arms.items():
            driven[dof] = driven.get(dof, NOTHING).plus(force.times(arm))
        if len(arms) > 1:
            name = model.tendon(tendon).name or f"tendon{tendon}"
            shared[name] = tuple(joints[dof] for dof in arms)
    spans = [driven.get(dof, ANYTHING) for dof in range(model.nv)]
    for j in np.flatnonzero(model.jnt_actfrclimited):
        dof = int(model.jnt_dofadr[j])
        spans[dof] = spans[dof].clipped(*model.jnt_actfrcrange[j])
    servos = tuple(_name(model, i) for i in working if not _obeys(model, i))
    return Actuation(tuple(spans), servos, tuple(unread), shared)


def force_span(model: mujoco.MjModel, i: int) -> Span:
    """Return what an actuator gives at its transmission, before the gear."""
    span = ANYTHING
    asked = _control_span(model, i)
    if model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED and _obeys(model, i):
        span = asked.times(float(model.actuator_gainprm[i, 0]))
    many = len(model.actuator_forcelimited) != len(model.actuator_trntype)
    place = _place(model, "outadr", i) if many else i
    if model.actuator_forcelimited[place]:
        span = span.clipped(*model.actuator_forcerange[place])
    return span


def levers(model: mujoco.MjModel, tendon: int) -> dict[int, float]:
    """Return the moment arms of a tendon by velocity coordinate; none where they vary."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    arms: dict[int, float] = {}
    for w in range(first, first + count):
        if model.wrap_type[w] != mujoco.mjtWrap.mjWRAP_JOINT:
            return {}
        dof = int(model.jnt_dofadr[model.wrap_objid[w]])
        arms[dof] = arms.get(dof, 0.0) + float(model.wrap_prm[w])
    return arms


def motor_warnings(
    motors: Actuation, joints: Sequence[str], units: Sequence[str], *, floating: bool = False
) -> Iterator[str]:
    """Say what a torque limit cannot say.

    Args:
        motors: The actuators.
        joints: (nv,) names of the coordinates.
        units: (nv,) "N·m" or "N".
        floating: Whether the base floats, whose forces are shared among motors with one limit each.

    Yields:
        A sentence for each thing.
    """
    if motors.servos:
        yield (
            f"actuators {', '.join(motors.servos)} pull by themselves (position or velocity "
            "servos): switch them off (mjDSBL_ACTUATION) and write the torque to qfrc_applied"
        )
    if motors.unread:
        yield (
            f"what actuators {', '.join(motors.unread)} give a joint depends on the posture; "
            "their limits are not used"
        )
    for tendon, names in motors.shared.items():
        yield (
            f"tendon {tendon} drives {', '.join(names)} together; the controller gives each a "
            "torque of its own"
        )
    for name, unit, span in zip(joints, units, motors.spans, strict=True):
        least, most = span
        if not (least < 0.0 < most):
            yield (
                f"the motor of {name} gives {least:g} to {most:g} {unit}: it cannot be driven "
                "both ways"
            )
        elif -least != most and (floating or math.isinf(most - least)):
            yield (
                f"the motor of {name} gives {least:g} to {most:g} {unit}; {min(-least, most):g} "
                f"{unit} is taken as its limit in both directions"
            )


def _works(model: mujoco.MjModel, i: int) -> bool:
    """Whether an actuator is in no group that the file switches off."""
    group = int(model.actuator_group[i])
    off = int(getattr(model.opt, "disableactuator", 0))  # since MuJoCo 3.0.1
    return not (0 <= group < 31 and off >> group & 1)


def _obeys(model: mujoco.MjModel, i: int) -> bool:
    """Whether an actuator gives nothing but what it is told."""
    return bool(
        model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_dyntype[i] in (*SERIES, INTEGRATOR)
    )


def _control_span(model: mujoco.MjModel, i: int) -> Span:
    """Return what can reach the gain of an actuator."""
    span = ANYTHING
    unclamped = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    place = _place(model, "ctrladr", i)
    if model.actuator_dyntype[i] in SERIES and model.actuator_ctrllimited[place] and not unclamped:
        span = span.clipped(*model.actuator_ctrlrange[place])
    if model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE and model.actuator_actlimited[i]:
        span = span.clipped(*model.actuator_actrange[i])
    return span


def _geared(model: mujoco.MjModel, i: int) -> Span:
    return force_span(model, i).times(float(model.actuator_gear[i, 0]))


def _place(model: mujoco.MjModel, array: str, i: int) -> int:
    """Return where the numbers of an actuator are; since MuJoCo 4 it may have several inputs."""
    places = getattr(model, f"actuator_{array}", None)
    return i if places is None else int(places[i])


def _name(model: mujoco.MjModel, i: int) -> str:
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, i) or f"actuator{i}"
