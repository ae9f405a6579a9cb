import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.law.convex import Bodies, Points, box_distance, distance_rows
from opspace.law.scalars import ROUNDED, allowed_speed, closing_command, last_closing_command
from opspace.tasks import CollisionAvoidance

coal = pytest.importorskip("coal")
KINDS = ("ball", "capsule", "box", "half-space")


def extent(kind, rng):
    half = rng.uniform(0.02, 0.5, 3)
    if kind == "ball":
        half = np.zeros(3)
    elif kind == "capsule":
        half[:2] = 0.0
    elif kind == "half-space":
        return np.full(3, -np.inf), np.array([np.inf, np.inf, 0.0])
    return -half, half


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def turned(R, w, t):
    """R after turning at w for t, by Rodrigues' formula."""
    angle = np.linalg.norm(w) * t
    if angle == 0.0:
        return R
    k = w / np.linalg.norm(w)
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return (np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K) @ R


def check_rate_and_bound(kind, seed):
    """Move a point and a body along known curves, and differentiate their distance."""
    rng = np.random.default_rng(seed)
    lower, upper = extent(kind, rng)
    R, o = rotation(rng), rng.normal(size=3)
    p, v, a = rng.normal(size=(3, 3))
    V, A, w = rng.normal(size=(3, 3))
    rho = distance_of(R, o, p, lower, upper)
    if rho < 0.05:
        return False
    row = distance_rows(
        Points(p[None], v[None], a[None], np.zeros((1, 3, 0))),
        Bodies(R[None], o[None], np.r_[V, w][None], np.r_[A, 0, 0, 0][None], np.zeros((1, 6, 0))),
        lower[None],
        upper[None],
    )

    def at(t):
        where = p + v * t + 0.5 * a * t * t
        return distance_of(turned(R, w, t), o + V * t + 0.5 * A * t * t, where, lower, upper)

    h = 2e-4
    before, after = at(-h), at(h)
    scale = 1.0 + abs(row.drift[0])
    assert row.distance[0] == pytest.approx(rho, abs=1e-12)
    # Where the nearest point passes an edge the second derivative jumps, by v²/ρ at most.
    jump = np.sum((v - V - np.cross(w, p - o)) ** 2) / rho
    assert row.rate[0] == pytest.approx((after - before) / (2 * h), abs=2e-5 * scale + h * jump)
    second = (after - 2 * rho + before) / h**2
    slack = 1e-4 * (1.0 + abs(second) + scale)
    assert second >= row.drift[0] - slack
    _, local = box_distance((R.T @ (p - o))[None], lower[None], upper[None])
    beside = np.abs(local[0, 2])
    if kind in ("ball", "half-space") or (kind == "capsule" and beside > 0.01 + ROUNDED):
        assert second == pytest.approx(row.drift[0], abs=2e-3 * scale)
    # What each of two has of it, with the motion of the nearest point counted on the other side.
    n = R @ local[0]
    arm = p - rho * n - o
    v_P, a_P = V + np.cross(w, arm), A + np.cross(w, np.cross(w, arm))
    assert row.own_rate[0] - n @ v_P == pytest.approx(row.rate[0], abs=1e-9 * scale)
    assert second >= row.own_drift[0] - n @ a_P - slack
    return True


def distance_of(R, o, p, lower, upper):
    found, _ = box_distance((R.T @ (p - o))[None], lower[None], upper[None])
    return float(found[0])


@settings(max_examples=80, deadline=None)
@given(kind=st.sampled_from(KINDS), seed=st.integers(0, 2**32 - 1))
def test_the_bound_on_the_second_derivative_is_never_broken(kind, seed):
    check_rate_and_bound(kind, seed)


@pytest.mark.slow
def test_the_bound_holds_on_fifty_thousand_random_rows():
    checked = sum(check_rate_and_bound(KINDS[k % 4], k) for k in range(70_000))
    assert checked >= 50_000


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_jacobian_gives_the_rate(seed):
    rng = np.random.default_rng(seed)
    lower, upper = extent(KINDS[seed % 4], rng)
    n, k = 5, 3
    J, JB = rng.normal(size=(k, 3, n)), rng.normal(size=(k, 6, n))
    qd = rng.normal(size=n)
    still = np.zeros((k, 6))
    points = Points(rng.normal(size=(k, 3)), J @ qd, np.zeros((k, 3)), J)
    R = np.array([rotation(rng) for _ in range(k)])
    bodies = Bodies(R, rng.normal(size=(k, 3)), JB @ qd, still, JB)
    row = distance_rows(points, bodies, np.tile(lower, (k, 1)), np.tile(upper, (k, 1)))
    assert row.G @ qd == pytest.approx(row.rate, abs=1e-12)


