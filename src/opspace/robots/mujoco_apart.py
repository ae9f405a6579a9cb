"""Take a compiled MuJoCo model apart into a specification of the same robot."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from opspace.errors import ModelError
from opspace.robots.description import ModelOrigin
from opspace.robots.mujoco_motors import ON_JOINT
from opspace.robots.mujoco_names import WIDTHS, joint_names, key_names

INSTEAD = "give the MjSpec, or the file, that it was compiled from"


def spec_of(model: mujoco.MjModel, origin: ModelOrigin) -> mujoco.MjSpec:
    """Write down a compiled model: bodies, joints, sites, what drives and binds them, key frames.

    Shapes are left out; what they weigh is in the bodies.

    Args:
        model: The model.
        origin: What errors call it.

    Returns:
        A specification that compiles to the same dynamics.

    Raises:
        ModelError: Something drives or binds joints that can only be read from the specification.
    """
    spec = mujoco.MjSpec()
    spec.modelname = origin.robot
    _prepare(spec, model)
    bodies = [spec.worldbody]
    names = joint_names(model)
    for b in range(1, model.nbody):
        body = bodies[model.body_parentid[b]].add_body(name=model.body(b).name)
        bodies.append(body)
        _copy_body(body, model, b)
        first = int(model.body_jntadr[b])
        for j in range(first, first + int(model.body_jntnum[b])):
            _copy_joint(body, model, j, names[j])
    for s in range(model.nsite):
        site = bodies[model.site_bodyid[s]].add_site(name=model.site(s).name)
        site.pos, site.quat = model.site_pos[s], model.site_quat[s]
    for t in range(model.ntendon):
        _copy_tendon(spec, model, t, names, origin)
    for i in range(len(model.actuator_trntype)):
        _copy_actuator(spec, model, i, names, origin)
    for e in range(model.neq):
        _copy_equality(spec, model, e, names, origin)
    for name, q in zip(key_names(model), model.key_qpos, strict=True):
        spec.add_key(name=name, qpos=np.array(q))
    return spec


def _prepare(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Let the compiler take numbers as they are."""
    compiler = spec.compiler
    compiler.degree = compiler.balanceinertia = compiler.autolimits = False
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for name in dir(model.opt):
        value = getattr(model.opt, name)
        if not name.startswith("_") and not callable(value) and hasattr(spec.option, name):
            setattr(spec.option, name, value)


def _copy_body(body: mujoco.MjsBody, model: mujoco.MjModel, b: int) -> None:
    body.pos, body.quat = model.body_pos[b], model.body_quat[b]
    body.explicitinertial = True
    body.mass, body.inertia = float(model.body_mass[b]), model.body_inertia[b]
    body.ipos, body.iquat = model.body_ipos[b], model.body_iquat[b]
    body.gravcomp = float(model.body_gravcomp[b])
    body.mocap = bool(model.body_mocapid[b] >= 0)


def _copy_joint(body: mujoco.MjsBody, model: mujoco.MjModel, j: int, name: str) -> None:
    kind, dof, place = (int(a[j]) for a in (model.jnt_type, model.jnt_dofadr, model.jnt_qposadr))
    joint = body.add_joint(name=name, type=mujoco.mjtJoint(kind))
    joint.pos, joint.axis = model.jnt_pos[j], model.jnt_axis[j]
    joint.align = 0
    joint.limited, joint.range = int(model.jnt_limited[j]), model.jnt_range[j]
    joint.actfrclimited = int(model.jnt_actfrclimited[j])
    joint.actfrcrange = model.jnt_actfrcrange[j]
    joint.actgravcomp = bool(model.jnt_actgravcomp[j])
    joint.armature = float(model.dof_armature[dof])
    joint.frictionloss = float(model.dof_frictionloss[dof])
    _set_curve(joint, "damping", model, "dof", dof)
    _set_curve(joint, "stiffness", model, "jnt", j)
    if hasattr(joint, "springyield"):  # since MuJoCo 4
        joint.springyield = model.jnt_springyield[j]
    if kind not in WIDTHS:
        joint.ref, joint.springref = float(model.qpos0[place]), float(model.qpos_spring[place])


def _set_curve(target: object, what: str, model: mujoco.MjModel, of: str, i: int) -> None:
    """Set a stiffness or damping, with the coefficients of higher powers where there are some."""
    more = getattr(model, f"{of}_{what}poly", None)  # since MuJoCo 4
    first = float(np.ravel(getattr(model, f"{of}_{what}")[i])[0])
    setattr(target, what, first if more is None else np.array([first, *more[i]]))


