"""A strict hierarchy of programs: every level optimal, nothing taken from those above, limits kept."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls
from tests.budget import examples

from opspace.command import Status
from opspace.compare import METHODS, strict_program
from opspace.compare.methods import methods_left_out
from opspace.compare.strict_program import (
    Decided,
    Rows,
    StrictProgramController,
    give_way,
    level_below,
)
from opspace.controller import ReferenceController
from opspace.errors import MissingExtraError, ScenarioError
from opspace.robots.motor_range import motor_range
from opspace.scenario import load_scenario
from opspace.scenario.build import build

N = 9


class Ladder:
    """Three levels that contradict each other, between rows that cut most of what they want."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        repeated = rng.normal(size=(2, N))
        self.levels = [
            (rng.normal(size=(3, N)), 3.0 * rng.normal(size=3)),
            (np.concatenate([repeated, repeated[:1]]), 3.0 * rng.normal(size=3)),
            (np.eye(N), 3.0 * rng.normal(size=N)),
        ]
        C = rng.normal(size=(30, N))
        self.kept = Rows(C, rng.uniform(0.0, 0.5, 30) * np.linalg.norm(C, axis=1))

    def solved(self, levels=None):
        """What is decided after each level."""
        found = [Decided(np.zeros(N), np.eye(N))]
        for A, b in self.levels if levels is None else levels:
            found.append(level_below(found[-1], A, b, self.kept))
        return found


@examples(60)
@given(st.integers(0, 2**32 - 1))
def test_every_level_is_optimal_among_what_the_levels_above_leave(seed):
    """Its conditions, without a solver: the gradient is a sum of rows that act, pushing inwards."""
    ladder = Ladder(seed)
    for (A, b), above, here in zip(
        ladder.levels, ladder.solved(), ladder.solved()[1:], strict=False
    ):
        gap = ladder.kept.d - ladder.kept.C @ here.z
        assert np.min(gap) > -1e-8
        acting = ladder.kept.C[gap < 1e-7] @ above.free
        gradient = above.free.T @ A.T @ (A @ here.z - b)
        left = nnls(acting.T, -gradient)[1] if len(acting) else np.linalg.norm(gradient)
        assert left < 1e-5 * (1.0 + np.linalg.norm(b))


@examples(60)
@given(st.integers(0, 2**32 - 1))
def test_a_level_takes_nothing_from_those_above(seed):
    ladder = Ladder(seed)
    found = ladder.solved()[1:]
    for i, (A, _) in enumerate(ladder.levels):
        for later in found[i:]:
            np.testing.assert_allclose(A @ later.z, A @ found[i].z, atol=1e-8)


def test_limits_do_act_in_what_is_tested_above():
    cut = 0
    for seed in range(20):
        ladder = Ladder(seed)
        (A, b), found = ladder.levels[0], ladder.solved()[1]
        cut += np.linalg.norm(A @ found.z - b) > 1e-3
    assert cut >= 15


def test_a_weight_does_not_fade_a_level():
    """What leaves by its weight leaves from one tick to the next."""
    ladder = Ladder(3)
    (A, b), *below = ladder.levels
    full, faint = (ladder.solved([(h * A, h * b), *below])[-1].z for h in (1.0, 1e-3))
    gone = ladder.solved(below)[-1].z
    np.testing.assert_allclose(faint, full, atol=1e-5)
    assert np.linalg.norm(gone - full) > 0.1


def test_bounds_that_contradict_each_other_share_the_least_excess():
    along = np.eye(1, N)
    start = Decided(np.full(N, 5.0), np.eye(N))
    never = Rows(np.zeros((0, N)), np.zeros(0))
    found, bounds = give_way(
        start, never, Rows(np.concatenate([along, -along]), np.array([0.0, -1.0]))
    )
    assert found.z[0] == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_allclose(bounds.d, [0.5, -0.5], atol=1e-6)
    ceiling = Rows(along, np.array([6.0]))
    inside, same = give_way(start, never, ceiling)
    assert inside is start
    assert same is ceiling


@pytest.fixture(scope="module")
def standing():
    """The same G1 under the library's law and under the programs, with a state to begin from."""
    scenario = load_scenario("humanoid", ["method=switch"])
    ours, strict = (
        build(scenario, kind) for kind in (ReferenceController, StrictProgramController)
    )
    return ours, strict


def commands(standing, scale, seeds):
    """Both commands at states near the first, as far away as ``scale`` says, rad/s and rad."""
    ours, strict = standing
    for seed in seeds:
        rng = np.random.default_rng(seed)
        q, v = ours.plant.q.copy(), ours.plant.v.copy()
        q[7:] += 0.1 * scale * rng.normal(size=q.size - 7)
        v[6:] += scale * rng.normal(size=v.size - 6)
        yield tuple(one.controller.step(0.0, q, v) for one in (ours, strict))


def test_it_is_the_law_where_nothing_limits_it(standing):
    compared = 0
    for ours, strict in commands(standing, 0.02, range(6)):
        assert Status.FAULT not in strict.status
        if Status.FILTERED in ours.status:
            continue
        compared += 1
        np.testing.assert_allclose(strict.tau, ours.tau, atol=2e-4)  # what daqp leaves
        for name, contact in ours.contacts.items():
            np.testing.assert_allclose(strict.contacts[name].force, contact.force, atol=1e-3)
    assert compared >= 4


def test_it_keeps_cones_and_motors_where_they_act(standing):
    limit = motor_range(standing[1].robot).limit
    acted = 0
    for ours, strict in commands(standing, 1.0, range(6)):
        assert Status.FAULT not in strict.status
        acted += Status.FILTERED in ours.status
        assert np.max(np.abs(strict.tau) - limit) <= 0.0
        assert all(contact.cone_use <= 1.0 + 1e-6 for contact in strict.contacts.values())
    assert acted >= 4


def test_who_cannot_run_it_is_told_why(monkeypatch):
    arm = load_scenario("showpiece")
    assert "hierarchy" in methods_left_out(arm)
    assert not {"hierarchy", "hierarchy-switch"} & set(methods_left_out(load_scenario("humanoid")))
    with pytest.raises(ScenarioError, match="bolted down"):
        build(arm, METHODS["hierarchy"].controller)
    monkeypatch.setattr(strict_program.importlib.util, "find_spec", lambda name: None)
    assert not METHODS["hierarchy"].installed()
    with pytest.raises(MissingExtraError, match=r"opspace\[compare\]"):
        build(load_scenario("humanoid"), METHODS["hierarchy"].controller)
