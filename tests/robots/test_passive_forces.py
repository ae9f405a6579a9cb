"""Springs and weight that MuJoCo carries itself: the robot needs what MuJoCo's inverse needs."""

import mujoco
import numpy as np
import pytest

import opspace as osc
from opspace import ModelWarning, load_robot
from opspace.robots.bodies import make_dynamics
from opspace.runs.check import check_robot
from tests.robots.samples import BACKENDS

ARM = """<mujoco><compiler angle="radian"/><option {option}>{flags}</option>
<default><joint {joint}/></default>
<worldbody><body pos="0 0 .5" {b1}><joint name="lift" type="slide" axis="0 0 1" {j1}/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".04" mass="3"/>
<body pos=".4 0 0" {b2}><joint name="turn" axis="0 1 0" {j2}/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass="2"/>
<body pos=".4 0 0" {b3}><geom size=".05" pos=".1 0 .2" mass="1"/>
<body pos=".1 0 0"><joint name="roll" axis="1 .2 .3"/><geom size=".05" pos=".1 .1 0" mass="1"/>
</body></body></body></body></worldbody>
<actuator><motor joint="lift" ctrlrange="-200 200"/><motor joint="turn" ctrlrange="-90 90"/>
<motor joint="roll" ctrlrange="-20 20"/></actuator></mujoco>"""

CASES = {
    "every body": {"b1": 'gravcomp="1"', "b2": 'gravcomp="1"', "b3": 'gravcomp="1"'},
    "one body": {"b2": 'gravcomp="1"'},
    "parts of bodies": {"b1": 'gravcomp="0.3"', "b3": 'gravcomp="0.8"'},
    "more than all": {"b2": 'gravcomp="1.5"'},
    "sideways": {"b2": 'gravcomp="1"', "option": 'gravity="3 -2 -5"'},
    "spring": {"j2": 'stiffness="20" springref="0.4"'},
    "springs": {
        "joint": 'stiffness="7"',
        "j1": 'stiffness="100" springref="-.2"',
        "j2": 'ref=".3"',
    },
    "both": {"b3": 'gravcomp="1"', "j2": 'stiffness="5"'},
    "by the motors": {"b2": 'gravcomp="1"', "j2": 'actuatorgravcomp="true"'},
    "no gravity": {"flags": '<flag gravity="disable"/>', "b2": 'gravcomp="1"'},
    "no springs": {"flags": '<flag spring="disable"/>', "j2": 'stiffness="5"'},
}


@pytest.fixture(params=list(CASES))
def arm(request, tmp_path):
    blanks = dict.fromkeys(("option", "flags", "joint", "b1", "b2", "b3", "j1", "j2"), "")
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format(**{**blanks, **CASES[request.param]}))
    return path


pytestmark = pytest.mark.filterwarnings("ignore:arm. the motors of turn carry weight")


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_compiled_tick_leaves_to_a_robot_what_gravity_is_there(arm, backend):
    robot = load_robot(arm, backend=backend)
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask()]), gravity="robot")
    rng = np.random.default_rng(4)
    for k in range(3):
        q, v = rng.uniform(-1, 1, (2, 3))
        controller.step(1e-3 * k, q, v)
        robot.update(q, v)
        assert controller._laid_out is not None, "the tick should be compiled"
        np.testing.assert_allclose(controller._added_by_robot(), robot.gravity, atol=1e-10)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_bias_is_what_mujoco_needs(arm, backend):
    robot = load_robot(arm, backend=backend)
    model = mujoco.MjModel.from_xml_path(str(arm))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.jnt_actgravcomp[:] = 0  # a motor's share is none that is asked of the controller
    data = mujoco.MjData(model)
    dynamics = make_dynamics(robot.rigid_model().bodies, robot.nq)
    rng = np.random.default_rng(3)
    for _ in range(5):
        q, v = rng.uniform(-1, 1, (2, 3))
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, 0.0
        mujoco.mj_inverse(model, data)
        robot.update(q, v)
        np.testing.assert_allclose(robot.bias, data.qfrc_inverse, rtol=0, atol=1e-10)
        from opspace.kernels.dynamics import evaluate

        evaluate.py_func(robot.rigid_model().bodies, q, v, dynamics)
        np.testing.assert_allclose(dynamics.bias, data.qfrc_inverse, rtol=0, atol=1e-10)
        robot.update(q, 0 * v)
        springs = robot.description.springs
        sprung = np.zeros(3)
        if springs is not None:
            springs.add_to(sprung, q)
        np.testing.assert_allclose(robot.gravity + sprung, robot.bias, rtol=0, atol=1e-10)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_held_posture_stays(arm, backend):
    robot = load_robot(arm, backend=backend)
    q = np.array([0.1, -0.5, 0.4])
    plant = osc.Plant(robot, q)
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask()]), torque_limits="priority")
    assert osc.simulate(plant, controller, 0.5).completed
    assert np.abs(plant.q - q).max() < 1e-6
    batch = controller.torque_batch(plant.q[None], plant.v[None])
    again = controller.step(plant.t, plant.q, plant.v)
    np.testing.assert_allclose(batch[0], again.tau, rtol=0, atol=1e-9)


def test_the_check_says_what_holds_the_posture(tmp_path):
    path = tmp_path / "arm.xml"
    blanks = dict.fromkeys(("option", "flags", "joint", "b1", "b2", "b3", "j1"), "")
    path.write_text(ARM.format(**blanks, j2='stiffness="30" springref="1"'))
    robot = load_robot(path)
    needed = check_robot(robot).joints[1].gravity
    robot.update(robot.q_reference, np.zeros(3))
    assert needed == robot.bias[1] == pytest.approx(robot.gravity[1] - 30.0)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ('<worldbody><body><joint type="ball" name="b" stiffness="2"/>', "springs of b are not"),
        (
            '<tendon><fixed name="t" stiffness="3"><joint joint="j" coef="1"/></fixed></tendon>'
            "<worldbody><body>",
            "springs of the tendons t",
        ),
        ('<option density="1.2"/><worldbody><body>', "drag of the medium"),
    ],
)
def test_what_stays_unknown_is_said(tmp_path, what, words):
    path = tmp_path / "odd.xml"
    path.write_text(
        f'<mujoco>{what}<geom size=".1"/><body><joint name="j" axis="0 1 0"/>'
        '<geom size=".1" pos=".3 0 0"/></body></body></worldbody></mujoco>'
    )
    with pytest.warns(ModelWarning, match=words):
        load_robot(path)
