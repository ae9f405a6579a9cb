"""Contacts: the law stays, forces fade without a step, and what is projected obeys every limit."""

from itertools import product

import daqp
import numpy as np
import pytest
from scipy.optimize import nnls

from opspace.law import TaskSet, corners, task_torque
from opspace.law.cones import (
    edge_cone,
    edge_metric,
    point_cone,
    point_metric,
    sole_cone,
    sole_metric,
)
from opspace.law.contact_forces import NEARNESS, ForceSet, Room, Wish, free_motions, realise, share

BASE = 6
HALF, MU = (0.1, 0.05), 0.5
NONE = np.inf


def no_distances(n):
    """Combinations of accelerations that are bounded, their bounds and softness: none."""
    return np.zeros((0, n)), np.zeros(0), np.zeros(0)


class Body:
    """A random floating body with joints and soles, somewhere in the air or pressed to the ground."""

    def __init__(self, seed, soles=3, joints=18):
        rng = self.rng = np.random.default_rng(seed)
        self.n = n = BASE + joints
        B = rng.normal(size=(n, n))
        self.M = B @ B.T / n + np.diag([5.0] * BASE + [0.1] * joints)
        self.L = np.linalg.cholesky(self.M)
        self.bias = rng.normal(0.0, 20.0, n)
        self.J = [
            np.hstack([self._lever(rng), rng.normal(0, 0.4, (6, joints))]) for _ in range(soles)
        ]
        self.gamma = [rng.normal(0.0, 1.0, 6) for _ in range(soles)]

    @staticmethod
    def _lever(rng):
        x, y, z = rng.normal(0.0, 0.4, 3)
        cross = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        return np.block([[np.eye(3), cross], [np.zeros((3, 3)), np.eye(3)]])

    def sets(self, activations, most=1e5):
        return [
            ForceSet(J, sole_cone(HALF, MU), sole_metric(HALF, MU), h, most, np.zeros(6))
            for J, h in zip(self.J, activations, strict=True)
        ]

    def tasks(self):
        rng = self.rng
        J = rng.normal(size=(3, self.n)), np.eye(self.n)
        return [TaskSet(J[0], rng.normal(size=3), 0), TaskSet(J[1], rng.normal(size=self.n), 1)]

    def wanted(self, closed=None):
        """q̈* of the law with the contacts on top, and its tasks."""
        tasks = self.tasks()
        closed = range(len(self.J)) if closed is None else closed
        top = [TaskSet(self.J[c], self.gamma[c], -2) for c in closed]
        return np.linalg.solve(self.M, task_torque(self.M, [*top, *tasks])), tasks

    def metric(self, tasks):
        W = np.eye(self.n)
        for weight, task in zip((100.0, 10.0), tasks, strict=True):
            J = np.linalg.solve(self.L, task.J.T).T
            W += weight * J.T @ J
        return W

    def plant(self, tau, closed):
        """q̈ and λ of the body itself, whose closed contacts move as they were told to."""
        J = np.concatenate([np.zeros((0, self.n)), *(self.J[c] for c in closed)])
        gamma = np.concatenate([np.zeros(0), *(self.gamma[c] for c in closed)])
        m = gamma.size
        K = np.block([[self.M, -J.T], [J, np.zeros((m, m))]])
        x = np.linalg.solve(K, np.concatenate([tau - self.bias, gamma]))
        return x[: self.n], np.split(x[self.n :], len(closed)) if closed else []

    def carried(self, qdd, activations, blending="idv"):
        """λ* and the torque that it takes."""
        sets = self.sets(activations)
        wrench = (self.M @ qdd + self.bias)[:BASE]
        forces = share(sets, wrench, corners(activations, blending))
        tau = self.M @ qdd + self.bias - sum(J.T @ f for J, f in zip(self.J, forces, strict=True))
        return forces, tau

    def unlimited(self):
        none = np.full(self.n, NONE)
        return Room(-none, none, none, *no_distances(self.n))


