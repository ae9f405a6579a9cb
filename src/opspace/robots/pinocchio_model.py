"""Build Pinocchio models from a URDF tree or from a compiled MuJoCo model."""

# The compiled module pinocchio has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from opspace.errors import ModelError
from opspace.robots.description import BASE_JOINT, WORLD, Description
from opspace.robots.mujoco_names import frames, joint_names
from opspace.robots.urdf import Urdf
from opspace.robots.urdf_export import to_xml

if TYPE_CHECKING:
    from mujoco import MjModel

FREE, BALL, SLIDE, HINGE = range(4)
AXES: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def model_from_urdf(urdf: Urdf, floating_base: bool) -> Any:
    """Build the model of a URDF tree.

    A floating base is a translation followed by a spherical joint: its velocity is then linear in
    world axes and angular in base axes, which is the convention of this library.

    Args:
        urdf: The robot's tree.
        floating_base: Whether the root link moves freely.

    Returns:
        The ``pinocchio.Model``.

    Raises:
        ModelError: Pinocchio cannot use the file.
    """
    try:
        # A joint may have a link's name in URDF, but not where Pinocchio joins two models.
        fixed = pin.buildModelFromXML(to_xml(urdf, inertias=True, prefix="joint "))
    except (ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise ModelError(f"{urdf.origin}: Pinocchio cannot use it: {reason}") from None
    if not floating_base:
        return _with_armature(fixed, urdf)
    base = pin.Model()
    joint = _add_free_joint(base, BASE_JOINT)
    frame = base.addFrame(
        pin.Frame(BASE_JOINT, joint, 0, pin.SE3.Identity(), pin.FrameType.JOINT), False
    )
    model = pin.appendModel(base, fixed, frame, pin.SE3.Identity())
    # Pinocchio 3.8 turns what is fixed to a link the wrong way where it joins two models.
    for j in range(1, fixed.njoints):
        model.inertias[model.getJointId(fixed.names[j])] = fixed.inertias[j]
    model.inertias[joint] = inertia_on_world(fixed)
    return _with_armature(model, urdf)


def _with_armature(model: Any, urdf: Urdf) -> Any:
    """Give every joint the inertia of its motor; joining two models would lose it."""
    for own in urdf.moving_joints:
        model.armature[model.joints[model.getJointId(f"joint {own.name}")].idx_v] = own.armature
    return model


def inertia_on_world(model: Any) -> Any:
    """Return what is fixed to the world of a model, which has no joint that it could count for."""
    total = pin.Inertia.Zero()
    for frame in model.frames:
        if frame.parentJoint == 0:
            total += frame.placement.act(frame.inertia)
    return total


def carried_from_mujoco(mj: MjModel) -> Any | None:
    """Build the model of the masses whose weight MuJoCo carries itself (gravcomp), None for none.

    Its gravity torque is what is to be taken off that of `model_from_mujoco`.
    """
    if not np.any(mj.body_gravcomp):
        return None
    return model_from_mujoco(mj, mj.body_gravcomp * mj.body_mass)


def model_from_mujoco(mj: MjModel, masses: np.ndarray | None = None) -> Any:
    """Build the model that MuJoCo's compiler made of an MJCF file.

    The compiler resolves defaults, includes, frames and inertias; reading its result leaves no room
    for two parsers to disagree.

    Args:
        mj: The compiled model.
        masses: (bodies,) points of mass in place of the bodies, kg; None takes the bodies.

    Returns:
        The ``pinocchio.Model``; joints have as many coordinates and the same order as in MuJoCo.
    """
    model = pin.Model()
    model.name = "mjcf"
    model.gravity.linear = np.array(mj.opt.gravity)
    joints = joint_names(mj)
    attached = [(0, pin.SE3.Identity())]
    for body in range(1, mj.nbody):
        joint, place = attached[mj.body_parentid[body]]
        place = place * _placement(mj.body_quat[body], mj.body_pos[body])
        first = int(mj.body_jntadr[body])
        for j in range(first, first + int(mj.body_jntnum[body])):
            joint, place = _add_joint(model, mj, j, joints[j], joint, place)
        attached.append((joint, place))
        if joint > 0:
            point = None if masses is None else float(masses[body])
            model.appendBodyToJoint(joint, _inertia(mj, body, point), place)
    for name, body, site in frames(mj):
        joint, place = attached[body]
        if site >= 0:
            place = place * _placement(mj.site_quat[site], mj.site_pos[site])
        if body > 0 or site >= 0:  # Pinocchio has a world of its own
            model.addFrame(pin.Frame(name, joint, 0, place, pin.FrameType.OP_FRAME), False)
    model.armature = _armature(mj)
    return model


def frame_ids(model: Any, description: Description) -> list[int]:
    """Return Pinocchio's frame index of every frame of the description.

    Args:
        model: The ``pinocchio.Model``.
        description: What the robot file says besides dynamics.

    Returns:
        One index per entry of ``frame_names``.
    """
    kinds = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    known = {f.name: i for i, f in reversed(list(enumerate(model.frames))) if f.type in kinds}
    known.setdefault(WORLD, 0)
    return [known[name] for name in description.frame_names]


def _add_joint(
    model: Any, mj: MjModel, j: int, name: str, parent: int, place: Any
) -> tuple[int, Any]:
    """Add MuJoCo's joint j; return the joint's id and the body's placement on it."""
    kind = int(mj.jnt_type[j])
    anchor = pin.SE3(np.eye(3), np.array(mj.jnt_pos[j]))
    axis = np.array(mj.jnt_axis[j])
    reference = float(mj.qpos0[mj.jnt_qposadr[j]])
    if kind == FREE:
        return _add_free_joint(model, name), pin.SE3.Identity()
    if kind == BALL:
        return model.addJoint(
            parent, pin.JointModelSpherical(), place * anchor, name
        ), anchor.inverse()
    if kind == SLIDE:
        start = pin.SE3(np.eye(3), -reference * axis)
        return model.addJoint(parent, _prismatic(axis), place * start, name), pin.SE3.Identity()
    turned = pin.SE3(pin.exp3(-reference * axis), np.zeros(3))
    return model.addJoint(parent, _revolute(axis), place * anchor * turned, name), anchor.inverse()


def _add_free_joint(model: Any, name: str) -> int:
    identity = pin.SE3.Identity()
    first = model.addJoint(0, pin.JointModelTranslation(), identity, f"{name}/translation")
    return model.addJoint(first, pin.JointModelSpherical(), identity, f"{name}/rotation")


def _armature(mj: MjModel) -> np.ndarray:
    """Return the inertia of motors at the joints, those of the joints and of actuators on them."""
    armature = np.array(mj.dof_armature)
    own = getattr(mj, "actuator_armature", np.zeros(0))  # since MuJoCo 4
    for i in np.flatnonzero(own):
        dof = int(mj.jnt_dofadr[mj.actuator_trnid[i, 0]])
        armature[dof] += float(own[i]) * float(mj.actuator_gear[i, 0]) ** 2
    return armature


def _revolute(axis: np.ndarray) -> Any:
    aligned = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
    for direction, joint in zip(AXES, aligned, strict=True):
        if tuple(axis) == direction:
            return joint()
    return pin.JointModelRevoluteUnaligned(axis)


def _prismatic(axis: np.ndarray) -> Any:
    aligned = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)
    for direction, joint in zip(AXES, aligned, strict=True):
        if tuple(axis) == direction:
            return joint()
    return pin.JointModelPrismaticUnaligned(axis)


def _placement(quat: np.ndarray, position: np.ndarray) -> Any:
    w, x, y, z = quat
    rotation = pin.Quaternion(w, x, y, z).normalized().toRotationMatrix()
    return pin.SE3(rotation, np.array(position))


def _inertia(mj: MjModel, body: int, point: float | None) -> Any:
    if point is not None:
        return pin.Inertia(point, np.array(mj.body_ipos[body]), np.zeros((3, 3)))
    rotation = _placement(mj.body_iquat[body], np.zeros(3)).rotation
    tensor = rotation @ np.diag(mj.body_inertia[body]) @ rotation.T
    return pin.Inertia(float(mj.body_mass[body]), np.array(mj.body_ipos[body]), tensor)
