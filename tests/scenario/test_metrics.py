"""Metrics say of a run what was put into it."""

import json
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import UnknownNameError
from opspace.record import Column, Recorder, Recording, load
from opspace.record.format import End
from opspace.runs.metrics import UNITS, Metrics, measure

TICKS = 200
DT = 0.01
JOINTS = ("a", "b", "c")
sizes = st.floats(1e-3, 1e3)


def recorded(values=None, *, names=JOINTS, how="completed", extra=()):
    """A resting run in memory, with some columns replaced."""
    columns = [Column("t", "s")]
    for group, unit in (("q", "rad"), ("v", "rad/s"), ("tau", "N·m")):
        columns += [Column(f"{group}/{name}", unit) for name in names]
    columns += extra
    data = np.zeros((TICKS, len(columns)))
    data[:, 0] = DT * np.arange(TICKS)
    index = [column.name for column in columns]
    for name, column in (values or {}).items():
        data[:, index.index(name)] = column
    return Recording(
        directory="run",
        columns=tuple(columns),
        header={},
        meta={},
        ended=End(how, "", TICKS),
        data=data,
    )


def step_at(tick, height):
    return np.where(np.arange(TICKS) >= tick, height, 0.0)


def error_columns(task, units):
    return [Column(f"tasks/{task}/error/{i}", unit) for i, unit in enumerate(units)]


@given(sizes, st.integers(1, TICKS - 1), st.sampled_from(JOINTS), st.sampled_from([1.0, -1.0]))
def test_a_single_step_of_the_torque_is_measured_as_it_is(size, tick, joint, sign):
    run = recorded({f"tau/{joint}": step_at(tick, sign * size)})
    assert measure(run).max_torque_step == size


@given(sizes, st.floats(-1e3, 1e3))
def test_a_ramp_counts_by_its_slope_and_an_offset_does_not_count(size, offset):
    run = recorded({"tau/b": offset + size * np.arange(TICKS)})
    assert measure(run).max_torque_step == pytest.approx(size, rel=1e-9)


@given(st.permutations(JOINTS), st.integers(0, 2**32 - 1))
def test_the_order_of_the_joints_does_not_matter(order, seed):
    rng = np.random.default_rng(seed)
    values = {f"{g}/{j}": rng.normal(size=TICKS) for g in ("q", "v", "tau") for j in JOINTS}
    expected = measure(recorded(values), limited_joint="b", return_time=1.0)
    assert measure(recorded(values, names=order), limited_joint="b", return_time=1.0) == expected


@given(st.floats(0.1, 10.0), st.integers(0, 2**32 - 1))
def test_torque_and_speed_scale_with_the_run(factor, seed):
    rng = np.random.default_rng(seed)
    values = {f"{g}/{j}": rng.normal(size=TICKS) for g in ("v", "tau") for j in JOINTS}
    one = measure(recorded(values), return_time=1.0)
    more = measure(recorded({n: factor * x for n, x in values.items()}), return_time=1.0)
    for name in ("max_torque_step", "max_joint_speed", "rest_speed"):
        assert getattr(more, name) == pytest.approx(factor * getattr(one, name))


@given(st.integers(0, TICKS - 1), sizes)
def test_rest_is_the_half_second_before_the_return(tick, speed):
    t, v = DT * np.arange(TICKS), np.zeros(TICKS)
    v[tick] = -speed
    rest = measure(recorded({"v/c": v}), return_time=1.2).rest_speed
    assert rest == (speed if 0.7 <= t[tick] < 1.2 else 0.0)


def test_rest_is_unknown_where_the_return_was_not_reached():
    assert measure(recorded(), return_time=DT * TICKS).rest_speed is None
    assert measure(recorded()).rest_speed is None


@pytest.mark.parametrize("how", ["stopped", "crashed", "interrupted", "unfinished"])
def test_a_run_that_ends_early_says_when(how):
    metrics = measure(recorded(how=how))
    assert not metrics.completed
    assert metrics.stopped_at == DT * (TICKS - 1)


def test_a_run_that_ends_as_planned_was_not_stopped():
    metrics = measure(recorded())
    assert metrics.completed
    assert metrics.stopped_at is None


def test_errors_are_norms_over_the_rows_of_their_task():
    rows = error_columns("orientation", ["rad"] * 3) + error_columns("position", ["m"] * 3)
    values = {"tasks/orientation/error/0": step_at(5, 3.0)}
    values["tasks/orientation/error/2"] = np.where(np.arange(TICKS) == 9, -4.0, 0.0)
    values["tasks/position/error/1"] = np.linspace(7.0, 1.0, TICKS)
    metrics = measure(recorded(values, extra=rows))
    assert metrics.max_orientation_error == 5.0
    assert metrics.final_position_error == 1.0


def test_a_pose_has_both_errors():
    rows = error_columns("hand", ["m"] * 3 + ["rad"] * 3)
    values = {"tasks/hand/error/0": 2.0, "tasks/hand/error/5": step_at(50, 0.5)}
    metrics = measure(recorded(values, extra=rows))
    assert metrics.final_position_error == 2.0
    assert metrics.max_orientation_error == 0.5


def test_the_smallest_sigma_is_that_of_any_direction_that_exists():
    names = ["levels/0/sigma/0", "levels/1/sigma/0", "levels/1/sigma/1", "levels/1/activation/1"]
    values = {names[0]: 2.0, names[1]: 1.0, names[2]: np.where(np.arange(TICKS) < 9, 0.5, np.nan)}
    run = recorded(values, extra=[Column(name, "1") for name in names])
    assert measure(run).min_sigma == 0.5


def test_the_range_of_the_limited_joint():
    run = recorded({"q/b": np.linspace(-0.5, 0.7, TICKS)})
    metrics = measure(run, limited_joint="b")
    assert (metrics.min_joint_position, metrics.max_joint_position) == (-0.5, 0.7)
    assert measure(run).max_joint_position is None
    with pytest.raises(UnknownNameError, match="q/d"):
        measure(run, limited_joint="d")


@given(st.lists(st.sampled_from([np.nan, np.inf, -np.inf]), min_size=6, max_size=6))
def test_whatever_diverges_the_numbers_are_finite(worst):
    """JSON has no infinity: a reader in another language must never meet one."""
    names = [f"{group}/{joint}" for group in ("v", "tau") for joint in JOINTS]
    values = {name: step_at(TICKS - 2, bad) for name, bad in zip(names, worst, strict=True)}
    metrics = measure(recorded(values), limited_joint="a", return_time=1.0)
    found = json.loads(json.dumps(metrics.to_json(), allow_nan=False))
    assert set(found) == {field.name for field in fields(Metrics)} == set(UNITS)
    assert found["max_torque_step"] == 0.0


def test_a_run_without_a_tick_has_no_numbers(tmp_path):
    columns = [Column("t", "s"), Column("v/a", "rad/s"), Column("tau/a", "N·m")]
    Recorder(tmp_path, columns, {}).close("crashed", "at once")
    numbers = measure(load(tmp_path), return_time=1.0).to_json()
    assert numbers.pop("completed") is False
    assert set(numbers.values()) == {None}