@pytest.mark.parametrize("seed", range(5))
def test_what_keeps_every_limit_is_the_answer_to_the_last_bit(seed):
    body = Body(seed)
    qdd, tasks = body.wanted()
    sets = [one._replace(cone=np.zeros((0, 6)), most=NONE) for one in body.sets([1.0] * 3)]
    forces, tau = body.carried(qdd, [1.0] * 3)
    Z = free_motions(np.concatenate(body.J), body.L)
    wish = Wish(body.L, body.bias, qdd, forces, body.metric(tasks), Z, BASE)
    found = realise(wish, sets, body.unlimited())
    assert not found.projected
    assert np.array_equal(found.acceleration, qdd)
    assert all(np.array_equal(a, b) for a, b in zip(found.forces, forces, strict=True))
    size = 1.0 + np.max(np.abs(tau))
    assert np.max(np.abs(found.tau - tau)) < 1e-9 * size
    assert np.all(found.tau[:BASE] == 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_the_torque_of_park_and_khatib_moves_the_body_the_same_way(seed):
    """Whatever generalised inverse divides the forces: the stack leaves no motion open."""
    body = Body(seed)
    qdd, _ = body.wanted()
    J = np.concatenate(body.J)
    S = np.eye(body.n)[BASE:]
    N = np.eye(body.n) - np.linalg.pinv(J) @ J  # torques that no contact force could answer
    rhs = N.T @ (body.M @ qdd + body.bias)
    tau = S.T @ np.linalg.lstsq(N.T @ S.T, rhs, rcond=1e-10)[0]
    assert np.max(np.abs(body.plant(tau, range(3))[0] - qdd)) < 1e-9 * (1.0 + np.max(np.abs(qdd)))


@pytest.mark.parametrize("seed", range(40))
def test_a_closed_contact_without_force_can_open(seed):
    body = Body(seed)
    qdd, _ = body.wanted()
    size = 1.0 + np.max(np.abs(qdd))
    before = None
    for h in (1.0, 0.9, 0.5, 0.1, 1e-3, 1e-9, 0.0):
        forces, tau = body.carried(qdd, [1.0, 1.0, h])
        moved, felt = body.plant(tau, range(3))
        load = 1.0 + np.max(np.abs(forces[0]))
        assert np.max(np.abs(moved - qdd)) < 1e-9 * size * load
        for planned, real in zip(forces, felt, strict=True):
            assert np.max(np.abs(planned - real)) < 1e-9 * load * size
        full = forces[2] if before is None else before
        assert np.max(np.abs(forces[2] - h * full)) < 1e-9 * load
        before = full
    opened, _ = body.plant(tau, range(2))
    assert np.max(np.abs(opened - qdd)) < 1e-9 * size * load


@pytest.mark.parametrize("blending", ["idv", "chain"])
def test_the_blend_of_corners_that_obey_the_plant_obeys_it(blending):
    for seed in range(10):
        body = Body(seed)
        qdd, _ = body.wanted()
        h = body.rng.uniform(0.05, 1.0, 3).tolist()
        forces, tau = body.carried(qdd, h, blending)
        moved, felt = body.plant(tau, range(3))
        load = 1.0 + max(np.max(np.abs(f)) for f in forces)
        assert np.max(np.abs(moved - qdd)) < 1e-9 * load
        assert all(np.max(np.abs(a - b)) < 1e-9 * load for a, b in zip(forces, felt, strict=True))


def test_a_force_that_is_wanted_is_given_where_the_contact_is_stiff():
    body = Body(1)
    qdd, _ = body.wanted()
    wrench = (body.M @ qdd + body.bias)[:BASE]
    sets = body.sets([1.0, 1.0, 1.0])
    wanted = np.array([0.0, 0.0, 20.0, 0.0, 0.0, 0.0])
    gaps = []
    for stiff in (1.0, 30.0, 1e3, 1e5):
        sets[2] = sets[2]._replace(metric=stiff * sole_metric(HALF, MU), reference=wanted)
        forces = share(sets, wrench, corners([1.0] * 3, "idv"))
        assert np.max(
            np.abs(sum(J[:, :6].T @ f for J, f in zip(body.J, forces, strict=True)) - wrench)
        ) < 1e-9 * (1 + np.max(np.abs(wrench)))
        gaps.append(np.linalg.norm(forces[2] - wanted))
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] < 0.05 * gaps[0]


