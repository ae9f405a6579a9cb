"""What a compiled MJCF model says of its joints: motors, couplings, loops and things that lie about."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from opspace.robots.joint_roles import Coupling, FileJoint
from opspace.robots.mujoco_motors import ON_JOINT
from opspace.robots.mujoco_names import FREE, WIDTHS, joint_names

NO_MOTOR = "no motor drives"
BY_ITSELF = "nothing but contact moves"
IN_A_LOOP = "a closed loop (connect or weld) binds"
TOGETHER = "a tendon drives, together with others,"
BENT = "an equality that is no straight line binds"
JOINT, CONNECT, WELD = (
    int(mujoco.mjtEq.mjEQ_JOINT),
    int(mujoco.mjtEq.mjEQ_CONNECT),
    int(mujoco.mjtEq.mjEQ_WELD),
)


def file_joints(model: mujoco.MjModel) -> list[FileJoint]:
    """Describe the joints of a compiled model.

    Args:
        model: The model.

    Returns:
        One description per joint, in order.
    """
    names = joint_names(model)
    driven, together = _driven(model)
    things = _things(model, driven)
    loops = _in_loops(model)
    bent, couplings = _equalities(model, names, driven | together)
    coupled = set(couplings) | {names.index(c.leader) for c in couplings.values()}
    home = home_configuration(model)
    found = []
    for j, name in enumerate(names):
        many, tree = int(model.jnt_type[j]) in WIDTHS, int(model.body_rootid[model.jnt_bodyid[j]])
        free = int(model.jnt_type[j]) == FREE
        why, never = "", False
        if tree in things:
            why, never = (BY_ITSELF, True) if free else (NO_MOTOR, False)
        elif free:
            pass
        elif j in loops:
            why, never = IN_A_LOOP, True
        elif j in bent:
            why, never = BENT, True
        elif j in together and j not in coupled:
            why, never = TOGETHER, False
        elif j not in driven | together:
            why, never = NO_MOTOR, False
        base = free and tree not in things
        at = None if many else float(home[model.jnt_qposadr[j]])
        coupling = None if j in loops else couplings.get(j)
        thing = model.body(model.jnt_bodyid[j]).name if free else ""
        found.append(FileJoint(name, at, why, never, base, coupling, thing))
    return found


def equality_warnings(model: mujoco.MjModel) -> Iterator[str]:
    """Name the active equalities that the controller does not follow, but for those of joints."""
    for i in map(int, np.flatnonzero(model.eq_active0)):
        kind = int(model.eq_type[i])
        if kind != JOINT and not (kind in (CONNECT, WELD) and _one_tree(model, i)):
            name = model.equality(i).name or f"equality{i}"
            yield f"the equality constraint {name} is no part of the controller's model"


def home_configuration(model: mujoco.MjModel) -> np.ndarray:
    """Return the configuration in which joints are held: a key frame of the file, or its zero."""
    keys = [model.key(i).name for i in range(model.nkey)]
    if "home" in keys:
        return np.array(model.key_qpos[keys.index("home")])
    return np.array(model.key_qpos[0] if keys else model.qpos0)


def _driven(model: mujoco.MjModel) -> tuple[set[int], set[int]]:
    """Return the joints that motors drive each on its own, and those that they drive together."""
    arms = [_arms(model, int(k), int(i)) for k, i in _transmissions(model)]
    if not arms:
        return {j for j in range(model.njnt) if int(model.jnt_type[j]) != FREE}, set()
    arms += [{int(j): 1.0} for j in np.flatnonzero(model.jnt_actfrclimited)]
    B = np.zeros((len(arms), model.njnt))
    for row, levers in zip(B, arms, strict=True):
        for joint, lever in levers.items():
            row[joint] = lever
    # A joint is driven on its own where some combination of the motors moves it alone.
    alone = np.einsum("ji,ij->j", np.linalg.pinv(B), B) > 1.0 - 1e-9
    own = set(np.flatnonzero(alone).tolist())
    for kind, target in _transmissions(model):
        # What these give depends on the posture; every joint before them may be driven.
        own |= set(_before(model, int(kind), int(target)))
    return own, set(np.flatnonzero(B.any(axis=0)).tolist()) - own


def _transmissions(model: mujoco.MjModel) -> list[tuple[int, int]]:
    return list(zip(model.actuator_trntype, model.actuator_trnid[:, 0], strict=True))


def _arms(model: mujoco.MjModel, kind: int, target: int) -> dict[int, float]:
    """Return the joints that an actuator turns, with levers, as far as these are constant."""
    if kind in ON_JOINT:
        return {target: 1.0}
    return _wrapped(model, target) if kind == mujoco.mjtTrn.mjTRN_TENDON else {}


def _wrapped(model: mujoco.MjModel, tendon: int) -> dict[int, float]:
    """Return the joints that a tendon acts on; empty for one that runs through space."""
    first = int(model.tendon_adr[tendon])
    wraps = range(first, first + int(model.tendon_num[tendon]))
    if any(model.wrap_type[w] != mujoco.mjtWrap.mjWRAP_JOINT for w in wraps):
        return {}
    return {int(model.wrap_objid[w]): float(model.wrap_prm[w]) for w in wraps}


def _before(model: mujoco.MjModel, kind: int, target: int) -> Iterator[int]:
    """Return the joints before a site that is pushed, or before those that a tendon runs through."""
    sites: list[int] = []
    if kind in (mujoco.mjtTrn.mjTRN_SITE, mujoco.mjtTrn.mjTRN_SLIDERCRANK):
        sites = [target]
    elif kind == mujoco.mjtTrn.mjTRN_TENDON:
        first = int(model.tendon_adr[target])
        wraps = range(first, first + int(model.tendon_num[target]))
        on_sites = mujoco.mjtWrap.mjWRAP_SITE
        sites = [int(model.wrap_objid[w]) for w in wraps if model.wrap_type[w] == on_sites]
    bodies = {body for site in sites for body in _path(model, int(model.site_bodyid[site]))}
    return (j for j in range(model.njnt) if int(model.jnt_bodyid[j]) in bodies)


def _things(model: mujoco.MjModel, driven: set[int]) -> set[int]:
    """Return the roots of the trees of bodies that no motor moves: cubes, doors, trays."""
    roots = {int(model.body_rootid[b]) for b in model.jnt_bodyid}
    return roots - {int(model.body_rootid[model.jnt_bodyid[j]]) for j in driven}


def _one_tree(model: mujoco.MjModel, i: int) -> bool:
    one, other = _ends(model, i)
    return min(one, other) > 0 and bool(model.body_rootid[one] == model.body_rootid[other])


def _ends(model: mujoco.MjModel, i: int) -> tuple[int, int]:
    """Return the two bodies of a connect or weld."""
    ends = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
    if int(model.eq_objtype[i]) == mujoco.mjtObj.mjOBJ_SITE:
        return int(model.site_bodyid[ends[0]]), int(model.site_bodyid[ends[1]])
    return ends


def _in_loops(model: mujoco.MjModel) -> set[int]:
    """Return the joints between two bodies of one tree that an equality ties together."""
    found: set[int] = set()
    for i in map(int, np.flatnonzero(model.eq_active0)):
        if int(model.eq_type[i]) in (CONNECT, WELD) and _one_tree(model, i):
            one, other = (set(_path(model, body)) for body in _ends(model, i))
            found |= {j for j in range(model.njnt) if int(model.jnt_bodyid[j]) in one ^ other}
    return found


def _path(model: mujoco.MjModel, body: int) -> Iterator[int]:
    while body > 0:
        yield body
        body = int(model.body_parentid[body])


def _equalities(
    model: mujoco.MjModel, names: Sequence[str], driven: set[int]
) -> tuple[set[int], dict[int, Coupling]]:
    """Return the joints that curves bind, and the followers of others along straight lines."""
    bent: set[int] = set()
    found: dict[int, Coupling] = {}
    for i in map(int, np.flatnonzero(model.eq_active0)):
        if int(model.eq_type[i]) != JOINT:
            continue
        one, other = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
        constant, slope, *rest = map(float, model.eq_data[i, :5])
        if other < 0 or any(rest) or one in found:
            bent.add(one)
            continue
        offset = float(model.qpos0[model.jnt_qposadr[one]]) + constant
        offset -= slope * float(model.qpos0[model.jnt_qposadr[other]])
        if one in driven and other not in driven and slope != 0.0:
            found[other] = Coupling(names[other], names[one], 1.0 / slope, -offset / slope)
        else:
            found[one] = Coupling(names[one], names[other], slope, offset)
    return bent, found
