"""Torque limits are what MuJoCo's own actuators give at most, and what they cannot say is said."""

import mujoco
import numpy as np
import pytest

from opspace import Controller, InputError, ModelError, ModelWarning, PostureTask, Stack, load_robot
from opspace.robots.motor_range import motor_range
from opspace.runs.check import check_robot

ARM = """<mujoco><compiler angle="radian"/><option>{option}</option><worldbody>
<body pos="0 0 .5"><joint name="j1" axis="0 1 0" range="-2 2" {j1}/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".04" mass="3"/>
<body pos=".4 0 0"><joint name="j2" axis="0 1 0" range="-2 2" {j2}/><site name="tip" pos=".4 0 0"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass="2"/>
</body></body></worldbody>
<tendon><fixed name="t" {tendon}><joint joint="j1" coef="{coef}"/></fixed>
<fixed name="both"><joint joint="j1" coef="1"/><joint joint="j2" coef="-1"/></fixed></tendon>
<actuator>{motors}</actuator></mujoco>"""
OTHER = '<motor joint="j2" ctrlrange="-1 1"/>'


@pytest.fixture
def arm(tmp_path):
    def write(motors, option="", j1="", j2="", tendon="", coef="0.5"):
        path = tmp_path / "arm.xml"
        text = ARM.format(motors=motors, option=option, j1=j1, j2=j2, tendon=tendon, coef=coef)
        path.write_text(text)
        return path

    return write


def given_at_most(path):
    """Least and largest torque of each joint, by asking MuJoCo for far too much."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    found = []
    for sign in (-1.0, 1.0):
        mujoco.mj_resetData(model, data)
        data.ctrl[:] = sign * 1e6
        mujoco.mj_forward(model, data)
        found.append(np.array(data.qfrc_actuator))
    return np.sort(found, axis=0)


@pytest.mark.parametrize(
    "what",
    [
        {"motors": '<motor joint="j1" ctrlrange="-10 10" forcerange="-100 100"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-10 10" forcerange="-7 7"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-1 1" gear="30"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-1 1" gear="-30"/>'},
        {"motors": '<motor jointinparent="j1" ctrlrange="-6 6"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-6 6"/>', "j1": 'actuatorfrcrange="-4 4"'},
        {"motors": '<motor joint="j1" ctrlrange="-6 6"/>', "j1": 'actuatorfrcrange="-9 9"'},
        {"motors": '<motor joint="j1" ctrlrange="-6 6"/><motor joint="j1" ctrlrange="-2 2"/>'},
        {"motors": '<motor tendon="t" ctrlrange="-6 6" gear="2"/>'},
        {"motors": '<motor tendon="t" ctrlrange="-6 6"/>', "coef": "-3"},
        {"motors": '<motor tendon="t" ctrlrange="-6 6"/>', "tendon": 'actuatorfrcrange="-4 4"'},
        {"motors": '<general joint="j1" gainprm="3" ctrlrange="-2 2"/>'},
        {"motors": '<motor joint="j1" ctrlrange="0 5"/><motor joint="j1" ctrlrange="-5 0"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-2 5"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-9 9" forcerange="-9 3" gear="-2"/>'},
        {"motors": '<motor joint="j1" ctrlrange="-9 9"/>', "j1": 'actuatorfrcrange="-4 7"'},
        {"motors": '<motor tendon="t" ctrlrange="-1 6"/>', "coef": "-3"},
        {
            "motors": '<motor joint="j1" ctrlrange="-6 6" forcerange="-9 9"/>',
            "option": '<flag clampctrl="disable"/>',
        },
        {
            "motors": '<motor joint="j1" ctrlrange="-6 6"/>'
            '<motor joint="j1" ctrlrange="-2 2" group="3"/>',
            "option": '<flag clampctrl="enable"/>',
        },
    ],
    ids=str,
)
def test_a_limit_is_what_the_actuators_give(arm, what):
    path = arm(**{**what, "motors": what["motors"] + OTHER})
    robot = load_robot(path)
    given = given_at_most(path)
    if "disable" in what.get("option", ""):
        assert robot.torque_limit[0] == given[1, 0]
        return
    np.testing.assert_allclose(robot.torque_limit, np.abs(given).min(axis=0), rtol=1e-12)
    np.testing.assert_allclose(robot.torque_range, given, rtol=1e-12)
    motors = motor_range(robot)
    np.testing.assert_allclose([motors.least, motors.most], given, rtol=1e-12)


def test_a_group_that_is_switched_off_gives_nothing(arm):
    motors = '<motor joint="j1" ctrlrange="-6 6"/><motor joint="j1" ctrlrange="-2 2" group="3"/>'
    path = arm(motors + OTHER)
    path.write_text(path.read_text().replace("<option>", '<option actuatorgroupdisable="3">'))
    np.testing.assert_allclose(load_robot(path).torque_range, given_at_most(path))
    assert load_robot(path).torque_limit[0] == 6.0


@pytest.mark.parametrize(
    ("motor", "limit", "words"),
    [
        ('<motor joint="j1" forcerange="-9 inf"/>', 9.0, "gives -9 to inf N·m; 9 N·m is taken"),
        ('<motor joint="j1" ctrlrange="0 5"/>', 0.0, "0 to 5 N·m: it cannot be driven both ways"),
        ('<motor joint="j1" forcerange="-9 0"/>', 0.0, "-9 to 0 N·m: it cannot be driven both"),
        ('<motor joint="j1" gear="0" ctrlrange="-1 1"/>', 0.0, "0 to 0 N·m: it cannot be driven"),
        ('<position joint="j1" kp="9" forcerange="-3 3"/>', 3.0, "actuator0 pull by themselves"),
        ('<velocity joint="j1" kv="9" forcerange="-3 3"/>', 3.0, "actuator0 pull by themselves"),
        ('<motor site="tip" ctrlrange="-3 3"/>', np.inf, "actuator0 give a joint depends"),
        ('<motor tendon="both" ctrlrange="-3 3"/>', 3.0, "tendon both drives j1, j2 together"),
    ],
)
def test_what_a_limit_cannot_say_is_a_warning_that_names_it(arm, motor, limit, words):
    path = arm(motor + OTHER)
    with pytest.warns(ModelWarning) as caught:
        robot = load_robot(path)
    assert any(words in str(w.message) for w in caught)
    assert robot.torque_limit[0] == limit
    report = check_robot(robot)
    assert any(words in sentence for sentence in report.warnings)
    if limit == 0.0:
        with pytest.raises(InputError, match="without torque in one direction or both: j1"):
            Controller(robot, Stack([PostureTask()]))


def test_actuators_have_inertia_of_their_own(arm):
    path = arm('<motor joint="j1" gear="2" ctrlrange="-9 9"/>' + OTHER)
    still = load_robot(path).M[0, 0]
    path.write_text(path.read_text().replace('gear="2"', 'gear="2" armature="0.5"'))
    if not hasattr(mujoco.MjModel, "actuator_armature"):
        pytest.skip("this MuJoCo knows no armature of actuators")
    for backend in ("pinocchio", "mujoco"):
        robot = load_robot(path, backend=backend)
        assert robot.M[0, 0] == pytest.approx(still + 0.5 * 2.0**2)
    path.write_text(path.read_text().replace('joint="j1" gear', 'tendon="both" gear'))
    with pytest.raises(ModelError, match="armature of actuators that are not on a joint"):
        load_robot(path)


URDF = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="2"/>
<origin xyz="0.2 0 0"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="{kind}"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit {limit}/></joint></robot>"""


