"""Shapes and pairs in files: what is written is read, and encloses what it did."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.robots.shape_file import FORMAT, read_shapes, write_shapes
from opspace.robots.srdf import disabled_pairs
from opspace.robots.touching import Pairs
from tests.cli.test_cli import run

NUMBERS = st.floats(-2.0, 2.0)
ENDS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
NAMES = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=8)
CAPSULES = st.builds(osc.LinkCapsule, NAMES, ENDS, ENDS, st.floats(1e-3, 1.0))


@settings(max_examples=40)
@given(shapes=st.lists(CAPSULES, min_size=1, max_size=4), why=st.text(max_size=20))
def test_what_is_written_is_read_and_encloses_what_it_did(tmp_path_factory, shapes, why):
    path = tmp_path_factory.mktemp("shapes") / "arm.yaml"
    frames = [shape.frame for shape in shapes]
    pairs = Pairs(((frames[0], frames[-1]),), {(frames[-1], frames[0]): why})
    write_shapes(path, "arm", 0.01, shapes, pairs)
    found = read_shapes(path)
    assert found.pairs == pairs
    for one, two in zip(shapes, found.shapes, strict=True):
        assert two.frame == one.frame
        away = max(
            np.linalg.norm(np.subtract(getattr(one, end), getattr(two, end)))
            for end in ("start", "end")
        )
        assert two.radius >= one.radius + away
        assert two.radius <= one.radius + 3e-6


ONE = "{frame: link3, start: [0, 0, 0], end: [0, 0, 0.1], radius: 0.05}"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [", "cannot be read"),
        ("shapes: []", "says 'format"),
        (f"format: {FORMAT}\nshapes: []", "no shape"),
        (f"format: {FORMAT}\nshape: [{ONE}]", "unknown 'shape'"),
        (f"format: {FORMAT}\nshapes: [{{frame: a}}]", "shape 1 must have"),
        (
            f"format: {FORMAT}\nshapes: [{ONE}]\npairs: [[link3, link9]]",
            "'link9', which has no shape",
        ),
        (f"format: {FORMAT}\nshapes: [{ONE.replace('0.05', '.nan')}]", "radius must be a finite"),
        (f"format: {FORMAT}\nshapes: [{ONE.replace('0.05', '0')}]", "above 0"),
        (f"format: {FORMAT}\nshapes: [{ONE.replace('[0, 0, 0]', '[0, 0]')}]", "three numbers"),
    ],
)
def test_a_wrong_file_is_refused_by_its_entry(tmp_path, text, words):
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    with pytest.raises(osc.ModelError, match=words):
        osc.CollisionAvoidance(shapes=path)


def test_a_guard_takes_shapes_and_pairs_of_a_file(tmp_path):
    path = tmp_path / "arm.yaml"
    shapes = [
        osc.LinkCapsule("link3", (0.0, 0.2, 0.15), (0.0, -0.05, 0.15), 0.07),
        osc.LinkCapsule("link6", (0.0, 0.0, 0.0), (0.0, 0.0, 0.08), 0.04),
    ]
    pairs = Pairs((("link3", "link6"),), {})
    write_shapes(path, "puma560", 0.01, shapes, pairs)
    guard = osc.CollisionAvoidance(shapes=str(path))
    guard.bind(osc.load_robot("puma560"))
    assert guard.chosen == pairs
    alone = osc.CollisionAvoidance(shapes=path, pairs="none")
    alone.bind(osc.load_robot("puma560"))
    assert alone.pairs == ()
    elsewhere = osc.CollisionAvoidance(shapes=path)
    with pytest.raises(osc.UnknownNameError, match="link3"):
        elsewhere.bind(osc.load_robot("ur5"))


SRDF = """<robot name="arm">
<disable_collisions link1="link1" link2="link5" reason="Never"/>
<disable_collisions link1="link6" link2="link2" reason="User"/>
</robot>"""


def test_an_srdf_file_leaves_out_what_it_disables(tmp_path):
    path = tmp_path / "arm.srdf"
    path.write_text(SRDF)
    shapes = [
        osc.LinkCapsule(f"link{i}", (0.0, 0.0, 0.0), (0.0, 0.0, 0.01), 0.02) for i in range(1, 7)
    ]
    guard = osc.CollisionAvoidance(shapes=shapes, pairs=path)
    guard.bind(osc.load_robot("puma560"))
    disabled = {pair for pair, why in guard.left_out.items() if why.startswith("disabled")}
    assert disabled == {("link1", "link5"), ("link2", "link6")}
    assert guard.left_out["link1", "link5"] == "disabled: Never"
    assert ("link1", "link4") in guard.pairs


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot", "cannot be read"),
        ("<mujoco/>", "begins with <robot>"),
        ("<robot/>", "disables no pair"),
        ('<robot><disable_collisions link1="a"/></robot>', "lacks link1 or link2"),
    ],
)
def test_a_wrong_srdf_file_is_refused(tmp_path, text, words):
    path = tmp_path / "arm.srdf"
    path.write_text(text)
    with pytest.raises(osc.ModelError, match=words):
        disabled_pairs(path)


def test_the_command_writes_what_a_guard_reads(tmp_path, capsys):
    path = tmp_path / "puma.yaml"
    code, said, _ = run(capsys, "shapes", "puma560", "--out", str(path))
    assert code == 0
    found = read_shapes(path)
    assert all(f"{one}/{two} " in said for one, two in (*found.pairs.kept, *found.pairs.left_out))
    osc.CollisionAvoidance(shapes=path).bind(osc.load_robot("puma560"))
    assert "kept apart" in said
    assert "in the reference posture" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["puma560", "ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1"]
)
def test_shapes_of_the_catalogue_make_sense(name):
    robot = osc.load_robot(name)
    guard = osc.CollisionAvoidance()
    guard.bind(robot)
    stack = osc.Stack([osc.PostureTask()])
    controller = osc.Controller(robot, stack, collisions=guard)
    command = controller.step(0.0, robot.q_reference, np.zeros(robot.nv))
    assert len({shape.frame for shape in guard.shapes}) >= 6
    assert len(guard.pairs) >= 5
    assert all(0.002 < shape.radius < 0.25 for shape in guard.shapes)
    nearest = next(iter(command.distances.values()))
    assert nearest.distance >= guard.margin
    assert osc.Status.COLLISION not in command.status
    often = {pair for pair, why in guard.left_out.items() if why.startswith("within")}
    assert often == ({("forearm_link", "wrist_2_link")} if name.startswith("ur") else set()) | (
        {("base_link", "upper_arm_link")} if name == "ur3" else set()
    )
