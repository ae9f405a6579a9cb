"""The default blending is exact for a few, cheap for many, and continuous from one to the other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import UnknownNameError
from opspace.law import corners
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


@given(journeys=journeys())
def test_steps_shrink_with_the_activations_whoever_changes_groups(journeys):
    """|Δ| <= Σ |Δh| · widest gap between any two hard torques, through every change of groups."""
    names, torques, blending = list(range(len(journeys))), Torques(), Blending("auto")
    before = last = None
    for t in np.arange(0.0, 1.4, 0.01):
        values = [at(journey, t) for journey in journeys]
        now = value(blending.corners(names, values), torques)
        if before is not None:
            moved = sum(abs(a - b) for a, b in zip(values, last, strict=True))
            gap = max(np.ptp(list(torques.values()), axis=0))
            assert np.abs(now - before).max() <= moved * gap + 1e-12
        before, last = now, values


def test_choosing_the_groups_anew_at_every_tick_would_step():
    """Why an activation keeps its group while it moves: the two ways differ in between."""
    names, values, torques = list(range(5)), [0.5] * 5, Torques()
    one, other = Blending("auto"), Blending("auto")
    one.corners(names, [0.5, 0.5, 0.5, 0.0, 0.0])
    other.corners(names, [0.0, 0.0, 0.5, 0.5, 0.5])
    gap = value(one.corners(names, values), torques) - value(other.corners(names, values), torques)
    assert np.abs(gap).max() > 0.01


def test_an_unknown_name_is_refused():
    with pytest.raises(UnknownNameError, match=r"'all'.*auto, idv, chain"):
        Blending("all")
