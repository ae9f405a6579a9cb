"""The default blending is exact for a few, cheap for many, and continuous from one to the other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import UnknownNameError
from opspace.law import Profile, corners
from opspace.law.scalars import REACH
from opspace.stack import Blending

levels = st.lists(st.floats(0.01, 0.99), min_size=1, max_size=8)


def value(blend, torques):
    return sum(w * torques[present] for w, present in blend)


class Torques(dict):
    """A hard torque of its own for every set of tasks."""

    def __missing__(self, present):
        seed = sum(1 << k for k in present)
        self[present] = np.random.default_rng(seed).normal(size=3)
        return self[present]


@given(values=levels)
def test_the_first_are_blended_exactly_and_more_cost_little(values):
    names = list(range(len(values)))
    blend = Blending("auto").corners(names, values)
    exact, chained = min(len(values), 3), max(len(values) - 3, 0)
    assert len(blend) <= 2**exact * (chained + 1)
    if not chained:
        assert blend == corners(values, "idv")
    if chained == 1:  # a chain of one is exact as well
        exact_ones = {present: w for w, present in corners(values, "idv")}
        assert {present: w for w, present in blend} == pytest.approx(exact_ones)
    assert sum(w for w, _ in blend) == pytest.approx(1.0)
    for k, h in enumerate(values):
        assert sum(w for w, present in blend if k in present) == pytest.approx(h)


@given(values=levels)
def test_the_names_are_the_limits(values):
    names = list(range(len(values)))
    assert Blending("idv").corners(names, values) == corners(values, "idv")
    chain = {p: w for w, p in Blending("chain").corners(names, values)}
    assert chain == pytest.approx({p: w for w, p in corners(values, "chain")})


def test_more_than_sixteen_are_never_refused():
    values = [0.5] * 16 + [0.25, 0.75]
    assert len(Blending("auto").corners(list(range(18)), values)) <= 8 * 16


@st.composite
def journeys(draw):
    """Activations in time: each rests at 0, rises or comes and goes, some at the same time."""
    return [
        (draw(st.floats(0.0, 0.5)), draw(st.floats(0.05, 0.4)), draw(st.booleans()))
        for _ in range(draw(st.integers(4, 7)))
    ]


def at(journey, t):
    start, duration, returns = journey
    s = np.clip((t - start) / duration, 0.0, 2.0 if returns else 1.0)
    return float(1.0 - abs(1.0 - s)) if returns else float(s)


@pytest.mark.parametrize(("name", "most"), [("auto", 1.0), ("smooth-chain", 1.0 + 4.0 * REACH)])
@given(journeys=journeys())
def test_steps_shrink_with_the_activations_whoever_changes_groups(name, most, journeys):
    """|Δ| <= Σ |Δh| · widest gap between any two hard torques, through every change of groups.

    Of the smooth chain the constant is larger by what leaning adds to the slope.
    """
    names, torques, blending = list(range(len(journeys))), Torques(), Blending(name)
    before = last = None
    for t in np.arange(0.0, 1.4, 0.01):
        values = [at(journey, t) for journey in journeys]
        now = value(blending.corners(names, values), torques)
        if before is not None:
            moved = sum(abs(a - b) for a, b in zip(values, last, strict=True))
            gap = max(np.ptp(list(torques.values()), axis=0))
            assert np.abs(now - before).max() <= most * moved * gap + 1e-12
        before, last = now, values


def test_choosing_the_groups_anew_at_every_tick_would_step():
    """Why an activation keeps its group while it moves: the two ways differ in between."""
    names, values, torques = list(range(5)), [0.5] * 5, Torques()
    one, other = Blending("auto"), Blending("auto")
    one.corners(names, [0.5, 0.5, 0.5, 0.0, 0.0])
    other.corners(names, [0.0, 0.0, 0.5, 0.5, 0.5])
    gap = value(one.corners(names, values), torques) - value(other.corners(names, values), torques)
    assert np.abs(gap).max() > 0.01


@given(values=levels)
def test_the_smooth_chain_keeps_the_marginals_at_few_corners(values):
    """k + 1 corners, and one more for each pair that leans across each other."""
    names, blending = list(range(len(values))), Blending("smooth-chain")
    blend = blending.corners(names, values)
    k = len(values)
    near = sum(abs(a - b) <= 2 * REACH for i, a in enumerate(values) for b in values[:i])
    assert len(blend) <= k + 1 + near <= blending.most_corners(k) == 1 + k * (k + 1) // 2
    assert len({present for _, present in blend}) == len(blend)
    assert all(w > 0.0 for w, _ in blend)
    assert sum(w for w, _ in blend) == pytest.approx(1.0)
    for i, h in enumerate(values):
        assert sum(w for w, present in blend if i in present) == pytest.approx(h)


@given(values=levels)
def test_far_from_each_other_the_smooth_chain_is_the_chain(values):
    apart = all(abs(a - b) > 2 * REACH for i, a in enumerate(values) for b in values[:i])
    found = {p: w for w, p in Blending("smooth-chain").corners(list(range(len(values))), values)}
    chain = {p: w for w, p in corners(values, "chain")}
    if apart:
        assert found == pytest.approx(chain)
    else:  # the chain's weights move by no more than its members lean
        gap = sum(abs(found.get(p, 0.0) - chain.get(p, 0.0)) for p in found.keys() | chain.keys())
        assert gap <= 2.0 * REACH * len(values) + 1e-12


def test_members_of_a_chain_lean_apart():
    """Whoever moves together has another rank than the others, and keeps it."""
    rng, blending = np.random.default_rng(1), Blending("smooth-chain")
    names, before = list(range(12)), {}
    for _ in range(300):
        values = np.where(rng.random(12) < 0.3, 0.0, rng.uniform(0.1, 0.9, 12)).tolist()
        blending.corners(names, values)
        now = dict(blending.remembered())
        assert now.keys() == {i for i in names if values[i] > 0.0}
        assert len(set(now.values())) == len(now)
        assert all(now[who] == before[who] for who in now.keys() & before.keys())
        before = now


def slope_jump(blending, journeys, dt):
    """Largest change of the slope of the blend from one interval of dt [s] to the next, 1/s."""
    names, torques, profile = list(range(len(journeys))), Torques(), Profile("quintic")
    blend = Blending(blending)
    path = [
        value(blend.corners(names, [profile(at(j, t)).value for j in journeys]), torques)
        for t in np.arange(0.0, 1.0, dt)
    ]
    return np.abs(np.diff(path, 2, axis=0)).max() / dt


@pytest.mark.parametrize("seed", range(3))
def test_only_the_chain_has_kinks(seed):
    """The slope of five journeys that cross: in steps where two of a chain meet, else not.

    Three different programs each; ten times finer, a slope without steps changes by a tenth.
    """
    rng = np.random.default_rng(seed)
    journeys = [(rng.uniform(0.02, 0.2), rng.uniform(0.3, 0.7), False) for _ in range(5)]
    ratio = {
        name: slope_jump(name, journeys, 2e-4) / slope_jump(name, journeys, 2e-3)
        for name in ("idv", "smooth-chain", "chain")
    }
    assert ratio["idv"] < 0.2
    assert ratio["smooth-chain"] < 0.2
    assert ratio["chain"] > 0.5
    assert slope_jump("auto", journeys[:4], 2e-4) < 0.2 * slope_jump("auto", journeys[:4], 2e-3)


def test_an_unknown_name_is_refused():
    with pytest.raises(UnknownNameError, match=r"'all'.*auto, idv, chain, smooth-chain"):
        Blending("all")