class Standing(Body):
    """A body that is pressed to the ground about as strongly as it can bear; cones act at random."""

    def __init__(self, seed, activations=(1.0, 1.0, 0.6)):
        super().__init__(seed)
        self.h = activations
        carried = [
            np.array(
                [*self.rng.normal(0, 5, 2), self.rng.uniform(20, 60), *self.rng.normal(0, 2, 3)]
            )
            for _ in self.J
        ]
        self.bias = sum(J.T @ f for J, f in zip(self.J, carried, strict=True)) + self.rng.normal(
            0.0, 3.0, self.n
        )

    def wish(self, held=2):
        qdd, tasks = self.wanted(range(held))
        forces, _ = self.carried(qdd, self.h)
        Z = free_motions(np.concatenate(self.J[:held]), self.L)
        return Wish(self.L, self.bias, qdd, forces, self.metric(tasks), Z, BASE)

    def room(self, tight=True):
        n = self.n
        a = self.rng.uniform(5.0, 30.0, n) if tight else np.full(n, NONE)
        a[:BASE] = NONE
        torque = self.rng.uniform(20.0, 60.0, n) if tight else np.full(n, NONE)
        return Room(-a, a, torque, *no_distances(n))


def oracle(wish, sets, room):
    """The same by daqp: accelerations and forces as they are, equations as equalities."""
    n, held = wish.bias.size, wish.free
    M = wish.L @ wish.L.T
    J = np.concatenate([one.J for one in sets])
    lam = np.concatenate(wish.forces)
    E = (wish.L @ held)[:BASE]
    A = E @ np.linalg.solve(held.T @ wish.W @ held, E.T)
    trace = sum(
        s.activation * np.trace(s.J[:, :BASE] @ np.linalg.solve(A, s.J[:, :BASE].T)) for s in sets
    )
    R = np.concatenate([s.metric for s in sets])
    e = NEARNESS * trace / sum(s.activation * s.metric.sum() for s in sets)
    # x = (y, d): q̈ = q̈* + L⁻ᵀ Z y, λ = λ* + d
    r, m = held.shape[1], lam.size
    H = np.zeros((r + m, r + m))
    H[:r, :r] = held.T @ wish.W @ held
    H[r:, r:] = e * np.diag(R)
    move = np.linalg.solve(wish.L.T, held)
    torque = np.hstack([M @ move, -J.T])
    tau = M @ wish.acceleration + wish.bias - J.T @ lam
    rows, upper, lower, sense = [torque[:BASE]], [-tau[:BASE]], [-tau[:BASE]], [5] * BASE
    column = 0
    for one in sets:
        C, b = one.rows()
        k = one.metric.size
        full = np.zeros((C.shape[0], r + m))
        full[:, r + column : r + column + k] = C
        rows.append(full)
        upper.append(b - C @ lam[column : column + k])
        lower.append(np.full(C.shape[0], -1e30))
        sense += [0] * C.shape[0]
        column += k
    there = room.upper < 1e20
    rows.append(np.hstack([move, np.zeros((n, m))])[there])
    upper.append((room.upper - wish.acceleration)[there])
    lower.append((room.lower - wish.acceleration)[there])
    driven = (np.arange(n) >= BASE) & (room.torque < 1e20)
    rows.append(torque[driven])
    upper.append((room.torque - tau)[driven])
    lower.append((-room.torque - tau)[driven])
    sense += [0] * (int(there.sum()) + int(driven.sum()))
    x, _, flag, _ = daqp.solve(
        H,
        np.zeros(r + m),
        np.concatenate(rows),
        np.concatenate(upper),
        np.concatenate(lower),
        np.array(sense, dtype=np.int32),
    )
    return flag, tau + torque @ x


