"""Compile robot files with MuJoCo and read names and limits from the result."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from opspace.errors import ModelError
from opspace.robots.adapter import added_armature, held_joints
from opspace.robots.description import BASE_JOINT, WORLD, Description, ModelOrigin, mid_range
from opspace.robots.joint_roles import (
    ALL_WITH_A_MOTOR,
    JointChoice,
    JointRoles,
    assign_roles,
)
from opspace.robots.joint_units import effort_unit
from opspace.robots.link_inertia import inertia_of, is_impossible
from opspace.robots.mujoco_joints import equality_warnings, file_joints
from opspace.robots.mujoco_meshes import drop_missing
from opspace.robots.mujoco_motors import ON_JOINT, motor_warnings, read_motors
from opspace.robots.mujoco_names import (
    BALL,
    FREE,
    WIDTHS,
    NamedFrame,
    coordinate_names,
    frames,
    joint_names,
    key_names,
    shared_names,
)
from opspace.robots.mujoco_reduce import couple, hold_joints
from opspace.robots.mujoco_scene import add_scenery, add_skeleton
from opspace.robots.passive_forces import force_warnings, read_springs
from opspace.robots.protocol import Robot
from opspace.robots.tool_choice import hand_of, senses
from opspace.robots.urdf import Urdf, read_urdf
from opspace.robots.urdf_export import to_xml

# MuJoCo refuses a moving body without mass or inertia. This adds less than rounding does, kg and kg·m².
NEGLIGIBLE = 1e-14
SLIDE, HINGE = 2, 3


class MjcfRobot(NamedTuple):
    """An MJCF file whose joints that are not controlled have been taken out.

    Attributes:
        spec: To be compiled.
        origin: Where it comes from.
        roles: What became of the joints.
        held: Numbers of the bodies that lost one.
        warnings: What else the controller does not follow, a sentence each.
    """

    spec: mujoco.MjSpec
    origin: ModelOrigin
    roles: JointRoles
    held: frozenset[int]
    warnings: tuple[str, ...]


def mujoco_model(
    source: Path | str,
    floating_base: bool = False,
    locked_joints: Collection[str] | Mapping[str, float | None] = (),
    extend: Callable[[mujoco.MjSpec], None] | None = None,
    armature: float = 0.0,
) -> mujoco.MjModel:
    """Compile a robot file into a plant that can be simulated and rendered.

    The dynamics are those of the robot that ``load_robot`` gives for the same arguments, plus what
    an MJCF file says about friction and contact. A URDF is drawn as capsules between its joints; a
    floor, a sky and a light are added where there are none. Nothing that is added has mass or
    takes part in contact. Joints that follow others are there, and an equality constraint binds
    them.

    Args:
        source: URDF or MJCF file.
        floating_base: Whether the root link moves freely.
        locked_joints: Joints to hold fixed, and where, rad or m; names alone are held where the
            file has them.
        extend: Adds what else there is to the specification, such as shapes that touch.
        armature: Inertia of the motor at every joint of a URDF, kg·m² or kg.

    Returns:
        The compiled model.

    Raises:
        ModelError: MuJoCo cannot use the file.
    """
    path = Path(source)
    origin = ModelOrigin.of(path)
    if path.suffix == ".urdf":
        urdf = read_urdf(path, locked_joints, floating_base, armature=armature)
        spec = urdf_spec(urdf, floating_base)
        add_skeleton(spec)
        couple(spec, urdf.roles.couplings, {})
        build = compile_urdf
    else:
        read = mjcf_spec(path, floating_base, JointChoice.of(None, locked_joints))
        spec = read.spec
        if read.roles.couplings:
            couple(spec, read.roles.couplings, _zero(compile_spec(spec, origin)))
        build = compile_spec
    add_scenery(spec)
    if extend is not None:
        extend(spec)
    model = build(spec, origin)
    # Where actuators carry weight, MuJoCo counts it to them; the plant drives joints without any.
    model.jnt_actgravcomp[:] = 0
    return model


def model_of(robot: Robot, extend: Callable[[mujoco.MjSpec], None] | None = None) -> mujoco.MjModel:
    """Compile the file of a robot with the same joints held and coupled; see `mujoco_model`.

    Raises:
        ModelError: The robot has no file, or MuJoCo cannot use it.
    """
    if robot.source is None:
        raise ModelError(f"robot {robot.name!r} has no file that MuJoCo could load")
    return mujoco_model(
        robot.source, robot.floating_base, held_joints(robot), extend, added_armature(robot)
    )


def _zero(model: mujoco.MjModel) -> dict[str, float]:
    """Return where joints of one coordinate are in the model's zero, rad or m."""
    places = zip(joint_names(model), model.jnt_qposadr, strict=True)
    return {name: float(model.qpos0[place]) for name, place in places}


