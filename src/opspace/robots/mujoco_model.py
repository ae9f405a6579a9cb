"""Compile robot files with MuJoCo and read names and limits from the result."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import mujoco
import numpy as np

from opspace.errors import ModelError
from opspace.robots.description import BASE_JOINT, WORLD, Description, mid_range
from opspace.robots.joint_units import effort_unit
from opspace.robots.mujoco_motors import ON_JOINT, motor_warnings, read_motors
from opspace.robots.mujoco_names import (
    BALL,
    FREE,
    WIDTHS,
    NamedFrame,
    coordinate_names,
    frames,
    key_names,
    shared_names,
)
from opspace.robots.mujoco_scene import add_scenery, add_skeleton
from opspace.robots.passive_forces import force_warnings, read_springs
from opspace.robots.urdf import Urdf, read_urdf
from opspace.robots.urdf_export import inertia, to_xml

# MuJoCo refuses a moving body without mass. A picogram adds less than rounding does.
NEGLIGIBLE = 1e-12
SLIDE, HINGE = 2, 3


def mujoco_model(
    source: Path | str, floating_base: bool = False, locked_joints: Sequence[str] = ()
) -> mujoco.MjModel:
    """Compile a robot file into a plant that can be simulated and rendered.

    The dynamics are those of the robot that ``load_robot`` gives for the same arguments, plus what
    an MJCF file says about friction and contact. A URDF is drawn as capsules between its joints; a
    floor, a sky and a light are added where there are none. Nothing that is added has mass or
    takes part in contact.

    Args:
        source: URDF or MJCF file.
        floating_base: Whether the root link moves freely.
        locked_joints: URDF joints to hold fixed at zero.

    Returns:
        The compiled model.

    Raises:
        ModelError: MuJoCo cannot use the file.
    """
    path = Path(source)
    if path.suffix == ".urdf":
        spec = urdf_spec(read_urdf(path, locked_joints, floating_base), floating_base)
        add_skeleton(spec)
    else:
        spec = mjcf_spec(path, floating_base, locked_joints)
    add_scenery(spec)
    model = compile_spec(spec, path)
    # Where actuators carry weight, MuJoCo counts it to them; the plant drives joints without any.
    model.jnt_actgravcomp[:] = 0
    return model


def mjcf_spec(
    path: Path, floating_base: bool, locked_joints: Collection[str] = ()
) -> mujoco.MjSpec:
    """Read an MJCF file.

    Args:
        path: The file.
        floating_base: Whether to free the root body where the file does not.
        locked_joints: Must be empty; only the joints of a URDF can be locked.

    Returns:
        The specification, to be compiled.

    Raises:
        ModelError: The file does not exist, MuJoCo cannot parse it, or joints are to be locked.
    """
    if locked_joints:
        raise ModelError(f"{path}: joints can be locked in URDF files only")
    if not path.is_file():
        raise ModelError(f"{path}: no such file")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, RuntimeError) as error:
        raise _refused(path, error) from None
    if floating_base:
        _free_mjcf(spec, path)
    return spec


def urdf_spec(urdf: Urdf, floating_base: bool) -> mujoco.MjSpec:
    """Turn a URDF tree into a MuJoCo specification with the same dynamics.

    Args:
        urdf: The robot's tree.
        floating_base: Whether the root link moves freely.

    Returns:
        The specification, to be compiled.

    Raises:
        ModelError: MuJoCo cannot use the tree.
    """
    compiler = {"fusestatic": "false", "inertiafromgeom": "false", "discardvisual": "false"}
    try:
        spec = mujoco.MjSpec.from_string(to_xml(urdf, inertias=False, compiler=compiler))
    except (ValueError, RuntimeError) as error:
        raise _refused(urdf.path, error) from None
    spec.modelname = urdf.name
    if floating_base:
        _free(spec.body(urdf.root), urdf.path)
    for joint in urdf.moving_joints:
        element = spec.joint(joint.name)
        limited = np.isfinite(joint.lower) and np.isfinite(joint.upper)
        element.limited = int(limited)
        element.range = [joint.lower, joint.upper] if limited else [0.0, 0.0]
        element.actfrclimited = int(np.isfinite(joint.effort))
        element.actfrcrange = [-joint.effort, joint.effort] if element.actfrclimited else [0, 0]
    for link in urdf.links:
        if link != WORLD:
            _set_inertia(spec.body(link), urdf, link)
    return spec


def compile_spec(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    """Compile a specification.

    Args:
        spec: The specification.
        path: File to name in an error.

    Returns:
        The compiled model.

    Raises:
        ModelError: MuJoCo refuses it.
    """
    try:
        model = spec.compile()
    except (ValueError, RuntimeError) as error:
        raise _refused(path, error) from None
    if np.any(model.tendon_armature):
        raise ModelError(f"{path}: tendon armature is not supported")
    armature = np.flatnonzero(getattr(model, "actuator_armature", ()))  # since MuJoCo 4
    if not np.isin(model.actuator_trntype[armature], ON_JOINT).all():
        raise ModelError(f"{path}: armature of actuators that are not on a joint is not supported")
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        model.opt.gravity[:] = 0.0
    return model


def describe_mujoco(model: mujoco.MjModel, path: Path) -> Description:
    """Collect names, limits and postures from a compiled MJCF model.

    Args:
        model: The compiled model.
        path: The file it came from.

    Returns:
        The description.
    """
    names, found = coordinate_names(model), frames(model)
    free = model.jnt_type[model.dof_jntid] == FREE
    lower, upper = _ranges(model)
    poses = map(np.array, model.key_qpos)
    keys = dict(zip(key_names(model), poses, strict=True))
    motors = read_motors(model, names)
    units = _units(model)
    efforts = [effort_unit(unit) for unit in units]
    return Description(
        name=path.stem,
        source=path,
        nq=model.nq,
        nv=model.nv,
        joint_names=names,
        joint_units=units,
        frame_names=tuple(frame.name for frame in found),
        tool=_tool(model, found),
        q_reference=keys.get("home", next(iter(keys.values()), _middle(model, lower, upper))),
        q_lower=lower,
        q_upper=upper,
        velocity_limit=np.full(model.nv, np.inf),
        torque_limit=motors.limit,
        actuated=~free,
        quaternions=_quaternions(model),
        floating_base=bool(free.any()),
        configurations=keys,
        springs=read_springs(model),
        warnings=(
            *_shared(model),
            *motor_warnings(motors, names, efforts),
            *force_warnings(model, motors.limit),
        ),
    )


def _units(model: mujoco.MjModel) -> tuple[str, ...]:
    units: list[str] = []
    for kind in model.jnt_type:
        own = {FREE: ("m",) * 3 + ("rad",) * 3, BALL: ("rad",) * 3, SLIDE: ("m",)}
        units += own.get(int(kind), ("rad",))
    return tuple(units)


def _shared(model: mujoco.MjModel) -> list[str]:
    return [
        f"a body and a site are called {name!r}: the frame {name!r} is the body, {site!r} the site"
        for name, site in shared_names(model).items()
    ]


def _quaternions(model: mujoco.MjModel) -> tuple[int, ...]:
    """Return where in q the quaternions start."""
    places = zip(model.jnt_type, model.jnt_qposadr, strict=True)
    return tuple(int(a) + (3 if k == FREE else 0) for k, a in places if k in WIDTHS)


def _ranges(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = np.full(model.nv, -np.inf), np.full(model.nv, np.inf)
    for j in np.flatnonzero(model.jnt_limited):
        # The range of a ball joint limits an angle that is no coordinate.
        if model.jnt_type[j] in (SLIDE, HINGE):
            lower[model.jnt_dofadr[j]], upper[model.jnt_dofadr[j]] = model.jnt_range[j]
    return lower, upper


def _middle(model: mujoco.MjModel, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    q, middle = np.array(model.qpos0), mid_range(lower, upper)
    for j in np.flatnonzero(model.jnt_limited):
        if model.jnt_type[j] in (SLIDE, HINGE):
            q[model.jnt_qposadr[j]] = middle[model.jnt_dofadr[j]]
    return q


def _refused(path: Path, error: Exception) -> ModelError:
    return ModelError(f"{path}: MuJoCo cannot use it: {' '.join(str(error).split())}")


def _free(root: mujoco.MjsBody, path: Path) -> None:
    if root.joints:
        name = root.joints[0].name
        raise ModelError(f"{path}: root body {root.name!r} has joint {name!r} and cannot float")
    root.add_freejoint(name=BASE_JOINT)


def _free_mjcf(spec: mujoco.MjSpec, path: Path) -> None:
    roots = [body for body in spec.worldbody.bodies if body.joints or body.bodies]
    if len(roots) != 1:
        raise ModelError(f"{path}: a floating base needs one root body, not {len(roots)}")
    if roots[0].joints and roots[0].joints[0].type == mujoco.mjtJoint.mjJNT_FREE:
        return
    _free(roots[0], path)
    spec.compiler.boundmass = max(spec.compiler.boundmass, NEGLIGIBLE)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, NEGLIGIBLE)
    pose = np.concatenate([roots[0].pos, roots[0].quat])
    for key in spec.keys:
        key.qpos = np.concatenate([pose, key.qpos]) if len(key.qpos) else key.qpos
        key.qvel = np.concatenate([np.zeros(6), key.qvel]) if len(key.qvel) else key.qvel


def _set_inertia(body: mujoco.MjsBody, urdf: Urdf, link: str) -> None:
    mass, center, tensor = inertia(urdf, link)
    if body.joints and mass < NEGLIGIBLE:
        mass, tensor = NEGLIGIBLE, tensor + NEGLIGIBLE * np.eye(3)
    moments, axes = np.linalg.eigh(tensor)
    if np.linalg.det(axes) < 0:
        axes[:, 2] *= -1.0
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, axes.flatten())
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat, body.inertia = mass, center, quat, moments


def _tool(model: mujoco.MjModel, frames: Sequence[NamedFrame]) -> str:
    """Return "tool" where it exists, else the last site or body of the longest chain."""
    if any(frame.name == "tool" for frame in frames):
        return "tool"
    depth = np.zeros((model.nbody, 2), dtype=int)
    for body in range(1, model.nbody):
        depth[body] = depth[model.body_parentid[body]] + [int(model.body_dofnum[body] > 0), 1]
    last = max((frame.body for frame in frames), key=lambda body: (*depth[body], -body))
    return next(frame.name for frame in reversed(frames) if frame.body == last)