def _copy_tendon(
    spec: mujoco.MjSpec, model: mujoco.MjModel, t: int, names: tuple[str, ...], origin: ModelOrigin
) -> None:
    name = model.tendon(t).name or f"tendon{t}"
    first = int(model.tendon_adr[t])
    wraps = range(first, first + int(model.tendon_num[t]))
    if any(model.wrap_type[w] != mujoco.mjtWrap.mjWRAP_JOINT for w in wraps):
        raise ModelError(f"{origin}: tendon {name} runs through space: {INSTEAD}")
    tendon = spec.add_tendon(name=name)
    tendon.limited, tendon.range = int(model.tendon_limited[t]), model.tendon_range[t]
    tendon.actfrclimited = int(model.tendon_actfrclimited[t])
    tendon.actfrcrange = model.tendon_actfrcrange[t]
    tendon.armature = float(model.tendon_armature[t])
    tendon.springlength = model.tendon_lengthspring[t]
    _set_curve(tendon, "stiffness", model, "tendon", t)
    for w in wraps:
        tendon.wrap_joint(names[model.wrap_objid[w]], float(model.wrap_prm[w]))


def _copy_actuator(
    spec: mujoco.MjSpec, model: mujoco.MjModel, i: int, names: tuple[str, ...], origin: ModelOrigin
) -> None:
    name = model.actuator(i).name or f"actuator{i}"
    kind, target = int(model.actuator_trntype[i]), int(model.actuator_trnid[i, 0])
    known: dict[int, Callable[[int], str]] = {
        **dict.fromkeys(ON_JOINT, lambda j: names[j]),
        int(mujoco.mjtTrn.mjTRN_TENDON): lambda t: model.tendon(t).name or f"tendon{t}",
    }
    several = any(
        hasattr(model, f"actuator_{count}") and int(getattr(model, f"actuator_{count}")[i]) != 1
        for count in ("ctrlnum", "outnum")  # since MuJoCo 4
    )
    if kind not in known or several or int(model.actuator_plugin[i]) >= 0:
        raise ModelError(f"{origin}: actuator {name} pulls at no joint or tendon: {INSTEAD}")
    actuator = spec.add_actuator(name=name, target=known[kind](target))
    actuator.trntype = mujoco.mjtTrn(kind)
    actuator.gear, actuator.group = model.actuator_gear[i], int(model.actuator_group[i])
    for curve, kinds in (
        ("gain", mujoco.mjtGain),
        ("bias", mujoco.mjtBias),
        ("dyn", mujoco.mjtDyn),
    ):
        setattr(actuator, f"{curve}type", kinds(int(getattr(model, f"actuator_{curve}type")[i])))
        prm = getattr(actuator, f"{curve}prm")
        prm[:] = getattr(model, f"actuator_{curve}prm")[i, : len(prm)]
    for what in ("ctrl", "force", "act"):
        # With one input and one output each, all of these lie in the order of the actuators.
        setattr(actuator, f"{what}limited", int(getattr(model, f"actuator_{what}limited")[i]))
        setattr(actuator, f"{what}range", getattr(model, f"actuator_{what}range")[i])
    if hasattr(actuator, "armature"):  # since MuJoCo 4
        actuator.armature = float(model.actuator_armature[i])


def _copy_equality(
    spec: mujoco.MjSpec, model: mujoco.MjModel, e: int, names: tuple[str, ...], origin: ModelOrigin
) -> None:
    kind, ends = int(model.eq_type[e]), (int(model.eq_obj1id[e]), int(model.eq_obj2id[e]))
    name, what = model.equality(e).name or f"equality{e}", int(model.eq_objtype[e])
    if kind == mujoco.mjtEq.mjEQ_JOINT:
        called = [names[end] if end >= 0 else "" for end in ends]
    elif what in (mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_SITE):
        of = model.body if what == mujoco.mjtObj.mjOBJ_BODY else model.site
        called = [of(end).name for end in ends]
        if not all(called):
            raise ModelError(f"{origin}: {name} ties a body or site without a name: {INSTEAD}")
    else:
        raise ModelError(f"{origin}: {name} ties neither joints nor bodies: {INSTEAD}")
    equality = spec.add_equality(
        name=name, type=mujoco.mjtEq(kind), objtype=mujoco.mjtObj(what), name1=called[0]
    )
    equality.name2, equality.active = called[1], bool(model.eq_active0[e])
    equality.data = model.eq_data[e]
