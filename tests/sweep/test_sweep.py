"""Sweeps: every run follows from its number, none is lost, none is repeated."""

import json
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import opspace as osc
from opspace.errors import InputError, RecordingError
from opspace.scenario import load_scenario
from opspace.scenario.load import scenario_from, to_dict
from opspace.sweep import SweepPlan, Variation, run_sweep
from opspace.sweep import workers as pool
from opspace.sweep.row import run_row
from opspace.sweep.store import Store

BASE = to_dict(load_scenario("showpiece", ["duration=0.02", "events=[]"]))
GAIN = Variation.read("tasks.position.kp=25..400")


def grid():
    return SweepPlan(BASE, [Variation.read("tasks.position.kp=[25.0, 50.0, 100.0]")])


def test_every_run_follows_from_its_number_alone():
    plan = SweepPlan(BASE, [GAIN], runs=5, seed=7)
    assert run_row(plan, 3) == run_row(SweepPlan(BASE, [GAIN], runs=5, seed=7), 3)
    values = [plan.values(i)["tasks.position.kp"] for i in range(5)]
    assert len(set(values)) == 5
    assert all(25.0 <= value <= 400.0 for value in values)
    other = SweepPlan(BASE, [GAIN], runs=5, seed=8).values(0)["tasks.position.kp"]
    assert other != values[0]


def test_a_grid_runs_every_combination_once():
    plan = SweepPlan(
        BASE,
        [
            Variation.read("tasks.position.kp=[25.0, 50.0]"),
            Variation.read("blending=[auto, chain, idv]"),
        ],
    )
    found = {tuple(plan.values(i).values()) for i in range(plan.size)}
    assert plan.size == len(found) == 6
    assert plan.scenario(5).blending == "idv"


def test_the_scenario_of_a_row_repeats_its_run_alone():
    plan = SweepPlan(None, [], runs=3, seed=5)
    row = run_row(plan, 2)
    alone = run_row(SweepPlan(row["scenario"], [Variation("seed", (row["scenario"]["seed"],))]), 0)
    assert alone["numbers"] == row["numbers"]
    assert alone["id"] == row["id"]
    assert scenario_from(row["scenario"]) == plan.scenario(2)


def test_rows_are_the_same_however_many_run_at_a_time(tmp_path):
    plan = SweepPlan(BASE, [GAIN], runs=4, seed=1)
    one, two = (run_sweep(plan, tmp_path / str(jobs), jobs=jobs).rows for jobs in (1, 2))
    assert one == two
    assert [row["index"] for row in one] == [0, 1, 2, 3]
    assert all(row["ended"] == "completed" for row in one)
    assert (tmp_path / "1/table.csv").read_text() == (tmp_path / "2/table.csv").read_text()


def test_what_is_finished_is_not_run_again(tmp_path):
    plan = grid()
    store = Store(tmp_path / "s", plan)
    mark = {**run_row(plan, 1), "reason": "finished before"}
    store.add(mark)
    found = run_sweep(plan, tmp_path / "s", jobs=1)
    assert len(found.rows) == 3
    assert found.rows[1]["reason"] == "finished before"


def test_another_sweep_in_the_directory_is_refused(tmp_path):
    Store(tmp_path / "s", grid())
    with pytest.raises(RecordingError, match="another sweep"):
        Store(tmp_path / "s", SweepPlan(BASE, [GAIN], runs=2))
    (tmp_path / "other").mkdir()
    (tmp_path / "other/thesis.txt").write_text("")
    with pytest.raises(RecordingError, match="no sweep"):
        Store(tmp_path / "other", grid())


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ("tasks.position.kq=[1, 2]", "kq"),
        ("tasks.position.kp=[-1.0]", "kp"),
        ("task.position.kp=[1.0]", "unknown key"),
    ],
)
def test_a_key_that_is_none_is_found_before_anything_runs(tmp_path, vary, words):
    with pytest.raises(osc.ScenarioError, match=words):
        run_sweep(SweepPlan(BASE, [Variation.read(vary)]), tmp_path / "s")
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    "text", ["kp", "kp=", "=1..2", "kp=2..1", "kp=log 0..1", "kp=[]", "kp=5", "kp=1..nan"]
)
def test_variations_that_are_none_are_refused(text):
    with pytest.raises(InputError, match="--vary"):
        Variation.read(text)


def test_ranges_are_uniform_in_number_or_in_logarithm():
    rng = np.random.default_rng(0)
    flat = [Variation.read("x=0..10").draw(rng) for _ in range(2000)]
    steep = [Variation.read("x=log 1..100").draw(rng) for _ in range(2000)]
    assert np.mean(flat) == pytest.approx(5.0, abs=0.2)
    assert np.median(steep) == pytest.approx(10.0, rel=0.15)


