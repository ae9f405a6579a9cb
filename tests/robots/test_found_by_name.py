"""Everything that a file names can be reached, and what has no name gets one of its own."""

import mujoco
import numpy as np
import pytest

from opspace import ModelWarning, load_robot
from tests.robots.samples import BACKENDS

ARM = """<mujoco><worldbody><body name="{b1}"><joint {j1} axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><site name="{s1}" pos=".1 0 0"/>
<body name="{b2}" pos=".3 0 0"><joint {j2} axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><site name="{s2}" pos=".3 0 .1"/>
</body></body></worldbody><keyframe>{keys}</keyframe></mujoco>"""


@pytest.fixture
def arm(tmp_path):
    def write(b1="a", b2="b", s1="s", s2="t", j1='name="one"', j2='name="two"', keys=""):
        path = tmp_path / "arm.xml"
        path.write_text(ARM.format(b1=b1, b2=b2, s1=s1, s2=s2, j1=j1, j2=j2, keys=keys))
        return path

    return write


def places(path):
    """Where MuJoCo has every body and site, in the order of opspace's frames."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = [data.xpos[i] for i in range(model.nbody) if model.body(i).name]
    return np.array(bodies + [data.site_xpos[i] for i in range(model.nsite) if model.site(i).name])


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("names", "called"),
    [
        ({"b2": "tool", "s2": "tool"}, "site:tool"),
        ({"b1": "gripper", "s2": "gripper"}, "site:gripper"),
        ({"b1": "site:x", "b2": "x", "s2": "x"}, "site:site:x"),
        ({"s1": "world"}, "site:world"),
        ({"b1": "schöner Arm", "s1": "schöner Arm"}, "site:schöner Arm"),
        ({"b1": "/a", "s1": "/a"}, "site:/a"),
    ],
    ids=str,
)
def test_a_body_and_a_site_of_one_name_are_both_there(arm, backend, names, called):
    path = arm(**names)
    with pytest.warns(ModelWarning, match="a body and a site are called"):
        robot = load_robot(path, backend=backend)
    assert called in robot.frame_names
    assert len(set(robot.frame_names)) == len(robot.frame_names)
    robot.update(np.zeros(2), np.zeros(2))
    found = [robot.position(robot.frame_id(name)) for name in robot.frame_names]
    np.testing.assert_allclose(found, places(path), atol=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "names"),
    [
        ("", "", ("joint0", "joint1")),
        ('name="joint1"', "", ("joint1", "joint1_")),
        ("", 'name="joint0"', ("joint0_", "joint0")),
        ('name="/j1"', 'name="j 2"', ("/j1", "j 2")),
    ],
)
def test_joints_without_a_name_get_one_that_nobody_has(arm, first, second, names):
    for backend in BACKENDS:
        assert load_robot(arm(j1=first, j2=second), backend=backend).joint_names == names


def test_coordinates_and_postures_have_names_of_their_own(tmp_path, arm):
    keys = '<key qpos="0.1 0.2"/><key name="key0" qpos="0.3 0.4"/>'
    assert list(load_robot(arm(keys=keys)).configurations) == ["key0_", "key0"]
    path = tmp_path / "ball.xml"
    path.write_text(
        '<mujoco><worldbody><body><joint name="b" type="ball"/><geom size=".1"/><body>'
        '<joint name="b/1"/><geom size=".1" pos=".3 0 0"/></body></body></worldbody></mujoco>'
    )
    assert load_robot(path).joint_names == ("b/0", "b/1_", "b/2", "b/1")


def test_the_tool_has_a_name_even_where_the_last_body_has_none(arm):
    robot = load_robot(arm(b2="", s2=""))
    assert robot.tool == "s"