@pytest.mark.parametrize("kind", ["ball", "capsule", "box"])
def test_distances_are_those_of_coal(kind):
    rng = np.random.default_rng(1)
    for _ in range(200):
        lower, upper = extent(kind, rng)
        grown = 0.0 if kind == "box" else rng.uniform(0.02, 0.2)
        radius = rng.uniform(0.02, 0.1)
        R, o, p = rotation(rng), rng.normal(size=3), rng.normal(size=3)
        ours = distance_of(R, o, p, lower, upper) - grown - radius
        if ours < 1e-3:
            continue
        theirs = {
            "ball": lambda: coal.Sphere(grown),  # noqa: B023
            "capsule": lambda: coal.Capsule(grown, 2.0 * upper[2]),  # noqa: B023
            "box": lambda: coal.Box(*(2.0 * upper)),  # noqa: B023
        }[kind]()
        found = coal.DistanceResult()
        coal.distance(
            theirs, coal.Transform3s(R, o), coal.Sphere(radius), coal.Transform3s(np.eye(3), p),
            coal.DistanceRequest(), found,
        )  # fmt: skip
        assert ours == pytest.approx(found.min_distance, abs=1e-9)


def test_inside_a_box_the_distance_is_that_to_the_nearest_face():
    lower, upper = np.array([[-1.0, -2.0, -3.0]]), np.array([[1.0, 2.0, 3.0]])
    found, normal = box_distance(np.array([[0.2, -1.9, 0.0]]), lower, upper)
    assert found[0] == pytest.approx(-0.1)
    assert normal[0].tolist() == [0.0, -1.0, 0.0]


def test_on_the_axis_of_a_capsule_there_is_still_a_direction():
    end = np.array([[0.0, 0.0, 0.1]])
    found, normal = box_distance(np.zeros((1, 3)), -end, end)
    assert found[0] == 0.0
    assert np.linalg.norm(normal[0]) == 1.0


BRAKE, K1, K2 = 4.0, CollisionAvoidance.k1, CollisionAvoidance.k2
SPEEDS = st.floats(0.0, 1.0)


@given(d=st.floats(0.0, 2.0), share=st.floats(0.05, 0.95), theirs=SPEEDS)
def test_who_stands_need_not_give_way_to_one_that_keeps_to_its_share(d, share, theirs):
    allowed, _ = allowed_speed(d, BRAKE, K1)
    towards = theirs * (1.0 - share) * allowed
    assert closing_command(d, towards, 0.0, share, BRAKE, K1, K2) >= -1e-12


@given(d=st.floats(0.0, 2.0), share=st.floats(0.05, 0.95), mine=SPEEDS, theirs=SPEEDS)
def test_two_that_share_close_no_faster_than_one_alone_would(d, share, mine, theirs):
    allowed, _ = allowed_speed(d, BRAKE, K1)
    one, two = mine * share * allowed, theirs * (1.0 - share) * allowed
    command = lambda own, part: closing_command(d, one + two, own, part, BRAKE, K1, K2)  # noqa: E731
    assert command(one, share) + command(two, 1.0 - share) <= command(one + two, 1.0) + 1e-9


@given(d=st.floats(0.0, 2.0), part=SPEEDS, period=st.floats(1e-4, 0.015))
def test_a_distance_that_is_not_lost_goes_on_closing_no_faster_than_it_may(d, part, period):
    towards = part * allowed_speed(d, BRAKE, K1)[0]
    command = closing_command(d, towards, towards, 1.0, BRAKE, K1, K2)
    last = last_closing_command(d, towards, towards, 1.0, BRAKE, K1, command)
    assert last >= command - 1e-12 * abs(command)
    later = towards + last * period
    assert later <= allowed_speed(d - later * period, BRAKE, K1)[0] + 1e-9


@given(d=st.floats(-0.1, 2.0), more=st.floats(0.0, 1.0))
def test_what_closes_too_fast_is_lost_where_it_does_not_slow_down(d, more):
    towards = allowed_speed(d, BRAKE, K1)[0] + more
    command = closing_command(d, towards, towards, 1.0, BRAKE, K1, K2)
    assert last_closing_command(d, towards, towards, 1.0, BRAKE, K1, command) == command
