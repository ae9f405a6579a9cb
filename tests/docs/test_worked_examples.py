"""The patches in docs/architecture.md apply, touch as few files as it says, and do what it says."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.another_python import python

import opspace

PAGE = Path(__file__).resolve().parents[2] / "docs" / "architecture.md"
PATCHES = dict(
    re.findall(
        r"^### (.+?)\n(?:(?!^###).)*?```diff\n(.*?)```", PAGE.read_text("utf-8"), re.M | re.S
    )
)
MOST = {"A task kind": 3, "A profile": 1, "A joint-limit law": 2}

USE = """
import numpy as np
import opspace as osc
from opspace.controller import ReferenceController
from opspace.scenario import load_scenario, scenario_from, to_dict

def torques(form):
    arm = osc.load_robot("puma560")
    q, v = arm.q_reference, np.full(6, 0.3)
    limits = osc.JointLimits(0.2, mode="creep", joints={"joint1": (-0.1, 0.1)})
    stack = osc.Stack([limits, osc.PositionTask(kp=1.0), osc.PostureTask(kp=1.0)])
    controller = form(arm, stack)
    stack.insert(osc.UprightTask(max_speed=0.5), level=0, duration=0.01, profile="septic")
    return [controller.step(0.001 * i, q + 0.0003 * i, v) for i in range(12)]

readable = torques(ReferenceController)
assert any("joint1/upper" in command.limits for command in readable)
assert osc.Profile("septic")(0.5).value == 0.5
data = to_dict(load_scenario("joint-limit"))
data["tasks"]["cup"] = {"type": "upright", "level": 3, "kp": 50.0}
data["joint_limits"]["mode"] = "creep"
assert scenario_from(data).joint_limits.mode == "creep"
"""
BOTH = """
for ours, theirs in zip(torques(osc.Controller), readable, strict=True):
    np.testing.assert_allclose(ours.tau, theirs.tau, rtol=0, atol=1e-9 * np.abs(theirs.tau).max())
"""


def files_of(patch):
    return re.findall(r"^\+\+\+ b/src/(.+)$", patch, re.M)


@pytest.mark.parametrize("what", MOST)
def test_a_patch_touches_few_files(what):
    assert 1 <= len(set(files_of(PATCHES[what]))) <= MOST[what]


@pytest.fixture
def patched(tmp_path):
    package = Path(opspace.__file__).parent
    shutil.copytree(
        package, tmp_path / "src" / "opspace", ignore=shutil.ignore_patterns("__pycache__")
    )
    for patch in PATCHES.values():
        subprocess.run(["git", "apply"], input=patch, encoding="utf-8", cwd=tmp_path, check=True)
    return tmp_path


def use(patched, program):
    environment = {**os.environ, "PYTHONPATH": str(patched / "src")}
    subprocess.run(python("-c", program), env=environment, check=True)


def test_what_the_patches_add_works(patched):
    use(patched, USE)


@pytest.mark.slow  # it compiles the tick anew
def test_what_the_patches_add_works_compiled(patched):
    use(patched, USE + BOTH)