def urdf(tmp_path, limit, kind="revolute"):
    path = tmp_path / "r.urdf"
    path.write_text(URDF.format(limit=limit, kind=kind))
    return path


@pytest.mark.parametrize("none", ["-1", "0", "-1.0"])
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_a_urdf_says_no_limit_in_several_ways(tmp_path, none, kind):
    path = urdf(tmp_path, f'lower="-2" upper="2" effort="{none}" velocity="{none}"', kind)
    robot = load_robot(path)
    assert robot.torque_limit[0] == robot.velocity_limit[0] == np.inf
    assert any("no torque limit is known for turn" in w for w in check_robot(robot).warnings)


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ('lower="-2" upper="2" effort="-87" velocity="1"', "effort=-87 of joint 'turn'"),
        ('lower="-2" upper="2" effort="5" velocity="-2"', "velocity=-2 of joint 'turn'"),
        ('lower="1" upper="1" effort="5" velocity="2"', "of joint 'turn' are both 1"),
        ('lower="1" upper="-1" effort="5" velocity="2"', "above its upper limit"),
        ('lower="-2" upper="2" effort="nan" velocity="2"', "effort='nan'"),
    ],
)
def test_a_limit_without_sense_is_refused_by_name(tmp_path, limit, words):
    with pytest.raises(ModelError, match=words):
        load_robot(urdf(tmp_path, limit))


def test_limits_that_are_both_zero_are_none_and_said_so(tmp_path):
    with pytest.warns(ModelWarning, match="limit of turn are both 0: taken as no limit"):
        robot = load_robot(urdf(tmp_path, 'lower="0" upper="0" effort="5" velocity="2"'))
    assert robot.q_upper[0] == np.inf


def test_a_link_that_occurs_twice_is_refused(tmp_path):
    path = urdf(tmp_path, 'lower="-1" upper="1" effort="5" velocity="2"')
    path.write_text(
        path.read_text().replace('<link name="a"/>', '<link name="a"/><link name="a"/>')
    )
    with pytest.raises(ModelError, match="link 'a' occurs twice"):
        load_robot(path)
