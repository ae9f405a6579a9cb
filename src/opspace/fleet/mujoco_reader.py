"""What a fleet is given of the dynamics, read from the data of MuJoCo Warp on the same device."""

# Warp reads the arguments of kernels when they are made, so there is no `annotations` from the future,
# and what a type is depends on what is computed.
# pyright: reportInvalidTypeForm=false

from functools import cache
from typing import Any

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.fleet.fleet import Fleet
from opspace.fleet.told_arrays import ToldArrays
from opspace.fleet.warp_library import warp
from opspace.tasks import ForceTask
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import WorldFrame


class MujocoWarpReader:
    r"""Writes what a fleet with ``dynamics="given"`` is told, from the data of MuJoCo Warp.

    Inertia and bias are those of the simulator. Of every task on a frame, pose, Jacobian and drift
    J̇ q̇ follow from its bodies and motion axes, as ``mj_jac`` and ``mj_jacDot`` say. Springs,
    damping and friction at joints are not in the bias, as they are not in `Robot.bias`.

    Args:
        fleet: The fleet. Its robot's joints are the model's, in this order, and frames of its tasks are
            sites or bodies of the model.
        model: The model of MuJoCo, a ``mujoco.MjModel``.

    Raises:
        InputError: The fleet computes its own dynamics, the model has other joints, or a task is on
            something else than a frame of the world.
        UnknownNameError: The model has no such frame.
    """

    def __init__(self, fleet: Fleet, model: Any) -> None:
        if not fleet.given:
            raise InputError(
                "a fleet that computes its own dynamics reads none; make it with dynamics='given'"
            )
        names = tuple(model.joint(j).name for j in model.dof_jntid)
        if names != fleet.robot.joint_names or model.nq != model.nv:
            raise InputError(
                f"the model has the joints {', '.join(names)}; those of the fleet are "
                f"{', '.join(fleet.robot.joint_names)}"
            )
        wp, self._fleet = warp(), fleet
        rows, columns = _entries(model)
        self._rows, self._columns = (
            wp.array(x, dtype=wp.int32, device=fleet.device) for x in (rows, columns)
        )
        self._parents = wp.array(model.dof_parentid, dtype=wp.int32, device=fleet.device)
        tool = fleet.robot.tool
        self._frames = [_Frame(arrays, model, tool) for arrays in fleet if arrays.told_motion]

    def read(self, data: Any) -> None:
        """Write what the fleet is told of the state that the data hold.

        Kinematics, velocities, inertia and bias of the data must be those of that state, as they are
        after ``mujoco_warp.forward`` or the parts of it up to ``rne``.

        Args:
            data: The ``mujoco_warp.Data``, of as many worlds as the fleet has robots.
        """
        wp, fleet = warp(), self._fleet
        inertia, motion = reading_kernels(fleet.dtype)
        wp.launch(
            inertia,
            dim=fleet.count,
            inputs=[data.M, data.qfrc_bias, self._rows, self._columns],
            outputs=[fleet.M, fleet.bias],
            device=fleet.device,
        )
        for frame in self._frames:
            at = (data.site_xpos, data.site_xmat) if frame.site else (data.xpos, data.xmat)
            wp.launch(
                motion,
                dim=fleet.count,
                inputs=[
                    *at, frame.index, frame.offset, frame.root, frame.body, frame.last, self._parents,
                    data.subtree_com, data.cvel, data.cdof, data.cdof_dot, data.qvel,
                ],
                outputs=[frame.arrays.pose, frame.arrays.jacobian, frame.arrays.drift],
                device=fleet.device,
            )  # fmt: skip


