"""The benchmark measures what it says, keeps it, and compares runs."""

import numpy as np
import pytest

from opspace.bench import (
    SCENES,
    Benchmark,
    Sampler,
    changes_table,
    compare_runs,
    run_benchmark,
    worst_case,
    worst_table,
)
from opspace.bench.timing import interleaved, slowest_state
from opspace.controller.batch import cores
from opspace.errors import InputError, UnknownNameError
from opspace.plots.benchmark import benchmark_figure
from opspace.robots import available_robots, load_robot

INSTALLED = {info.name for info in available_robots() if info.installed}


def test_a_scene_is_timed_beside_the_models_own_calls(tmp_path):
    told = []
    found = run_benchmark(["puma"], ticks=40, readable=True, announce=told.append)
    times = found.scenes["puma"]
    assert [what.split(":")[0] for what in told] == ["puma", "puma, many states at once"]
    assert set(times) == {"opspace", "model calls alone", "readable form"}
    for subject in times.values():
        assert 0.0 < subject["p50"] <= subject["p99"] <= subject["max"]
        assert 0.0 < subject["slowest"] <= subject["max"]
        assert subject["ticks"] == 40
    assert found.ratio("puma", "opspace", "model calls alone") == (
        times["opspace"]["p50"] / times["model calls alone"]["p50"]
    )
    assert found.ratio("puma", "opspace", "placo") is None
    assert set(found.batches["puma"]) == {"1", str(cores())}
    assert all(rate > 0.0 for rate in found.batches["puma"].values())
    assert len(found.batch_table()[1]) == len(found.batches["puma"])
    found.save(tmp_path / "a" / "bench.json")
    again = Benchmark.load(tmp_path / "a" / "bench.json")
    assert again == found
    heads, rows = compare_runs(found, again)
    assert len(heads) == 4
    assert [(row[0], row[3]) for row in rows] == [("puma", "1.00")]
    assert len(found.table()[1]) == 3


@pytest.mark.skipif("panda" not in INSTALLED, reason="needs opspace[robots]")
@pytest.mark.parametrize("name", ["chain-8", "idv-3"])
def test_transitions_are_half_way_whenever_they_are_timed(name):
    scene = SCENES[name]
    controller = scene.controller()
    q, v = scene.states(controller.robot)
    for k in range(3):
        command = controller.step(scene.time, q[k], v[k])
        moving = [task for task in command.tasks.values() if 0.0 < task.activation < 1.0]
        assert len(moving) == scene.transitions
    assert command.hard_solves == (9 if name == "chain-8" else 8)


def test_subjects_take_turns_and_see_the_same_states():
    seen = {"a": [], "b": []}
    ticks = {name: (lambda q, v, log=log: log.append(q[0])) for name, log in seen.items()}
    q = np.arange(5.0)[:, None]
    times = interleaved(ticks, q, q, 700)
    assert seen["a"] == seen["b"]
    assert all(found.shape == (700,) and (found > 0.0).all() for found in times.values())


def test_the_slowest_state_is_found_whatever_else_the_machine_does():
    cost, rng = {0.0: 3.0, 1.0: 7.0, 2.0: 5.0}, np.random.default_rng(0)
    went = []
    q = np.arange(3.0)[:, None]
    interleaved({"a": lambda q, v: went.append(q[0])}, q, q, 1300)
    quiet = np.array([cost[state] for state in went[-1300:]])
    interrupted = quiet + 900.0 * (rng.uniform(size=quiet.size) < 0.3)
    assert slowest_state(interrupted, 3) == 7.0
    assert slowest_state(interrupted[:2], 3) == interrupted[:2].max()


def test_bad_requests_are_refused(tmp_path):
    with pytest.raises(UnknownNameError, match=r"scene 'pandas'.*panda"):
        run_benchmark(["pandas"])
    with pytest.raises(InputError, match="no core 4711"):
        run_benchmark(["puma"], ticks=1, core=4711)
    with pytest.raises(InputError, match="at least one tick"):
        run_benchmark(["puma"], ticks=0)
    (tmp_path / "x.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=r"x\.json: not a benchmark"):
        Benchmark.load(tmp_path / "x.json")


def test_the_figure_shows_every_scene():
    times = {"opspace": {"p50": 8.0}, "model calls alone": {"p50": 2.0}}
    scenes = {"panda": times, "chain-0": times, "chain-4": times, "idv-1": times}
    left, right = benchmark_figure(scenes).axes
    assert [label.get_text() for label in left.get_yticklabels()] == ["panda"]
    assert len(right.lines) == 2


@pytest.mark.skipif("panda" not in INSTALLED, reason="needs opspace[robots]")
def test_changes_of_the_stack_are_timed_beside_the_ticks_around_them():
    heads, rows = changes_table(2)
    assert {row[1] for row in rows} == {"hot", "paced"}
    assert len(rows) == 12
    assert all(len(row) == len(heads) and float(row[-1]) > 0.0 for row in rows)
    with pytest.raises(InputError, match="at least once"):
        changes_table(0)


@pytest.mark.parametrize("name", ["puma560", "talos"])
def test_states_are_drawn_from_the_whole_workspace_and_steps_stay_in_it(name):
    robot = load_robot(name)
    sampler = Sampler(robot, seed=1)
    states = [sampler.draw() for _ in range(200)]
    states += [sampler.near(state, 0.3) for state in states]
    lower, upper = (limit[6 * robot.floating_base :] for limit in (robot.q_lower, robot.q_upper))
    q, v = (np.array(part) for part in zip(*states, strict=True))
    q = q[:, -lower.size :]
    assert np.all((q >= lower) & (q <= upper))
    assert np.all(np.abs(v[:, -lower.size :]) <= robot.velocity_limit[-lower.size :])
    part = (q - lower) / (upper - lower)
    assert part.min() < 0.02
    assert part.max() > 0.98
    for state in states[:3]:
        robot.update(*state)


def test_the_search_finds_what_takes_long(monkeypatch):
    """Where time is made up to grow with one joint, the search goes there."""
    monkeypatch.setattr(worst_case, "_quickest", lambda tick, state: float(state[0][0]))
    found = worst_case.slowest(SCENES["puma"], 1280)
    assert found.found.size == worst_case.KEPT
    assert np.median(found.found) > found.drawn.max()


def test_the_worst_case_is_told_beside_the_usual():
    heads, rows = worst_table(["puma"], 40)
    assert [row[1] for row in rows] == ["usual", "drawn", "slowest"] * (len(rows) // 3)
    assert {row[0] for row in rows} >= {"puma"}
    assert all(len(row) == len(heads) for row in rows)
    assert all(float(row[2]) <= float(row[3]) <= float(row[4]) for row in rows)
    with pytest.raises(InputError, match="needs 32 states"):
        worst_table(["puma"], 31)
    with pytest.raises(UnknownNameError):
        worst_table(["pandas"], 40)