@pytest.mark.parametrize("tight", [False, True])
def test_equations_cones_and_limits_are_kept_by_the_nearest_answer(tight):
    compared = 0
    for seed in range(40):
        body = Standing(seed)
        wish, room = body.wish(), body.room(tight)
        sets = body.sets(body.h, most=200.0)
        found = realise(wish, sets, room)
        tau = body.M @ found.acceleration + body.bias
        for one, force in zip(sets, found.forces, strict=True):
            C, b = one.rows()
            assert np.max(C @ force - b) < 1e-5
            tau = tau - one.J.T @ force
        size = 1.0 + np.max(np.abs(tau))
        assert np.max(np.abs(tau[:BASE])) < 1e-9 * size
        held = np.concatenate(body.J[:2])
        asked = held @ wish.acceleration
        assert np.max(np.abs(held @ found.acceleration - asked)) < 1e-9 * (
            1 + np.max(np.abs(asked))
        )
        flag, expected = oracle(wish, sets, room)
        if flag == 1:
            compared += 1
            assert np.max(np.abs(found.tau - expected)) < 1e-4
            assert np.max(np.abs(found.tau[BASE:] - tau[BASE:])) < 1e-4  # what is clipped
        assert np.all(np.abs(found.tau) <= room.torque)
    assert compared >= (30 if not tight else 5)


def test_a_contact_fades_through_the_projection_without_a_step():
    for seed in range(10):
        body = Standing(seed)
        taus = []
        for h in (1e-7, 0.0):
            body.h = (1.0, 1.0, h)
            body.rng = np.random.default_rng(seed + 100)
            taus.append(realise(body.wish(), body.sets(body.h, 200.0), body.room(False)).tau)
        assert np.max(np.abs(taus[1] - taus[0])) < 1e-4


class Loop(Standing):
    """A body whose state, commands and contacts go once around a smooth loop, limits acting."""

    def __init__(self, seed):
        super().__init__(seed)
        rng = self.rng
        self.wanted_of_tasks, self.rest = super().tasks(), (self.M, self.bias, self.J)
        self.heavier = np.diag(rng.uniform(0.0, 0.1, self.n))
        self.pulls = rng.normal(0.0, 12.0, (2, self.n))
        self.turns = rng.normal(0.0, 0.02, (2, 6, self.n))
        self.limits = self.room()

    def tasks(self):
        return self.wanted_of_tasks

    def at(self, phase):
        """What is realised at a place of the loop."""
        M, bias, J = self.rest
        way = np.array([np.cos(phase), np.sin(phase)])
        self.M = M + (1.0 + way[0]) * self.heavier
        self.L = np.linalg.cholesky(self.M)
        self.bias = bias + way @ self.pulls
        self.J = [one + np.tensordot(way, self.turns, 1) for one in J]
        self.h = (1.0, 1.0, 0.5 - 0.5 * way[0])
        return realise(self.wish(), self.sets(self.h, 200.0), self.limits)

    def steps(self, phases):
        """Largest step of a torque from each of these places to the next; where something gave way."""
        found = [self.at(phase) for phase in phases]
        steps = np.max(np.abs(np.diff([one.tau for one in found], axis=0)), axis=1)
        return steps, np.array([one.projected for one in found])

    def steepest(self, start, end):
        """Ends and step of the steepest quarter of a stretch."""
        phases = np.linspace(start, end, 5)
        steps, _ = self.steps(phases)
        k = int(np.argmax(steps))
        return phases[k], phases[k + 1], steps[k]