def mjcf_spec(path: Path, floating_base: bool, choice: JointChoice = ALL_WITH_A_MOTOR) -> MjcfRobot:
    """Read an MJCF file and hold the joints that are not controlled.

    Args:
        path: The file.
        floating_base: Whether to free the root body where the file does not.
        choice: Which joints are controlled, and where others are held.

    Returns:
        What is to be compiled, and what became of the joints.

    Raises:
        ModelError: The file does not exist, MuJoCo cannot parse it, or joints are asked to move in
            a way that they cannot.
        UnknownNameError: No joint has a name that is asked for.
    """
    if not path.is_file():
        raise ModelError(f"{path}: no such file")
    origin = ModelOrigin.of(path)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, RuntimeError) as error:
        raise _refused(origin, error) from None
    return reduce_spec(spec, origin, floating_base, choice)


def reduce_spec(
    spec: mujoco.MjSpec,
    origin: ModelOrigin,
    floating_base: bool,
    choice: JointChoice,
) -> MjcfRobot:
    """Hold the joints of a specification that are not controlled.

    Args:
        spec: The specification; it is changed.
        origin: Where it comes from.
        floating_base: Whether to free the root body where it is not.
        choice: Which joints are controlled, and where others are held.

    Returns:
        What is to be compiled, and what became of the joints.

    Raises:
        ModelError: MuJoCo refuses it, or joints are asked to move in a way that they cannot.
        UnknownNameError: No joint has a name that is asked for.
    """
    if floating_base:
        _free_mjcf(spec, origin)
    missing = drop_missing(spec, origin)
    # A link that is held keeps its frame.
    spec.compiler.fusestatic = False
    model = compile_spec(spec, origin)
    roles = assign_roles(file_joints(model), choice, origin.name)
    names = joint_names(model)
    held = {int(b) for b, n in zip(model.jnt_bodyid, names, strict=True) if n in roles.locked}
    hold_joints(spec, model, roles)
    return MjcfRobot(spec, origin, roles, frozenset(held), (*missing, *equality_warnings(model)))


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
        raise _refused(urdf.origin, error) from None
    spec.modelname = urdf.name
    if floating_base:
        _free(spec.body(urdf.root), urdf.origin)
    for joint in urdf.moving_joints:
        element = spec.joint(joint.name)
        limited = np.isfinite(joint.lower) and np.isfinite(joint.upper)
        element.armature = joint.armature
        element.limited = int(limited)
        element.range = [joint.lower, joint.upper] if limited else [0.0, 0.0]
        element.actfrclimited = int(np.isfinite(joint.effort))
        element.actfrcrange = [-joint.effort, joint.effort] if element.actfrclimited else [0, 0]
    for link, inertial in urdf.links.items():
        if link != WORLD:
            _set_inertia(spec.body(link), inertial)
    return spec


def compile_spec(spec: mujoco.MjSpec, origin: ModelOrigin) -> mujoco.MjModel:
    """Compile a specification.

    Args:
        spec: The specification.
        origin: Where it comes from.

    Returns:
        The compiled model.

    Raises:
        ModelError: MuJoCo refuses it.
    """
    try:
        model = spec.compile()
    except (ValueError, RuntimeError) as error:
        raise _refused(origin, error) from None
    if np.any(model.tendon_armature):
        raise ModelError(f"{origin}: tendon armature is not supported")
    armature = np.flatnonzero(getattr(model, "actuator_armature", ()))  # since MuJoCo 4
    if not np.isin(model.actuator_trntype[armature], ON_JOINT).all():
        raise ModelError(
            f"{origin}: armature of actuators that are not on a joint is not supported"
        )
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        model.opt.gravity[:] = 0.0
    return model


