"""Meshes and pictures that are only looked at may be missing; those that weigh something may not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace import ModelError, ModelWarning, load_robot
from tests.robots.samples import BACKENDS

TEXT = """<mujoco><compiler {compiler}/><default><default class="look"><geom contype="0"
conaffinity="0" group="2" {default}/></default></default><asset><mesh name="hull" file="hull.stl"/>
<mesh file="parts/cap.obj"/>{asset}</asset><worldbody><body name="a">{inertial}
<joint name="j" axis="0 1 0"/><geom class="look" type="mesh" mesh="hull" {geom}/>
<geom name="cover" class="look" type="mesh" mesh="cap" {geom}/>
{more}</body></worldbody></mujoco>"""
INERTIAL = '<inertial pos=".15 0 0" mass="1" diaginertia=".01 .01 .01"/>'
CAPSULE = '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" group="3"/>'
PICTURE = """<texture name="wood" type="2d" file="wood.png"/><material name="wood" texture="wood"/>
<mesh name="tool" file="tool.stl"/>"""


def write(path: Path, **parts: str) -> Path:
    blanks = dict.fromkeys(("compiler", "default", "asset", "inertial", "geom", "more"), "")
    path.write_text(TEXT.format(**(blanks | parts)))
    return path


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "parts",
    [
        {"inertial": INERTIAL},
        {"inertial": INERTIAL, "compiler": 'meshdir="assets" texturedir="t"', "asset": PICTURE},
        {"more": CAPSULE, "geom": 'mass="0"'},
        {"more": CAPSULE, "default": 'mass="0"'},
        {"more": CAPSULE, "compiler": 'inertiagrouprange="3 4"'},
        {"inertial": INERTIAL, "compiler": 'inertiafromgeom="false" strippath="true"'},
    ],
)
def test_what_is_only_drawn_may_be_missing(
    tmp_path: Path, parts: dict[str, str], backend: str
) -> None:
    with pytest.warns(ModelWarning, match=r"missing and not drawn: hull.stl, parts/cap.obj"):
        robot = load_robot(write(tmp_path / "m.xml", **parts), backend=backend)
    plain = tmp_path / "plain.xml"
    body = parts.get("inertial", "") + parts.get("more", "")
    plain.write_text(
        f'<mujoco><worldbody><body name="a">{body}<joint name="j" axis="0 1 0"/></body>'
        "</worldbody></mujoco>"
    )
    np.testing.assert_allclose(robot.M, load_robot(plain).M)
    assert osc.Plant(robot, robot.q_reference).model.nmesh == 0


@pytest.mark.parametrize(
    "parts",
    [{}, {"inertial": INERTIAL, "compiler": 'inertiafromgeom="true"'}, {"more": CAPSULE}],
)
def test_a_mesh_that_gives_the_inertia_is_asked_for(tmp_path: Path, parts: dict[str, str]) -> None:
    with pytest.raises(ModelError, match=r"mesh file 'hull.stl' is missing, and the inertia of"):
        load_robot(write(tmp_path / "m.xml", **parts))


def test_a_mesh_that_is_there_is_used(tmp_path: Path) -> None:
    corners = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"]
    faces = ["1 3 2", "1 2 4", "1 4 3", "2 3 4"]
    lines = [f"v {corner}" for corner in corners] + [f"f {face}" for face in faces]
    (tmp_path / "parts").mkdir()
    for name in ("hull.obj", "parts/cap.obj"):
        (tmp_path / name).write_text("\n".join(lines))
    path = write(tmp_path / "m.xml")
    path.write_text(path.read_text().replace("hull.stl", "hull.obj"))
    robot = load_robot(path)
    assert robot.M[0, 0] > 1.0
    assert osc.Plant(robot, robot.q_reference).model.nmesh == 2
