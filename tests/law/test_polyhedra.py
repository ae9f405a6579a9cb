"""Distances to convex meshes: both forms, against Coal, and against boxes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.errors import InputError
from opspace.kernels.mesh_distance import from_mesh
from opspace.law.convex import box_distance
from opspace.law.polyhedra import mesh_distance
from opspace.tasks.hulls import hull_faces

SEEDS = st.integers(0, 2**32 - 1)


def random_hull(rng):
    return hull_faces(rng.normal(0.0, 0.3, (int(rng.integers(4, 25)), 3)), "points")


def compiled(point, faces, R=None, o=None):
    R, o = np.eye(3) if R is None else R, np.zeros(3) if o is None else o
    ball = np.zeros(9)
    ball[:3] = o + R @ point
    x = np.concatenate([R.T.reshape(9), o])
    rho, *n = from_mesh(x, faces.reshape(-1, 12), 0, len(faces), ball)
    return rho, R.T @ n


@given(seed=SEEDS, scale=st.sampled_from([0.1, 0.4, 2.0]))
def test_compiled_finds_the_same_point(seed, scale):
    rng = np.random.default_rng(seed)
    faces, p = random_hull(rng), scale * rng.normal(size=3)
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rho, n = mesh_distance(p, faces)
    ours, normal = compiled(p, faces, R * np.sign(np.linalg.det(R)), rng.normal(size=3))
    assert ours == pytest.approx(rho, abs=1e-12)
    if abs(rho) > 1e-6:
        assert normal == pytest.approx(n, abs=1e-8)


@given(seed=SEEDS)
@settings(max_examples=60)
def test_a_box_as_a_mesh_is_as_far_as_a_box(seed):
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.05, 0.5, 3)
    corners = half * (np.indices((2, 2, 2)).reshape(3, 8).T * 2.0 - 1.0)
    p = rng.normal(0.0, 0.5, 3)
    rho, n = mesh_distance(p, hull_faces(corners, "corners"))
    box, normal = box_distance(p[None], -half[None], half[None])
    assert rho == pytest.approx(box[0], abs=1e-12)
    assert n == pytest.approx(normal[0], abs=1e-9)


@given(seed=SEEDS)
@settings(max_examples=60)
def test_the_gradient_is_that_of_the_distance(seed):
    rng = np.random.default_rng(seed)
    faces, p, way = random_hull(rng), rng.normal(0.0, 0.8, 3), rng.normal(size=3)
    rho, n = mesh_distance(p, faces)
    if rho < 0.02:
        return
    h = 1e-5
    ahead, behind = (mesh_distance(p + s * h * way, faces)[0] for s in (1.0, -1.0))
    # The second derivative is at most |way|²/ρ.
    assert (ahead - behind) / (2 * h) == pytest.approx(n @ way, abs=h * (way @ way) / rho + 1e-9)


def test_distances_are_those_of_coal():
    coal = pytest.importorskip("coal")
    rng = np.random.default_rng(1)
    for _ in range(200):
        points, p = rng.normal(0.0, 0.3, (12, 3)), rng.normal(size=3)
        radius = rng.uniform(0.02, 0.1)
        ours = mesh_distance(p, hull_faces(points, "points"))[0] - radius
        if ours < 1e-3:
            continue
        given_points = coal.StdVec_Vec3s()
        given_points.extend(list(points))
        hull = coal.Convex.convexHull(given_points, True, "Qt")
        found = coal.DistanceResult()
        coal.distance(
            hull, coal.Transform3s(), coal.Sphere(radius), coal.Transform3s(np.eye(3), p),
            coal.DistanceRequest(), found,
        )  # fmt: skip
        assert ours == pytest.approx(found.min_distance, abs=1e-9)


@pytest.mark.parametrize(
    "points", [np.zeros((3, 3)), np.eye(3, 2), np.c_[np.eye(4, 2), np.zeros(4)], [[np.nan] * 3] * 5]
)
def test_points_without_a_volume_are_refused(points):
    with pytest.raises(InputError, match="points"):
        hull_faces(np.asarray(points, float), "points")
