"""Loops over whole vectors do in compiled code what they say, and touch nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.kernels import whole_vectors as under_test
from opspace.machine.jit import jit
from opspace.machine.lanes import LANES, whole, whole_before
from opspace.machine.sine_vectors import FAR
from tests.budget import examples

ROWS, WIDTH, BEHIND = 6, 3 * LANES, 4
PLAIN = {
    name: function
    for name, function in vars(under_test).items()
    if getattr(function, "__module__", "") == under_test.__name__
    and not hasattr(function, "py_func")
}
ARGUMENTS = {name: f.__code__.co_varnames[: f.__code__.co_argcount] for name, f in PLAIN.items()}


def call_of(name):
    """Compile a call: what is called is translated where it stands."""
    given_ = ", ".join(ARGUMENTS[name])
    text = f"def call_{name}({given_}):\n    return {name}({given_})"
    scope = {name: PLAIN[name], "__name__": __name__}
    exec(compile(text, __file__, "exec"), scope)
    return jit(scope[f"call_{name}"])


@pytest.fixture(scope="module", params=PLAIN)
def both(request):
    return request.param, PLAIN[request.param], call_of(request.param)


def arguments(name, rng, count, rows):
    """What a function may be called with, by the names of its arguments; vectors are padded."""
    end, first = whole(count), int(rng.integers(0, whole(count) // LANES + 1)) * LANES
    numbers = {
        "first": int(rng.integers(0, rows + 1)) if "A" in ARGUMENTS[name] else min(first, end),
        "end": rows if "A" in ARGUMENTS[name] else end,
        "begin": min(first, end),
        "width": end,
        "count": rows if name == "dots" else count,
        "place": int(rng.integers(0, max(count, 1))),
        "column": int(rng.integers(0, max(count, 1))),
        "factor": rng.normal(),
        "value": rng.normal(),
    }
    arrays = {
        "A": rng.normal(size=(ROWS, WIDTH)),
        "F": rng.normal(size=(ROWS, WIDTH)),
        "factors": rng.normal(size=ROWS),
        "x": rng.normal(size=WIDTH),
        "y": rng.normal(size=WIDTH),
        "into": rng.normal(size=WIDTH + BEHIND),
        "angles": rng.normal(scale=10.0 ** rng.integers(-8, 9), size=WIDTH),
        "cosine": rng.normal(size=WIDTH + BEHIND),
        "sine": rng.normal(size=WIDTH + BEHIND),
    }
    return [numbers.get(one, arrays.get(one)) for one in ARGUMENTS[name]]


@given(st.integers(0, 2**32 - 1), st.integers(1, 2 * LANES), st.integers(0, ROWS))
@examples(60)
def test_compiled_is_what_is_written(both, seed, count, rows):
    name, plain, compiled = both
    given_ = arguments(name, np.random.default_rng(seed), count, rows)
    copies = [np.copy(one) if isinstance(one, np.ndarray) else one for one in given_]
    expected, found = plain(*given_), compiled(*copies)
    for ours, theirs in zip([found, *copies], [expected, *given_], strict=True):
        if ours is not None:
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


@pytest.mark.parametrize("count", range(2 * LANES + 1))
def test_what_is_not_padded_is_not_used_nor_written_behind_its_end(count):
    put, take = call_of("put_first"), call_of("take_first")
    row = np.append(np.arange(1.0, count + 1.0), np.full(BEHIND, np.nan))[:count]
    into = np.full(3 * LANES, -1.0)
    put(2.0, row, into, count)
    np.testing.assert_array_equal(into[:count], 2.0 * row)
    assert not into[count : whole(count)].any()
    assert (into[whole(count) :] == -1.0).all()
    found = np.full(count + BEHIND, -1.0)
    take(into, found, count)
    np.testing.assert_array_equal(found[:count], 2.0 * row)
    assert (found[count:] == -1.0).all()


ANGLES = st.one_of(
    st.floats(-1e9, 1e9),
    st.floats(-10.0, 10.0),
    st.integers(-1000, 1000).map(lambda k: 0.25 * k * np.pi),
    st.sampled_from([0.0, -0.0, 5e-324, FAR, -FAR, np.nextafter(FAR, 2 * FAR), 1e300]),
)


@pytest.fixture(scope="module")
def turn():
    return call_of("turn")


@given(st.lists(ANGLES, min_size=1, max_size=2 * LANES))
@examples(200)
def test_turns_are_those_of_libm_to_the_last_digit_but_one(turn, angles):
    x = np.array(angles)
    cosine, sine = np.full((2, 2 * LANES + BEHIND), -1.0)
    turn(x, cosine, sine, x.size)
    for found, expected in ((cosine, np.cos(x)), (sine, np.sin(x))):
        np.testing.assert_allclose(found[: x.size], expected, rtol=0, atol=2.3e-16)
        assert not found[x.size : whole(x.size)].any()
        assert (found[whole(x.size) :] == -1.0).all()
    small = np.abs(x) < 1e-8
    np.testing.assert_array_equal(sine[: x.size][small], x[small])


@pytest.mark.parametrize("angle", [np.nan, np.inf, -np.inf])
def test_no_angle_has_no_turn(turn, angle):
    x = np.array([0.5, angle, -0.5])
    cosine, sine = np.zeros((2, LANES))
    turn(x, cosine, sine, x.size)
    np.testing.assert_array_equal(np.isnan(cosine), np.isnan(sine))
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(sine)), [1])


@given(st.integers(0, 1000))
def test_whole_vectors(count):
    assert whole(count) - LANES < count <= whole(count)
    assert whole_before(count) <= count < whole_before(count) + LANES
    assert whole(count) % LANES == whole_before(count) % LANES == 0