@pytest.mark.parametrize(
    ("seed", "points"),
    [(0, 100), *(pytest.param(seed, 1500, marks=pytest.mark.slow) for seed in range(8))],
)
def test_a_quarter_of_the_way_makes_a_quarter_of_the_step_wherever_it_is_steep(seed, points):
    """It jumps nowhere: a contact comes and goes on the loop, and limits act, mostly or always.

    The first two cuts find the steepest part of a stretch, which may be shorter than the stretch.
    """
    loop = Loop(seed)
    phases = np.linspace(0.0, 2.0 * np.pi, points + 1)
    steps, limited = loop.steps(phases)
    assert np.mean(limited) > 0.7
    for k in np.argsort(steps)[-10:]:
        start, end, step = loop.steepest(phases[k], phases[k + 1])
        start, end, step = loop.steepest(start, end)
        for _ in range(3):
            start, end, finer = loop.steepest(start, end)
            assert 3.5 <= step / finer <= 4.5
            step = finer


def test_in_flight_the_base_falls_and_the_joints_do_what_they_can():
    body = Body(3)
    qdd, tasks = body.wanted(())
    wish = Wish(body.L, body.bias, qdd, [], body.metric(tasks), np.eye(body.n), BASE)
    found = realise(wish, [], body.unlimited())
    assert np.max(np.abs((body.M @ found.acceleration + body.bias)[:BASE])) < 1e-9
    assert found.projected


def test_the_cone_of_a_sole_is_what_four_corners_carry():
    X, Y = HALF
    corners = [(x, y, 0.0) for x, y in product((X, -X), (Y, -Y))]
    inside = carried_alike(sole_cone(HALF, MU), corners, range(6), sole_metric(HALF, MU))
    assert 300 < inside < 1200


def carried_alike(cone, corners, held, metric):
    """Of 1500 wrenches, count those inside: exactly those to which forces at the corners add up."""
    rng = np.random.default_rng(0)
    edges = np.array([(a * MU, b * MU, 1.0) for a, b in product((1, -1), repeat=2)])
    G = np.array([np.concatenate([f, np.cross(at, f)]) for at in corners for f in edges]).T
    size = metric**-0.5 * (np.arange(metric.size) != 2)
    inside = 0
    for _ in range(1500):
        part = rng.normal(size=metric.size) * size * rng.uniform(0.2, 0.9)
        part[2] = 1.0
        w = np.zeros(6)
        w[list(held)] = part
        gap = nnls(G, w)[1]
        margin = np.max(cone @ part)
        if abs(margin) < 1e-9:
            continue
        inside += margin < 0.0
        assert (margin < 0.0) == (gap < 1e-9)
    return inside


def test_the_cone_of_an_edge_is_what_both_ends_carry():
    X = HALF[0]
    ends = [(X, 0.0, 0.0), (-X, 0.0, 0.0)]
    inside = carried_alike(edge_cone(X, MU), ends, (0, 1, 2, 4, 5), edge_metric(X, MU))
    assert 300 < inside < 1200


def test_the_cone_of_an_edge_is_that_of_a_sole_without_width():
    rng = np.random.default_rng(1)
    C, flat = edge_cone(0.1, MU), sole_cone((0.1, 0.0), MU)
    for part in rng.normal(size=(300, 5)) * (0.3, 0.3, 0.3, 0.05, 0.03) + (0, 0, 1.0, 0, 0):
        w = np.zeros(6)
        w[[0, 1, 2, 4, 5]] = part
        # A row of the one that is another scaled, or the sum of two, says nothing new.
        assert (np.max(C @ part) <= 0.0) == (np.max(flat @ w) <= 1e-12)


def test_a_point_carries_what_its_pyramid_allows():
    C = point_cone(0.5)
    assert np.max(C @ (0.49, -0.49, 1.0)) < 0.0
    assert np.max(C @ (0.51, 0.0, 1.0)) > 0.0
    assert np.allclose(point_metric(0.5), (4.0, 4.0, 1.0))
