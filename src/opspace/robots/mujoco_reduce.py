"""Take joints out of a MuJoCo specification and hold what they carried where they were."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from opspace.robots.joint_roles import Coupling, JointRoles
from opspace.robots.mujoco_joints import home_configuration
from opspace.robots.mujoco_names import FREE, joint_names, key_names


class Placement(NamedTuple):
    """A rotation (quaternion wxyz) and a translation, m."""

    quat: np.ndarray
    pos: np.ndarray

    def then(self, other: Placement) -> Placement:
        """Return self · other."""
        quat = np.empty(4)
        mujoco.mju_mulQuat(quat, self.quat, other.quat)
        return Placement(quat, self.pos + self.turned(other.pos))

    def turned(self, vector: np.ndarray) -> np.ndarray:
        """Return a vector turned by it."""
        out = np.empty(3)
        mujoco.mju_rotVecQuat(out, np.asarray(vector, dtype=float), self.quat)
        return out

    @property
    def inverse(self) -> Placement:
        """Return its inverse."""
        quat = self.quat * [1.0, -1.0, -1.0, -1.0]
        return Placement(quat, -Placement(quat, self.pos).turned(self.pos))


NOWHERE = Placement(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))


def hold_joints(spec: mujoco.MjSpec, model: mujoco.MjModel, roles: JointRoles) -> None:
    """Take the locked joints out of a specification, and all that names them with them.

    Equality constraints go altogether: relations between joints come back with `couple`, and others
    are named when the file is read.

    Args:
        spec: The specification; it is changed.
        model: What it compiles to.
        roles: What becomes of them.
    """
    names = joint_names(model)
    joints = {int(joint.id): joint for joint in spec.joints}
    for j, joint in joints.items():
        joint.name = names[j]
    for equality in list(spec.equalities):
        spec.delete(equality)
    if not roles.locked:
        return
    # MuJoCo compares key frames with the joints at every step; they are written again at the end.
    for key in list(spec.keys):
        spec.delete(key)
    _drop_references(spec, model, set(roles.locked))
    bodies = {int(body.id): body for body in spec.bodies}
    for body in sorted({int(model.jnt_bodyid[j]) for j in range(model.njnt)}):
        _hold_body(spec, model, bodies[body], joints, roles.locked)
    _write_keys(spec, model, [j for j in range(model.njnt) if names[j] not in roles.locked])


def couple(spec: mujoco.MjSpec, couplings: Sequence[Coupling], zero: Mapping[str, float]) -> None:
    """Let joints follow others in the simulation, as stiffly as MuJoCo can.

    Args:
        spec: The specification; it is changed.
        couplings: Who follows whom.
        zero: Position of each joint in the model's own zero configuration, rad or m.
    """
    for c in couplings:
        shift = c.offset + c.ratio * zero.get(c.leader, 0.0) - zero.get(c.follower, 0.0)
        equality = spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=c.follower,
            name2=c.leader,
            solref=[0.002, 1.0],
            solimp=[0.9999, 0.9999, 0.001, 0.5, 2.0],
        )
        data = np.zeros(len(equality.data))
        data[:2] = shift, c.ratio
        equality.data = data


def _write_keys(spec: mujoco.MjSpec, model: mujoco.MjModel, kept: Sequence[int]) -> None:
    """Write the key frames again, for the joints that stay."""
    ends = [*map(int, model.jnt_qposadr), model.nq]
    places = [i for j in kept for i in range(ends[j], ends[j + 1])]
    for name, q in zip(key_names(model), model.key_qpos, strict=True):
        spec.add_key(name=name, qpos=np.array(q)[places])


def _drop_references(spec: mujoco.MjSpec, model: mujoco.MjModel, locked: set[str]) -> None:
    """Delete what names a joint that goes; the order is that of who names whom."""
    names, gone = joint_names(model), set()
    for t in range(model.ntendon):
        first = int(model.tendon_adr[t])
        for w in range(first, first + int(model.tendon_num[t])):
            on_joint = model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT
            if on_joint and names[model.wrap_objid[w]] in locked:
                gone.add(t)
    lost = [tendon for tendon in spec.tendons if int(tendon.id) in gone]
    # A sensor measures what a simulation has, and nothing here reads one.
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    on_joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    for actuator in list(spec.actuators):
        on_tendon = actuator.trntype == mujoco.mjtTrn.mjTRN_TENDON
        targets = {tendon.name for tendon in lost} if on_tendon else locked
        if (on_tendon or actuator.trntype in on_joints) and actuator.target in targets:
            spec.delete(actuator)
    for tendon in lost:
        spec.delete(tendon)


def _hold_body(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    body: mujoco.MjsBody,
    joints: Mapping[int, mujoco.MjsJoint],
    locked: Mapping[str, float | None],
) -> None:
    """Take the locked joints out of one body.

    The body stands at B J₁ J₂ … on its parent. A joint that is held becomes a pose of its own,
    which is brought to the front: J A = A (A⁻¹ J A), so that joints before it are moved instead.
    """
    first = int(model.body_jntadr[body.id])
    own = range(first, first + int(model.body_jntnum[body.id]))
    if any(joints[j].name in locked and int(model.jnt_type[j]) == FREE for j in own):
        motion = _free_pose(model, first)
        spec.delete(joints[first])
        _place(body, _pose(spec, body).then(motion))
        return
    held, before = NOWHERE, []
    for j in own:
        joint = joints[j]
        if joint.name not in locked:
            before.append(joint)
            continue
        motion = _motion(model, j, locked[joint.name])
        for other in before:
            other.axis = motion.inverse.turned(other.axis)
            other.pos = motion.inverse.pos + motion.inverse.turned(other.pos)
        held = held.then(motion)
        spec.delete(joint)
    if held is not NOWHERE:
        _place(body, _pose(spec, body).then(held))


def _pose(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> Placement:
    """Return where a body stands on its parent or in its frame."""
    quat = np.array(body.quat, dtype=float)
    if body.alt.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        compiler = spec.compiler
        quat = np.array(
            spec.resolve_orientation(
                degree=compiler.degree, sequence=compiler.eulerseq, orientation=body.alt
            )
        )
    return Placement(quat / np.linalg.norm(quat), np.array(body.pos, dtype=float))


def _place(body: mujoco.MjsBody, pose: Placement) -> None:
    body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    body.pos, body.quat = pose.pos, pose.quat


def _motion(model: mujoco.MjModel, j: int, value: float | None) -> Placement:
    """Return what a joint does to its body at a position, measured from the model's zero."""
    place, kind = int(model.jnt_qposadr[j]), int(model.jnt_type[j])
    anchor, axis = np.array(model.jnt_pos[j]), np.array(model.jnt_axis[j])
    quat = np.array([1.0, 0.0, 0.0, 0.0])
    if value is None:
        quat = home_configuration(model)[place : place + 4]
    elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
        return Placement(quat, axis * (value - float(model.qpos0[place])))
    else:
        mujoco.mju_axisAngle2Quat(quat, axis, value - float(model.qpos0[place]))
    turn = Placement(quat, np.zeros(3))
    return Placement(quat, anchor - turn.turned(anchor))


def _free_pose(model: mujoco.MjModel, j: int) -> Placement:
    """Return where the file has a free body, seen from where its zero has it."""
    place, body = int(model.jnt_qposadr[j]), int(model.jnt_bodyid[j])
    q = home_configuration(model)[place : place + 7]
    there = Placement(q[3:] / np.linalg.norm(q[3:]), q[:3].copy())
    zero = Placement(np.array(model.body_quat[body]), np.array(model.body_pos[body]))
    return zero.inverse.then(there)
