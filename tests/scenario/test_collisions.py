"""Obstacles in scenario files."""

import numpy as np
import pytest

import opspace as osc
from opspace.runs.run import run_scenario
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario, scenario_from

BALL = {"shape": "ball", "radius": 0.1, "position": [2.0, 0.0, 0.0], "velocity": [0.0, 0.5, 0.0]}
WALL = {"shape": "half-space", "normal": [-1.0, 0.0, 0.0], "position": [2.0, 0.0, 0.0]}


SHIPPED = [
    "table",
    "self-fold",
    "moving-ball",
    "gap",
    "clutter",
    "two-arms",
    "humanoid-reach",
]


def scenario(obstacles, **more):
    return scenario_from(
        {
            "robot": "puma560",
            "duration": 0.05,
            "tasks": {"posture": {"type": "posture", "level": 0}},
            "collisions": {"pairs": "none", "obstacles": obstacles, **more},
        }
    )


def test_obstacles_are_built_with_the_names_of_the_file_and_move_on():
    built = build(scenario({"ball": BALL, "wall": {**WALL, "ignore": ["link1"]}}, margin=0.02))
    guard = built.controller.collisions
    assert guard.margin == 0.02
    q, v = built.robot.q_reference, np.zeros(6)
    seen = [built.controller.step(t, q, v).distances["link6/ball"].distance for t in (0.0, 1.0)]
    assert guard["ball"].position == pytest.approx([2.0, 0.5, 0.0])
    assert guard["ball"].velocity[:3] == pytest.approx([0.0, 0.5, 0.0])
    assert seen[0] != seen[1]
    assert "link1/wall" not in built.controller.step(2.0, q, v).distances
    assert build(scenario({"ball": BALL})).controller.collisions is not guard


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({**BALL, "size": [1, 1, 1]}, "not something that a ball has"),
        ({"shape": "box", "position": [0, 0, 0]}, "needed for a box"),
        ({**BALL, "radius": -1.0}, "radius"),
        ({**BALL, "shape": "cone"}, "shape"),
        ({"shape": "mesh", "position": [2, 0, 0], "vertices": [[0, 0, 0]]}, "not in a plane"),
        ({**WALL, "normal": [0.0, 0.0, 0.0]}, "must not be zero"),
        ({**BALL, "ignore": ["hand"]}, "hand"),
    ],
)
def test_what_a_shape_does_not_have_is_refused_with_its_key(entry, said):
    with pytest.raises(osc.OpspaceError, match=said) as error:
        build(scenario({"thing": entry}))
    assert "collisions" in str(error.value)


def test_a_mesh_is_the_hull_of_its_vertices():
    corners = np.indices((2, 2, 2)).reshape(3, 8).T.tolist()
    mesh = {"shape": "mesh", "position": [2.0, 0.0, 0.0], "vertices": [*corners, [0.5, 0.5, 0.5]]}
    guard = build(scenario({"mesh": mesh})).controller.collisions
    assert guard["mesh"].faces.shape == (12, 4, 3)


def test_another_robot_moves_as_the_file_says_and_own_shapes_are_taken():
    times = {"out_duration": 1.0, "back_duration": 1.0}
    other = {
        "robot": "puma560",
        "position": [0.0, 1.5, 0.0],
        "target": {"type": "out_and_back", "offset": [0.3] + [0] * 5, **times},
    }
    shape = {"frame": "link6", "start": [0, 0, 0], "end": [0, 0, 0.1], "radius": 0.05}
    built = build(scenario({}, others={"left": other}, shapes=[shape]))
    guard, q = built.controller.collisions, built.robot.q_reference
    assert [found.frame for found in guard.shapes] == ["link6"]
    tip = [
        built.controller.step(t, q, np.zeros(6)) and guard["left:link6:1"].position
        for t in (0.0, 1.0)
    ]
    base = np.array([0.0, 1.5, 0.0])
    near, far = tip[0] - base, tip[1] - base
    turned = np.arctan2(far[1], far[0]) - np.arctan2(near[1], near[0])
    assert turned == pytest.approx(0.3, abs=1e-9)
    assert np.linalg.norm(far) == pytest.approx(np.linalg.norm(near), abs=1e-9)


@pytest.mark.parametrize(
    ("entry", "said"),
    [({"robot": "pumas"}, "pumas"), ({"robot": "puma560", "target": [0.0, 1.0]}, "shape")],
)
def test_another_robot_that_cannot_be_used_is_refused_with_its_key(entry, said):
    with pytest.raises(osc.OpspaceError, match=said) as error:
        build(scenario({}, others={"left": {"position": [0, 1, 0], **entry}}))
    assert "collisions" in str(error.value)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenes_can_be_built(name):
    assert build(load_scenario(name)).controller.collisions.layout().rows.size


def test_a_recording_tells_the_nearest_pair_and_is_the_same_again(tmp_path):
    ball = {**BALL, "position": [0.9, -0.15, 0.8], "velocity": [-0.5, 0.0, 0.0]}
    run_scenario(scenario({"ball": ball}), tmp_path / "run")
    recording = osc.load(tmp_path / "run")
    least = recording["distances/least"]
    assert np.all(np.diff(least) < 0.0)
    again = build(scenario({"ball": ball}))
    assert osc.replay(recording, again.controller).gap == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_in_shipped_scenes_nothing_comes_nearer_than_the_margin(name):
    built = build(load_scenario(name))
    least, happened = [], osc.Status.OK

    class Look:
        robot = built.controller.robot

        def step(self, t, q, v):
            nonlocal happened
            command = built.controller.step(t, q, v)
            least.append(next(iter(command.distances.values())).distance)
            happened |= command.status
            return command

    osc.simulate(built.plant, Look(), built.scenario.duration)
    assert min(least) >= 0.01 - 2e-4
    assert osc.Status.COLLISION in happened
    assert osc.Status.COLLISION_LOST not in happened
