"""Recordings and exports of robots whose joints slide, or have names with slashes and spaces."""

import csv
import json

import numpy as np
import pytest

import opspace as osc
from opspace.export import export
from opspace.plots import plot_columns
from opspace.runs.check import check_robot
from opspace.runs.metrics import measure, units_of
from opspace.runs.tables import joints_table, metrics_table, timeline_table
from tests.robots.hands_and_scenes import arm_with_fingers, joint, link

NAMES = ("/arm/lift", "left/turn", "Gelenk drei ä", "j 4")
ARM = """<mujoco><worldbody><body name="a"><joint name="{}" type="slide" axis="0 0 1" range="0 .5"/>
<geom size=".1" mass="2"/><body><joint name="{}" axis="0 1 0" range="-90 90"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><body pos=".3 0 0">
<joint name="{}" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>
<body pos=".3 0 0"><joint name="{}" type="slide" axis="1 0 0"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/></body></body></body></body></worldbody>
</mujoco>"""


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format(*NAMES))
    robot = osc.load_robot(path)
    controller = osc.Controller(robot, osc.Stack([osc.JointLimits(), osc.PostureTask()]))
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    plant = osc.Plant(robot, robot.q_reference)
    osc.simulate(plant, controller, 0.005, [recorder])
    recorder.close()
    return osc.load(tmp_path / "run")


def test_what_slides_is_recorded_in_metres_and_newtons(recording):
    lengths = ("m", "rad", "rad", "m")
    for name, unit in zip(NAMES, lengths, strict=True):
        assert recording.units[f"q/{name}"] == unit
        assert recording.units[f"v/{name}"] == f"{unit}/s"
        assert recording.units[f"tau/{name}"] == ("N" if unit == "m" else "N·m")
    rows = [recording.units[f"tasks/posture/error/{i}"] for i in range(4)]
    assert tuple(rows) == lengths == tuple(recording.header["robot"]["units"])
    assert recording.members("q") == tuple(f"q/{name}" for name in NAMES)


def fingers(path):
    """A finger that slides, and one that turns as the first one slides."""
    return arm_with_fingers(path / "hand.urdf", "", '<mimic joint="f1" multiplier="20"/>')


def lift(path):
    """A column with wheels: what turns without end stands beside what slides."""
    written = path / "lift.urdf"
    links = "".join(map(link, ("base", "carriage", "arm", "wheel")))
    up = joint("lift", "base", "carriage", kind="prismatic", axis="0 0 1")
    wheel = joint("roll", "base", "wheel", kind="continuous")
    shoulder = joint("shoulder", "carriage", "arm")
    written.write_text(f'<robot name="r">{links}{up}{shoulder}{wheel}</robot>')
    return written


def cart(path):
    """A base that slides twice and turns, by one body of an MJCF file."""
    written = path / "cart.xml"
    written.write_text(
        '<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0"/>'
        '<joint name="y" type="slide" axis="0 1 0"/><joint name="yaw" axis="0 0 1"/>'
        '<geom size=".2"/></body></worldbody></mujoco>'
    )
    return written


@pytest.mark.parametrize(
    ("write", "slides"),
    [(fingers, {"f1"}), (lift, {"lift"}), (cart, {"x", "y"})],
)
def test_tasks_checks_and_recordings_measure_slides_in_metres(tmp_path, write, slides):
    robot, task = osc.load_robot(write(tmp_path)), osc.PostureTask()
    controller = osc.Controller(robot, osc.Stack([osc.JointLimits(), task]))
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    osc.simulate(osc.Plant(robot, robot.q_reference), controller, 0.002, [recorder])
    recorder.close()
    units = osc.load(tmp_path / "run").units
    of_place = ["m" if name in slides else "rad" for name in robot.joint_names]
    assert [units[f"q/{name}"] for name in robot.joint_names] == of_place == list(task.units)
    assert [report.unit for report in check_robot(robot).joints] == of_place
    for name, unit in zip(robot.joint_names, of_place, strict=True):
        assert units[f"v/{name}"] == f"{unit}/s"
        assert units[f"tau/{name}"] == ("N" if unit == "m" else "N·m")


def test_odd_names_reach_every_format(recording, tmp_path):
    assert export(recording, tmp_path / "run.csv").is_file()
    with (tmp_path / "run.csv").open(encoding="utf-8") as file:
        heads = next(csv.reader(file))
    assert "tau//arm/lift [N]" in heads
    assert "q/Gelenk drei ä [rad]" in heads
    mcap = pytest.importorskip("mcap.reader")
    export(recording, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        _, channel, message = next(
            iter(mcap.make_reader(file).iter_messages(topics=["/q"])), (None, None, None)
        )
        found = json.loads(message.data)
    assert channel.topic == "/q"
    assert found["/arm/lift"] == recording["q//arm/lift"][0]
    assert found["left"]["turn"] == recording["q/left/turn"][0]
    pytest.importorskip("rerun")
    assert export(recording, tmp_path / "run.rrd").stat().st_size > 0


def test_what_is_measured_of_a_run_has_both_units(recording, tmp_path):
    """The largest of any joint may be one that turns or one that slides."""
    found = units_of(recording)
    assert (found["max_torque_step"], found["max_joint_speed"]) == ("N, N·m", "m/s, rad/s")
    _, rows = metrics_table({"value": measure(recording)}, found)
    written = {row[0]: row[-1] for row in rows}
    assert written["max torque step"] == "N, N·m"
    assert written["max joint speed"] == "m/s, rad/s"
    assert timeline_table([], recording)[0][-1] == "largest torque step [N, N·m]"
    robot = osc.load_robot(tmp_path / "arm.xml")
    controller = osc.Controller(robot, osc.Stack([osc.JointLimits(), osc.PostureTask()]))
    again = osc.replay(recording, controller)
    assert (again.gap, again.unit) == (0.0, "N, N·m")
    labels = [axes.get_ylabel() for axes in plot_columns({"run": recording}, ["tau"]).axes]
    assert labels == ["joint force [N]", "joint torque [N·m]"]


def test_a_stop_and_a_check_say_newtons(recording, tmp_path):
    robot = osc.load_robot(tmp_path / "arm.xml")
    rule = osc.StopRule(max_joint_speed=1.0, max_torque=1.0)
    assert rule.reason(robot, np.array([2.0, 0, 0, 0]), np.zeros(4)).endswith("at 2.0 m/s")
    assert rule.reason(robot, np.zeros(4), np.array([5.0, 0, 0, 0])).endswith("asked for 5 N")
    assert rule.reason(robot, np.zeros(4), np.array([0, 5.0, 0, 0])).endswith("for 5 N·m")
    q, v = robot.q_reference, np.array([0.2, 0.1, 0.0, -0.1])
    assert repr(osc.Plant(robot, q, v)).endswith("fastest joint 0.2 m/s)")
    assert repr(osc.Plant(robot, q, -2.0 * v[::-1])).endswith("fastest joint 0.4 m/s)")
    assert repr(osc.Plant(robot, q, np.roll(v, 1))).endswith("fastest joint 0.2 rad/s)")
    heads, rows = joints_table(check_robot(robot).joints)
    assert heads[1] == "reference [m, rad]"
    assert heads[5] == "torque [N, N·m]"
    assert [row[0] for row in rows][:2] == ["/arm/lift [m]", "left/turn [rad]"]