def test_a_run_that_fails_is_a_row_with_its_reason_and_its_scenario(tmp_path):
    plan = SweepPlan(BASE, [Variation.read("tasks.position.frame=[null, nose]")])
    found = run_sweep(plan, tmp_path / "s", jobs=1)
    (failed,) = found.failed
    assert failed["ended"] == "refused"
    assert "nose" in failed["reason"]
    path = tmp_path / "s/failed/000001.yaml"
    assert found.command(failed).endswith(str(path))
    assert load_scenario(path).tasks["position"].frame == "nose"


def _dies(plan, index):
    if index == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    if index == 2:
        time.sleep(60.0)
    return {**run_row(plan, 0), "index": index}


def _serve_deadly(plan, pipe):
    pool.run_row = _dies
    pool._serve(plan, pipe)


def test_a_process_that_dies_or_hangs_is_replaced(monkeypatch):
    start = pool._start

    def deadly(plan):
        with monkeypatch.context() as patch:
            patch.setattr(pool, "_serve", _serve_deadly)
            return start(plan)

    monkeypatch.setattr(pool, "_start", deadly)
    plan = SweepPlan(BASE, [GAIN], runs=4)
    found = {row["index"]: row for row in pool.run_here(plan, range(4), 1, timeout=6.0)}
    assert {i: row["ended"] for i, row in found.items()} == {
        0: "completed",
        1: "died",
        2: "timed out",
        3: "completed",
    }
    assert found[1]["reason"] == "SIGKILL"


def _serve_nothing(plan, pipe):
    sys.exit(3)


def test_a_sweep_whose_processes_cannot_begin_says_so_at_once(monkeypatch):
    monkeypatch.setattr(pool, "_serve", _serve_nothing)
    rows = pool.run_here(SweepPlan(BASE, [GAIN], runs=400), range(400), 1, timeout=6.0)
    with pytest.raises(InputError, match=r"before its first run \(exit status 3\).*__main__"):
        next(rows)


def test_the_time_allowed_begins_when_the_process_is_ready(monkeypatch):
    monkeypatch.setattr(pool, "_serve", _serve_late)
    (row,) = pool.run_here(SweepPlan(BASE, [GAIN], runs=1), [0], 1, timeout=2.5)
    assert row["ended"] == "completed"


def _serve_late(plan, pipe):
    time.sleep(4.0)
    pool.run_row = lambda plan, index: {"index": index, "ended": "completed"}
    pool._serve(plan, pipe)


@pytest.mark.slow
def test_killed_at_random_moments_a_sweep_loses_and_repeats_nothing(tmp_path):
    out = tmp_path / "s"
    command = [
        sys.executable, "-c", "from opspace.cli import main; main()",
        "sweep", "random", "--runs", "80", "--seed", "3", "--jobs", "2", "--out", str(out),
    ]  # fmt: skip
    seen: dict[str, tuple[int, bytes]] = {}
    moments = random.Random(0)

    def rows():
        return sorted((out / "rows").glob("[0-9]*.json"))

    for _ in range(20):
        before = len(rows())
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # Always in the middle of the work, however slow the machine is to begin.
        while process.poll() is None and len(rows()) == before:
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, 0.3))
        assert process.poll() is None, "the sweep was over before it could be killed 20 times"
        process.kill()
        process.wait()
        for path in rows():
            now = (path.stat().st_mtime_ns, path.read_bytes())
            assert seen.setdefault(path.name, now) == now
        assert set(seen) == {path.name for path in rows()}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for name, (when, content) in seen.items():
        path = out / "rows" / name
        assert (path.stat().st_mtime_ns, path.read_bytes()) == (when, content)
    found = [json.loads(path.read_text()) for path in rows()]
    assert [row["index"] for row in found] == list(range(80))
    plan = SweepPlan(None, [], 80, 3)
    for index in (0, 17, 79):
        assert found[index] == json.loads(json.dumps(run_row(plan, index)))


@pytest.mark.slow
def test_on_a_cluster_of_two_nodes_rows_are_identical(tmp_path):
    ray = pytest.importorskip("ray", reason="ray is not installed")
    cluster_utils = pytest.importorskip("ray.cluster_utils")
    plan = SweepPlan(None, [], 6, 11)
    here = run_sweep(plan, tmp_path / "here", jobs=1).rows
    cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        there = run_sweep(plan, tmp_path / "there", ray=cluster.address).rows
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert here == there
