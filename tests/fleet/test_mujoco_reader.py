"""What a fleet reads of MuJoCo Warp is what it would compute itself."""

import numpy as np
import pytest

import opspace as osc
from opspace.fleet import MujocoWarpReader

wp = pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")
mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
mjw = pytest.importorskip("mujoco_warp", reason="mujoco-warp is not installed")

COUNT = 16


def make(dynamics, dtype, *, source=None):
    robot = osc.load_robot("puma560")
    target = np.eye(4)
    target[:3, 3] = [0.4, 0.1, 0.3]
    levels = [
        osc.JointLimits(),
        osc.PoseTask(target=target, offset=[0.0, 0.02, 0.05], name="pose"),
        source or osc.PositionTask("link4", target=[0.2, 0.1, 0.6], axes="z", name="elbow"),
        osc.PostureTask(target=robot.q_reference),
    ]
    options = {"dynamics": dynamics, "dtype": dtype, "torque_limits": "priority"}
    return osc.Fleet(robot, osc.Stack(levels), COUNT, device="cpu", **options)


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_path(str(osc.load_robot("puma560").source))


def test_torques_are_those_of_own_dynamics(model):
    own, given = make("own", "float64"), make("given", "float32")
    reader = MujocoWarpReader(given, model)
    m, data = mjw.put_model(model), mjw.put_data(model, mujoco.MjData(model), nworld=COUNT)
    rng = np.random.default_rng(1)
    tau = wp.zeros((COUNT, 6), dtype=wp.float32, device="cpu")
    for _ in range(3):
        Q = own.robot.q_reference + rng.uniform(-0.5, 0.5, (COUNT, 6))
        V = rng.uniform(-1, 1, Q.shape)
        data.qpos.assign(Q.astype(np.float32))
        data.qvel.assign(V.astype(np.float32))
        for part in (mjw.kinematics, mjw.com_pos, mjw.crb, mjw.com_vel, mjw.rne):
            part(m, data)
        reader.read(data)
        given.step(0.0, data.qpos, data.qvel, tau)
        want = own.step(0.0, Q, V).numpy()
        kept = own.status.numpy() & int(osc.Status.LIMIT_LOST) == 0
        assert kept.any()
        error = np.abs(tau.numpy() - want).max(axis=1) / np.abs(want).max(axis=1)
        assert error[kept].max() < 1e-4
        elbow, frame = given["elbow"], own.robot.frame_id("link4")
        for i in range(COUNT):
            own.robot.update(Q[i], V[i])
            for name in ("jacobian", "drift"):
                found, wanted = getattr(elbow, name).numpy()[i], getattr(own.robot, name)(frame)
                np.testing.assert_allclose(found, wanted, atol=2e-5)
        own.reset(), given.reset()


def test_what_cannot_be_read_is_refused_by_name(model):
    with pytest.raises(osc.InputError, match="dynamics='given'"):
        MujocoWarpReader(make("own", "float32"), model)
    relative = osc.RelativePositionTask("tool", "link3", target=[0.1, 0.0, 0.3], name="beside")
    with pytest.raises(osc.InputError, match="'beside' is not on a frame"):
        MujocoWarpReader(make("given", "float32", source=relative), model)
    other = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='one'/><geom size='1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(osc.InputError, match="has the joints one;"):
        MujocoWarpReader(make("given", "float32"), other)