def compile_urdf(spec: mujoco.MjSpec, origin: ModelOrigin) -> mujoco.MjModel:
    """Compile what `urdf_spec` made, with every inertia as the file has it.

    MuJoCo compiles no inertia that a rigid body cannot have, such as many files are shipped with, but
    computes with one: the equations of motion ask only that the inertia in the joints is positive.

    Raises:
        ModelError: MuJoCo refuses it.
    """
    given = {
        body.name: np.array(body.inertia)
        for body in spec.bodies
        if body.explicitinertial and is_impossible(np.array(body.inertia))
    }
    if not given:
        return compile_spec(spec, origin)
    spec.compiler.balanceinertia = True
    model = compile_spec(spec, origin)
    for name, moments in given.items():
        model.body_inertia[model.body(name).id] = moments
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def describe_mujoco(model: mujoco.MjModel, read: MjcfRobot) -> Description:
    """Collect names, limits and postures from a compiled MJCF model.

    Args:
        model: The compiled model.
        read: What it was compiled from.

    Returns:
        The description.
    """
    names, found = coordinate_names(model), frames(model)
    free = model.jnt_type[model.dof_jntid] == FREE
    lower, upper = _ranges(model)
    poses = map(np.array, model.key_qpos)
    keys = dict(zip(key_names(model), poses, strict=True))
    motors = read_motors(model, names).without(c.follower for c in read.roles.couplings)
    units = _units(model)
    efforts = [effort_unit(unit) for unit in units]
    return Description(
        name=read.origin.robot,
        source=read.origin.file,
        nq=model.nq,
        nv=model.nv,
        joint_names=names,
        joint_units=units,
        frame_names=tuple(frame.name for frame in found),
        tool=_tool(model, found, read),
        q_reference=keys.get("home", next(iter(keys.values()), _middle(model, lower, upper))),
        q_lower=lower,
        q_upper=upper,
        velocity_limit=np.full(model.nv, np.inf),
        torque_limit=motors.limit,
        torque_range=motors.range,
        actuated=~free,
        quaternions=_quaternions(model),
        floating_base=bool(free.any()),
        configurations=keys,
        couplings=read.roles.couplings,
        locked=read.roles.locked,
        springs=read_springs(model),
        warnings=(
            *read.roles.warnings,
            *read.warnings,
            *_shared(model),
            *motor_warnings(motors, names, efforts, floating=bool(free.any())),
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


def _refused(origin: ModelOrigin, error: Exception) -> ModelError:
    return ModelError(f"{origin}: MuJoCo cannot use it: {' '.join(str(error).split())}")


def _free(root: mujoco.MjsBody, origin: ModelOrigin) -> None:
    if root.joints:
        name = root.joints[0].name
        raise ModelError(f"{origin}: root body {root.name!r} has joint {name!r} and cannot float")
    root.add_freejoint(name=BASE_JOINT)


def _free_mjcf(spec: mujoco.MjSpec, origin: ModelOrigin) -> None:
    roots = [body for body in spec.worldbody.bodies if body.joints or body.bodies]
    if len(roots) != 1:
        raise ModelError(f"{origin}: a floating base needs one root body, not {len(roots)}")
    if roots[0].joints and roots[0].joints[0].type == mujoco.mjtJoint.mjJNT_FREE:
        return
    _free(roots[0], origin)
    spec.compiler.boundmass = max(spec.compiler.boundmass, NEGLIGIBLE)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, NEGLIGIBLE)
    pose = np.concatenate([roots[0].pos, roots[0].quat])
    for key in spec.keys:
        key.qpos = np.concatenate([pose, key.qpos]) if len(key.qpos) else key.qpos
        key.qvel = np.concatenate([np.zeros(6), key.qvel]) if len(key.qvel) else key.qvel


def _set_inertia(body: mujoco.MjsBody, inertial: ET.Element | None) -> None:
    mass, center, tensor = inertia_of(inertial)
    moments, axes = np.linalg.eigh(tensor)
    if body.joints:
        mass, moments = max(mass, NEGLIGIBLE), np.maximum(moments, NEGLIGIBLE)
    if np.linalg.det(axes) < 0:
        axes[:, 2] *= -1.0
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, axes.flatten())
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat, body.inertia = mass, center, quat, moments


def _tool(model: mujoco.MjModel, frames: Sequence[NamedFrame], read: MjcfRobot) -> str:
    """Return "tool" where it exists, else the last site or body of the longest chain.

    Bodies behind a joint that is held, and those of a hand, are left out: a tool that other motors
    move is no frame of the arm's own. So are sensors.
    """
    if any(frame.name == "tool" for frame in frames):
        return "tool"
    hand = _hand(model, read.roles)
    depth, beyond = np.zeros((model.nbody, 2), dtype=int), np.zeros(model.nbody, dtype=bool)
    for body in range(1, model.nbody):
        before, moves = model.body_parentid[body], bool(model.body_dofnum[body] > 0)
        depth[body] = depth[before] + [int(moves), 1]
        beyond[body] = body in hand if moves else (body in read.held or beyond[before])
    own = [frame for frame in frames if not beyond[frame.body] and not senses(frame.name)]
    last = max((frame.body for frame in own), key=lambda body: (*depth[body], -body))
    return next(frame.name for frame in reversed(own) if frame.body == last)


def _hand(model: mujoco.MjModel, roles: JointRoles) -> set[int]:
    """Return the bodies that joints of a hand move."""
    names, last = joint_names(model), {}
    soft = {name for c in roles.couplings for name in (c.follower, c.leader)}
    chain = []
    for body in range(1, model.nbody):
        before = int(model.body_parentid[body])
        joint = last.get(before)
        first = int(model.body_jntadr[body])
        for j in range(first, first + int(model.body_jntnum[body])):
            chain.append((names[j], joint, str(model.body_weldid[before])))
            joint = names[j]
        last[body] = joint
    fingers = hand_of(chain, soft)
    return {int(b) for b, n in zip(model.jnt_bodyid, names, strict=True) if n in fingers}
