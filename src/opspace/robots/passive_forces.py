"""Forces that a robot has of its own: springs at its joints, and weight that is carried for it."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from opspace.robots.description import Springs
from opspace.robots.mujoco_names import WIDTHS, joint_names

_BIT = mujoco.mjtDisableBit
# One flag for all passive forces until MuJoCo 3.3.
_NO_SPRING = _BIT.mjDSBL_SPRING if hasattr(_BIT, "mjDSBL_SPRING") else _BIT.mjDSBL_PASSIVE


class _Sprung(NamedTuple):
    """Joints with springs: those that a stiffness describes, and the others."""

    linear: list[int]
    other: list[int]


def read_springs(model: mujoco.MjModel) -> Springs | None:
    """Read the linear springs of hinges and slides; None where there is none."""
    linear = _sprung(model).linear
    if not linear:
        return None
    entries = np.array([int(model.jnt_qposadr[j]) for j in linear])
    return Springs(
        coordinates=np.array([int(model.jnt_dofadr[j]) for j in linear]),
        entries=entries,
        stiffness=np.array([_stiffness(model, j) for j in linear]),
        relaxed=np.array(model.qpos_spring[entries]),
    )


def force_warnings(model: mujoco.MjModel, limits: np.ndarray) -> Iterator[str]:
    """Say what pulls at the joints and stays unknown to the controller.

    Args:
        model: The compiled model.
        limits: (nv,) torque limits.

    Yields:
        A sentence for each thing.
    """
    names = joint_names(model)
    if other := _sprung(model).other:
        yield (
            f"the springs of {_listed(names, other)} are not linear ones of hinges or slides; the "
            "controller does not know them"
        )
    tendons = np.flatnonzero(model.tendon_stiffness) if _springs_act(model) else ()
    if len(tendons):
        called = ", ".join(model.tendon(int(i)).name or f"tendon{i}" for i in tendons)
        yield f"the controller does not know the springs of the tendons {called}"
    if model.opt.density or model.opt.viscosity:
        yield "the controller does not know the drag of the medium (density, viscosity)"
    carries = [
        int(j)
        for j in np.flatnonzero(model.jnt_actgravcomp)
        if carries_weight(model) and np.isfinite(limits[model.jnt_dofadr[j]])
    ]
    if carries:
        yield (
            f"the motors of {_listed(names, carries)} carry weight besides (actuatorgravcomp); "
            "the controller counts their whole torque as its own"
        )


def carries_weight(model: mujoco.MjModel) -> bool:
    """Whether MuJoCo carries some of the weight itself."""
    return bool(np.any(model.body_gravcomp)) and bool(np.any(model.opt.gravity))


def _sprung(model: mujoco.MjModel) -> _Sprung:
    found = _Sprung([], [])
    if _springs_act(model):
        bent = np.zeros(model.njnt, dtype=bool)
        for array in ("jnt_stiffnesspoly", "jnt_springyield"):  # since MuJoCo 4
            if hasattr(model, array):
                bent |= np.any(np.reshape(getattr(model, array), (model.njnt, -1)), axis=1)
        stiff = np.reshape(model.jnt_stiffness, (model.njnt, -1)).any(axis=1)
        for j in np.flatnonzero(stiff | bent):
            linear = not bent[j] and int(model.jnt_type[j]) not in WIDTHS
            (found.linear if linear else found.other).append(int(j))
    return found


def _springs_act(model: mujoco.MjModel) -> bool:
    return not model.opt.disableflags & _NO_SPRING


def _stiffness(model: mujoco.MjModel, j: int) -> float:
    return float(np.ravel(model.jnt_stiffness[j])[0])


def _listed(names: Sequence[str], joints: Sequence[int]) -> str:
    return ", ".join(names[j] for j in joints)
