"""Whatever a file says: a scenario, a robot, or an error of the library that names what is wrong."""

import copy
import functools
import random

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import OpspaceError
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario, scenario_from, shipped_scenarios, to_dict
from tests.budget import examples

SEEDS = st.integers(0, 2**32 - 1)
ODD = [
    None, True, -1, 0, 1e308, -1e308, 1e-320, float("nan"), float("inf"), "", "x", "puma560", "~",
    [], {}, [None], [1.0, 2.0, 3.0], {"a": 1}, [[1]], 10**30, "tool", "1", {"type": "hold"},
    {"type": "circle"}, [float("nan")] * 3, "../..", "\x00", "ä" * 300,
]  # fmt: skip

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="2.0"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0" rpy="0 0.1 0"/><mass value="1.0"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="40" velocity="3"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/>
    <origin xyz="0.3 0 0" rpy="0 0 0"/></joint>
</robot>"""
MJCF = """<mujoco model="arm"><compiler angle="radian"/><worldbody>
  <body name="upper" pos="0 0 0.3"><joint name="shoulder" axis="0 1 0" range="-2 2"/>
    <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" mass="1"/>
    <body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
      <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" mass="1"/>
      <site name="tool" pos="0.3 0 0"/></body></body>
</worldbody><actuator><motor joint="shoulder" ctrlrange="-20 20"/><motor joint="elbow"/></actuator>
</mujoco>"""
WORDS = [
    '"',
    "<",
    ">",
    "/",
    "0",
    "-1",
    "nan",
    "inf",
    "1e999",
    "  ",
    "\n",
    "name",
    "link",
    "ä",
    "&",
    "\x01",
]


def named(error, word=""):
    """An error of the library: one line that says something."""
    assert str(error).strip()
    assert "\n" not in str(error)
    assert word in str(error)


def places(data, at=()):
    """Every key of nested mappings and lists."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in list(items):
        yield (*at, key)
        if isinstance(value, dict | list):
            yield from places(value, (*at, key))


def mutated(data, rng):
    """Replace, remove, rename or double something, several times."""
    data = copy.deepcopy(data)
    for _ in range(rng.randint(1, 3)):
        place = rng.choice(list(places(data)))
        holder = data
        for key in place[:-1]:
            holder = holder[key]
        last, kind = place[-1], rng.random()
        if kind < 0.7:
            holder[last] = copy.deepcopy(rng.choice(ODD))
        elif kind < 0.85 or isinstance(holder, list):
            del holder[last]
        else:
            holder[rng.choice(["x", 3, "type", "level", ""])] = holder.pop(last)
        if not list(places(data)):
            break
    return data


@functools.cache
def text_of(name):
    return yaml.safe_dump(to_dict(load_scenario(name)), sort_keys=False)


def damaged(text, rng):
    """Cut, double or overwrite pieces of a text."""
    for _ in range(rng.randint(1, 4)):
        i, j = sorted(rng.randrange(len(text) + 1) for _ in range(2))
        j = min(j, i + 40)
        text = text[:i] + rng.choice(["", *WORDS, text[i:j] * 2]) + text[rng.choice([i, j]) :]
        text = text or " "
    return text


@given(SEEDS)
@examples(50)
def test_a_scenario_with_odd_values_is_one_or_is_refused(seed):
    rng = random.Random(seed)
    data = mutated(yaml.safe_load(text_of(rng.choice(list(shipped_scenarios())))), rng)
    try:
        scenario = scenario_from(data)
    except OpspaceError as error:
        named(error)
        return
    scenario = scenario.model_copy(update={"duration": min(scenario.duration, 0.01)})
    try:
        with np.errstate(all="ignore"):
            built = build(scenario)
            command = built.controller.step(0.0, built.plant.q, built.plant.v)
    except OpspaceError as error:
        named(error)
        return
    assert np.isfinite(command.tau).all()


@given(SEEDS)
@examples(50)
def test_a_damaged_scenario_file_is_one_or_is_refused(tmp_path_factory, seed):
    rng = random.Random(seed)
    path = tmp_path_factory.mktemp("fuzz") / "scenario.yaml"
    text = damaged(text_of(rng.choice(list(shipped_scenarios()))), rng)
    path.write_bytes(text.encode() if rng.random() < 0.9 else text.encode("utf-16"))
    try:
        load_scenario(path)
    except OpspaceError as error:
        named(error, "scenario.yaml")


@pytest.mark.parametrize(("suffix", "source"), [(".urdf", URDF), (".xml", MJCF)])
@given(SEEDS)
@examples(40)
def test_a_damaged_robot_file_is_a_robot_or_is_refused(tmp_path_factory, suffix, source, seed):
    path = tmp_path_factory.mktemp("fuzz") / f"arm{suffix}"
    path.write_text(damaged(source, random.Random(seed)), encoding="utf-8")
    try:
        robot = osc.load_robot(path)
        osc.Controller(robot, osc.Stack([osc.PostureTask()]))
    except OpspaceError as error:
        named(error)


@pytest.mark.parametrize(
    "path", ["", ".", "/", "nowhere.urdf", "nowhere.xml", "a\x00b.urdf", "~/x.urdf"]
)
def test_a_path_that_is_none_is_refused_by_name(path):
    with pytest.raises(OpspaceError):
        osc.load_robot(path)


def test_a_directory_or_an_empty_file_is_refused_by_name(tmp_path):
    for suffix in (".urdf", ".xml"):
        (tmp_path / f"folder{suffix}").mkdir()
        (tmp_path / f"empty{suffix}").touch()
        for name in ("folder", "empty"):
            with pytest.raises(OpspaceError, match=name):
                osc.load_robot(tmp_path / f"{name}{suffix}")
