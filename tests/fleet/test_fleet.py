"""Every robot of a fleet does what a controller of its own would do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from tests.fleet.fleets import LEVELS, Beside

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")


@pytest.fixture(scope="module")
def beside():
    return Beside().prepare()


def test_random_states_with_limits_and_singular_postures():
    both = Beside(count=64).prepare()
    rng = np.random.default_rng(1)
    seen = 0
    for k in range(12):
        Q, V = both.states(rng, spread=0.3 * (k + 1), speed=2.0)
        for command in both.assert_same(0.001 * k, Q, V):
            seen |= int(command.status)
    wanted = osc.Status.DIRECTION_OFF | osc.Status.FILTERED | osc.Status.TORQUE_SCALED
    assert wanted in osc.Status(seen)


requests = st.tuples(
    st.integers(0, 30),
    st.sampled_from(["insert", "remove", "move", "swap"]),
    st.sampled_from(["position", "orientation", "elbow"]),
    st.integers(0, 2),
    st.sampled_from([0.0, 0.02, 0.1]),
    st.sampled_from(["quintic", "cubic", "linear"]),
    st.lists(st.booleans(), min_size=6, max_size=6),
)


@settings(max_examples=12)
@given(program=st.lists(requests, max_size=8), seed=st.integers(0, 2**32 - 1))
def test_random_programs_of_requests_for_some_robots(program, seed):
    both = Beside().prepare()
    rng = np.random.default_rng(seed)
    Q, V = both.states(rng)
    for k in range(32):
        for request in program:
            if request[0] == k:
                ask(both, *request[1:])
        both.assert_same(0.005 * k, Q + 0.005 * k * V, V)


def ask(both, kind, name, level, duration, profile, mask):
    """Ask the fleet and the controllers of the robots that can do it for the same."""
    level = LEVELS[name][level % len(LEVELS[name])]
    other = "orientation" if name == "position" else "position"
    timing = {"duration": duration, "profile": profile}
    able = []
    for i, (stack, later) in enumerate(zip(both.stacks, both.others, strict=True)):
        task = later if name == "elbow" else both.first[i][name]
        try:
            if not mask[i]:
                continue
            if kind == "insert":
                stack.insert(task, level, **timing)
            elif kind == "remove":
                stack.remove(name, **timing)
            elif kind == "move":
                stack.move(name, level, **timing)
            elif name != "elbow":
                stack.swap(name, other, **timing)
            else:
                continue
        except osc.OpspaceError:
            continue
        able.append(i)
    if able and kind == "swap":
        both.fleet.swap(name, other, **timing, robots=able)
    elif able and kind == "remove":
        both.fleet.remove(name, **timing, robots=able)
    elif able:
        getattr(both.fleet, kind)(name, level, **timing, robots=able)
