"""The plugin for ros2_control, behind the least of ROS 2 that runs it, commands what Python does."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace.export.c_library import export_c
from tests.export.in_c import CC, with_cc

HERE = Path(__file__).parent
SOURCE = HERE.parents[1] / "ros2" / "opspace_controller" / "src" / "opspace_controller.cpp"
CXX = shutil.which("c++")
HEADERS = (
    "controller_interface/controller_interface.hpp",
    "pluginlib/class_list_macros.hpp",
    "rclcpp/rclcpp.hpp",
    "rclcpp_lifecycle/state.hpp",
    "std_msgs/msg/float64_multi_array.hpp",
    "std_msgs/msg/int64.hpp",
)


def controller():
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    hand = osc.PositionTask(target=robot.position(robot.tool), max_speed=0.2, name="hand")
    posture = osc.PostureTask(robot.q_reference)
    stack = osc.Stack([hand, posture], limits=osc.JointLimits())
    return osc.Controller(robot, stack, torque_limits="priority", period=1e-3)


def built(directory, found):
    """Compile the plugin, the exported controller and what drives both."""
    export_c(found, directory)
    for name in HEADERS:
        header = directory / name
        header.parent.mkdir(parents=True, exist_ok=True)
        header.write_text('#include "stand_in.hpp"\n')
    library = sorted(path.name for path in directory.glob("opspace*.c"))
    subprocess.run([CC, "-c", "controller.c", *library], cwd=directory, check=True)
    objects = sorted(path.name for path in directory.glob("*.o"))
    words = [CXX, "-std=c++17", "-Wall", "-Wextra", "-Werror", "-I.", f"-I{HERE}"]
    subprocess.run(
        [*words, SOURCE, HERE / "drive.cpp", *objects, "-lm", "-o", "drive"],
        cwd=directory,
        check=True,
    )
    return directory / "drive"


@with_cc
@pytest.mark.skipif(CXX is None, reason="no C++ compiler is installed (c++)")
def test_the_plugin_commands_what_python_does_and_allocates_nothing(tmp_path):
    ours = controller()
    program = built(tmp_path, ours)
    rng = np.random.default_rng(0)
    q = ours.robot.q_reference + 0.05 * rng.normal(size=(100, 6))
    v = 0.05 * rng.normal(size=(100, 6))
    q[90, 2] = np.nan
    given = np.column_stack([np.zeros(100), q, v])
    done = subprocess.run([program], input=given.tobytes(), capture_output=True, check=True)
    found = np.frombuffer(done.stdout).reshape(100, 7)
    for k in range(90):
        if k == 20:
            ours.stack["hand"].target = [0.4, 0.1, 0.5]
        if k == 40:
            ours.stack.remove("posture", duration=0.02)
        command = ours.step(k * 1_000_000 * 1e-9, q[k], v[k])
        np.testing.assert_array_equal(found[k, 1:], command.tau, err_msg=f"cycle {k}")
    assert not found[:90, 0].any()
    assert found[90, 0] == 1.0, "a state that is not finite is an error"
    told = done.stderr.decode().splitlines()
    assert told[0] == "joint1/position joint1/velocity joint1/effort"
    assert "~/hand/target: refused" in done.stderr.decode()
