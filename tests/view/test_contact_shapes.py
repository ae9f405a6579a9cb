"""What the page draws of contacts: arrows as long as forces, cones as wide as friction, hulls."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from opspace.robots import load_robot
from opspace.view import panels
from opspace.view.contact_shapes import (
    LONGEST,
    ContactPlace,
    arrow,
    cone,
    outline,
    place_of,
    plumb,
    pressure_point,
    support,
)
from opspace.view.frame import ContactFrame, Frame

NONE = np.zeros(0)
POINTS = arrays(float, st.tuples(st.integers(1, 12), st.just(2)), elements=st.integers(-9, 9))


def contact(name="foot", progress=1.0, cop=(0.0, 0.0)):
    force = np.array([1.0, 2.0, 300.0])
    nothing = np.full(3, np.nan)
    return ContactFrame(name, progress, progress, force, nothing, np.array(cop), 0.5)


def lying(corners, height=0.0):
    points = np.column_stack([corners, np.full(len(corners), height)])
    return ContactPlace(points[0], np.eye(3), points)


@given(POINTS)
def test_a_support_polygon_is_convex_and_holds_every_corner(points):
    hull = support([lying(points)])[:, :2]
    assert len(hull) >= 1
    assert {tuple(p) for p in hull} <= {tuple(p) for p in points}
    for a, b in zip(hull, np.roll(hull, -1, axis=0), strict=True):
        side = (b[0] - a[0]) * (points[:, 1] - a[1]) - (b[1] - a[1]) * (points[:, 0] - a[0])
        assert np.all(side >= 0.0)


def test_walls_do_not_carry_the_weight():
    wall = ContactPlace(
        np.zeros(3), np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]), np.zeros((1, 3))
    )
    assert len(support([wall])) == 0
    assert len(support([])) == 0
    assert len(outline(np.zeros((1, 3)))) == 0
    assert support([wall, lying(np.array([[0, 0], [1, 0], [0, 1.0]]), 0.5)])[0, 2] > 0.5


@given(arrays(float, 3, elements=st.floats(-500.0, 500.0)))
def test_an_arrow_is_as_long_as_its_force(force):
    drawn = arrow(np.ones(3), force, 300.0)
    size = np.linalg.norm(force)
    if size <= 0.3:
        assert len(drawn) == 0
        return
    assert np.allclose(drawn[0, 0], 1.0)
    assert np.allclose(drawn[0, 1] - drawn[0, 0], LONGEST * force / 300.0)
    assert np.isfinite(drawn).all()


def test_nothing_is_drawn_of_forces_that_are_not_known():
    assert len(arrow(np.zeros(3), np.full(3, np.nan), 300.0)) == 0


def test_the_edges_of_a_cone_have_the_slope_of_friction():
    edges = cone(lying(np.zeros((1, 2))), 0.5)
    for start, end in edges[:4]:
        along = end - start
        assert np.allclose(np.abs(along[:2]), 0.5 * along[2])


@pytest.mark.parametrize(
    "about",
    [
        {"frame": "FL_foot", "offset": [0, 0, 0.1], "half": [0.1, 0.05], "normal": None},
        {"frame": "FL_foot", "offset": [0, 0, 0.1], "half": None, "normal": [-1.0, 0, 0]},
        {
            **{"frame": "FL_foot", "offset": [0, 0, 0.1], "half": [0.1, 0.0]},
            **{"normal": [0.0, 0.0, 1.0], "along": [0.0, 1.0, 0.0]},
        },
    ],
)
def test_a_contact_is_drawn_where_it_is(about):
    robot = load_robot("go2")
    robot.update(robot.q_reference, np.zeros(robot.nv))
    place, foot = place_of(about, robot), robot.frame_id("FL_foot")
    point = robot.position(foot) + robot.rotation(foot) @ about["offset"]
    assert np.allclose(place.point, point)
    assert np.allclose(place.axes.T @ place.axes, np.eye(3))
    assert np.allclose(place.corners.mean(axis=0), point)
    if about["normal"] is not None:
        assert np.allclose(place.axes[:, 2], about["normal"])
    pressed = pressure_point(place, contact(cop=(0.01, 0.02)))
    assert np.allclose(place.axes.T @ (pressed - point), [0.01, 0.02, 0.0])


def test_the_centre_of_mass_is_above_its_mark():
    lines = plumb(np.array([0.1, 0.2, 0.7]), 0.05)
    assert np.allclose(lines[0, 1, :2], [0.1, 0.2])
    assert lines[0, 1, 2] == pytest.approx(0.053)


def test_a_panel_tells_contacts_and_escapes_their_names():
    touching = (contact("a<b"), contact("gone", np.nan))
    shown = Frame(0.0, NONE, NONE, NONE, (), (), {}, 0, contacts=touching)
    text = panels.contacts(shown)
    assert "a&lt;b" in text
    assert "300 N" in text
    assert "50%" in text
    assert panels.contacts(Frame(0.0, NONE, NONE, NONE, (), (), {}, 0)) == ""