class _Frame:
    """Where a task's frame is in a model.

    Args:
        arrays: The task.
        model: The model of MuJoCo.
        tool: Name of the robot's tool.

    Attributes:
        arrays: The task.
        site: Whether it is a site, or else a body.
        index: Its number.
        body: Number of the body that it is on.
        root: Number of the body at whose tree's centre motion axes are seen.
        last: Last coordinate that moves it, −1 for none.
        offset: Of the point from the frame, in its axes, m.
    """

    def __init__(self, arrays: ToldArrays, model: Any, tool: str) -> None:
        task = arrays.task
        if not isinstance(task, MotionTask | ForceTask) or not isinstance(task.source, WorldFrame):
            raise InputError(
                f"task {arrays.name!r} is not on a frame of the world; write its pose, jacobian and "
                "drift, and read the others"
            )
        self.arrays, name = arrays, task.source.frame or tool
        sites = [model.site(k).name for k in range(model.nsite)]
        bodies = [model.body(k).name for k in range(model.nbody)]
        if name not in sites and name not in bodies:
            raise unknown_name("site or body of the model", name, [*sites, *bodies])
        self.site = name in sites
        self.index = sites.index(name) if self.site else bodies.index(name)
        self.body = int(model.site_bodyid[self.index]) if self.site else self.index
        self.root = int(model.body_rootid[self.body])
        moving = self.body
        while moving > 0 and model.body_dofnum[moving] == 0:
            moving = int(model.body_parentid[moving])
        self.last = int(model.body_dofadr[moving] + model.body_dofnum[moving] - 1) if moving else -1
        offset = np.zeros(3) if task.source.offset is None else task.source.offset
        self.offset = warp().vec3(*offset.tolist())


def _entries(model: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return row and column of each number of the packed inertia, whose rows end at the diagonal."""
    counts = np.asarray(model.M_rownnz)
    return np.repeat(np.arange(model.nv), counts), np.asarray(model.M_colind)


@cache
def reading_kernels(dtype: str) -> tuple[Any, Any]:
    """Make the kernels that read inertia with bias, and the motion of a frame.

    Args:
        dtype: Type of the fleet's numbers; those of MuJoCo Warp are float32.
    """
    wp = warp()
    real = getattr(wp, dtype)
    vectors, spatials = wp.array2d(dtype=wp.vec3), wp.array2d(dtype=wp.spatial_vector)
    matrices, places = wp.array2d(dtype=wp.mat33), wp.array(dtype=wp.int32)
    floats, told = wp.array2d(dtype=wp.float32), wp.array2d(dtype=real)
    cubes = wp.array3d(dtype=real)

    @wp.kernel(module="unique", enable_backward=False)
    def read_inertia(
        packed: floats, force: floats, rows: places, columns: places, M: cubes, bias: told
    ):
        i = wp.tid()
        for k in range(bias.shape[1]):
            bias[i, k] = real(force[i, k])
            for j in range(bias.shape[1]):
                M[i, k, j] = real(0.0)
        for k in range(rows.shape[0]):
            M[i, rows[k], columns[k]] = real(packed[i, k])
            M[i, columns[k], rows[k]] = real(packed[i, k])

    @wp.kernel(module="unique", enable_backward=False)
    def read_motion(
        position: vectors,
        rotation: matrices,
        index: int,
        offset: wp.vec3,
        root: int,
        body: int,
        last: int,
        parents: places,
        centre: vectors,
        cvel: spatials,
        cdof: spatials,
        cdof_dot: spatials,
        qvel: floats,
        pose: told,
        jacobian: cubes,
        drift: told,
    ):
        i = wp.tid()
        R = rotation[i, index]
        point = position[i, index] + R * offset
        turn = wp.quat_from_matrix(R)
        for c in range(3):
            pose[i, c] = real(point[c])
            pose[i, 4 + c] = real(turn[c])
        pose[i, 3] = real(turn[3])
        for row in range(6):
            drift[i, row] = real(0.0)
            for k in range(parents.shape[0]):
                jacobian[i, row, k] = real(0.0)
        arm = point - centre[i, root]
        moved = cvel[i, body]
        speed = wp.spatial_bottom(moved) + wp.cross(wp.spatial_top(moved), arm)
        k = last
        while k >= 0:
            axis, rate = wp.spatial_top(cdof[i, k]), wp.spatial_top(cdof_dot[i, k])
            linear = wp.spatial_bottom(cdof[i, k]) + wp.cross(axis, arm)
            change = wp.spatial_bottom(cdof_dot[i, k]) + wp.cross(rate, arm) + wp.cross(axis, speed)
            for c in range(3):
                jacobian[i, c, k] = real(linear[c])
                jacobian[i, 3 + c, k] = real(axis[c])
                drift[i, c] += real(change[c] * qvel[i, k])
                drift[i, 3 + c] += real(rate[c] * qvel[i, k])
            k = parents[k]

    return read_inertia, read_motion
