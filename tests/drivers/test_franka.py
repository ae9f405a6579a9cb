"""The driver of Franka arms, against a simulated robot that speaks the real one's protocol."""

import os
import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace.drivers.franka import FrankaDriver
from opspace.loop.driver import DriverFacts

pytestmark = pytest.mark.slow
pytest.importorskip("pylibfranka", reason="needs the extra franka")
PYTHON = os.environ.get("FRANKA_SIM_PYTHON", "")
if not PYTHON:
    pytest.skip(
        "FRANKA_SIM_PYTHON must name a Python that has franka-sim, which needs another MuJoCo",
        allow_module_level=True,
    )
WHERE = "import franka_sim; print(franka_sim.__file__)"

ROUNDS = 5
"""How often all changes are made, of 12 s each."""
REFLEX_FREE = ["--enforce-comm-constraints", "--enforce-motion-limits"]


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The arm without its meshes, with rotors heavy enough for the simulator's own position servo."""
    import mujoco

    found = subprocess.run([PYTHON, "-c", WHERE], check=True, capture_output=True, text=True)
    folder = Path(found.stdout.strip()).parent
    text = (folder / "models" / "fr3.urdf").read_text("utf-8")
    for part in ("visual", "collision"):
        text = re.sub(rf"<{part}\b.*?</{part}>", "", text, flags=re.DOTALL)
    spec = mujoco.MjSpec.from_string(text)
    for joint in spec.joints:
        joint.armature = 0.4
        joint.damping = np.zeros_like(joint.damping)
    spec.compile()
    path = tmp_path_factory.mktemp("franka") / "fr3.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    return path


@pytest.fixture
def arm_apart(model, tmp_path):
    """Have such a robot listen here; gives its log."""
    log = tmp_path / "log"
    command = [PYTHON, "-m", "franka_sim.run_server", "--no-gripper", *REFLEX_FREE]
    with log.open("w") as file:
        known = {**os.environ, "FR3_MJCF": str(model), "PYTHONPATH": ""}
        robot = subprocess.Popen(command, stdout=file, stderr=file, env=known)
        try:
            end = time.monotonic() + 60.0
            while "ready for new client" not in log.read_text(errors="replace"):
                assert robot.poll() is None, log.read_text(errors="replace")
                assert time.monotonic() < end
                time.sleep(0.1)
            yield log
        finally:
            robot.terminate()
            robot.wait(timeout=30)


def controller_of(model, gravity="robot"):
    robot = osc.load_robot(model)
    hand = osc.PositionTask(kp=100.0, max_speed=0.25)
    turn = osc.OrientationTask(kp=100.0, max_speed=0.5)
    posture = osc.PostureTask(kp=25.0, max_speed=0.5)
    # The arm takes less speed near the ends of its joints; the model says nothing of speeds.
    speeds = dict.fromkeys(robot.joint_names, 1.5)
    limits = osc.JointLimits(clearance=0.03, brake_acceleration=1.5, speeds=speeds)
    stack = osc.Stack([turn, hand, posture], limits=limits)
    controller = osc.Controller(
        robot,
        stack,
        gravity=gravity,
        torque_limits="priority",
        period=1e-3,
        on_time_jump="hold",  # a busy computer
    )
    return controller, hand


class Lossy(FrankaDriver):
    """Loses 1 to 19 commands in a row."""

    def __init__(self, host, **options):
        super().__init__(host, **options)
        self.left, self.cycles = 0, 0
        self.chance = np.random.default_rng(0)

    def write(self, tau):
        self.cycles += 1
        if self.cycles % 300 == 0:
            self.left = int(self.chance.integers(1, 20))
        if self.left == 0:
            super().write(tau)
        self.left = max(self.left - 1, 0)


@pytest.mark.parametrize("driver", [FrankaDriver, Lossy])
def test_no_reflex_whatever_tasks_and_targets_do(arm_apart, model, driver):
    controller, hand = controller_of(model)
    guest = osc.JointTask("joint4", max_speed=0.5)
    controller.stack.prepare(guest)
    loop = osc.Loop(
        controller,
        driver("127.0.0.1", real_time=False),
        tasks=[guest],
        patience=2000,
        real_time=osc.RealTime(),
        stop_on=osc.Status.FAULT,
    )
    stack, turn = controller.stack, controller.stack["orientation"]
    guest.target = controller.robot.q_upper[3]
    with loop:
        at = controller.robot.position("link7").copy()
        for change in ROUNDS * (
            lambda: setattr(hand, "target", at + [0.1, 0.2, 0.1]),
            lambda: stack.insert(guest, level=-1, duration=0.3),
            lambda: setattr(hand, "target", at + [1.0, 0.0, 0.3]),  # beyond its reach
            lambda: stack.remove(guest, duration=0.3),
            lambda: stack.swap(turn, hand, duration=0.3),
            lambda: setattr(hand, "target", at),
        ):
            change()
            t = loop.report.t
            while loop.wait(0.05) and loop.report.t < t + 2.0:
                pass
    report = loop.report
    assert report.completed, f"{report.reason}\n{arm_apart.read_text(errors='replace')[-2000:]}"
    assert report.standstill
    assert report.counts.limited > 0
    robot = controller.robot
    robot.update(loop.history.q[-1], np.zeros(7))
    assert np.abs(robot.position("link7") - at).max() < 0.02


def test_a_controller_that_holds_the_weight_itself_is_refused(arm_apart, model):
    class Wrong(FrankaDriver):
        facts = DriverFacts(1e-3, gravity="controller", torque_rate=1000.0)

    controller, _ = controller_of(model, gravity="controller")
    with pytest.raises(osc.InputError, match="declare gravity='robot'"):
        osc.Loop(controller, Wrong("127.0.0.1", real_time=False), patience=2000).run(1.0)
    with pytest.raises(osc.InputError, match="must be built with that"):
        osc.Loop(controller, FrankaDriver("127.0.0.1", real_time=False))


def test_a_robot_that_is_not_there_is_named():
    controller, _ = controller_of_puma()
    driver = FrankaDriver("127.0.0.1", real_time=False)
    with pytest.raises(osc.RobotStoppedError, match=r"127\.0\.0\.1"):
        osc.Loop(controller, driver).run(1.0)


def controller_of_puma():
    robot = osc.load_robot("puma560")
    return osc.Controller(robot, osc.Stack([osc.PostureTask()]), gravity="robot", period=1e-3), None
