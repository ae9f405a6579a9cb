"""What the doctor measures and advises."""

import json
import subprocess

import pytest

import opspace as osc
from opspace.loop.wake_up import advice, wake_ups
from tests.another_python import python


def put(root, path, text):
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(text)


def test_advises_what_is_not_set_and_nothing_else(tmp_path, monkeypatch):
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.setenv(name, "1")
    put(tmp_path, "sys/kernel/realtime", "1\n")
    put(tmp_path, "sys/devices/system/cpu/isolated", "3\n")
    put(tmp_path, "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n")
    put(tmp_path, "proc/sys/kernel/sched_rt_runtime_us", "-1\n")
    assert advice(tmp_path) == []
    put(tmp_path, "proc/sys/kernel/sched_rt_runtime_us", "950000\n")
    put(tmp_path, "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n")
    monkeypatch.delenv("OMP_NUM_THREADS")
    runtime, governor, threads = sorted(advice(tmp_path), key=lambda s: "950000 µs" not in s)
    assert "950000 µs" in runtime
    assert "powersave" in governor + threads
    assert "OMP_NUM_THREADS" in governor + threads
    assert len(advice(tmp_path / "nothing")) == 3


def test_every_wake_up_is_counted_and_none_is_early():
    found = wake_ups(0.02, 1e-3, None)
    assert found.late.shape == (20,)
    assert (found.late >= 0.0).all()
    assert found.refused == ()
    for wrong in (0.0, float("nan"), -1.0):
        with pytest.raises(osc.InputError):
            wake_ups(wrong, 1e-3, None)


def test_the_command_tells_both_kinds_of_threads():
    # In a process of its own: one that has loaded much takes long to have its memory locked.
    program = "from opspace.cli import main; main(['doctor', '--seconds', '0.01', '--json'])"
    done = subprocess.run(python("-c", program), capture_output=True, encoding="utf-8", check=True)
    told = json.loads(done.stdout)
    assert list(told["late_us"]) == ["ordinary", "real-time"]
    assert all(v["p50"] <= v["max"] for v in told["late_us"].values())


def test_what_cannot_be_asked_for_is_refused():
    for wrong in ({"priority": 0}, {"priority": 100}, {"core": 10_000}, {"switch_interval": 0.0}):
        with pytest.raises(osc.InputError):
            osc.RealTime(**wrong)


def test_what_is_refused_is_said_and_what_others_notice_is_given_back(monkeypatch):
    import os
    import sys

    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    before = sys.getswitchinterval()
    refused, give_back = osc.RealTime(lock_memory=False).take()
    give_back()
    assert len(refused) == 1
    assert "not permitted" in refused[0]
    assert sys.getswitchinterval() == before
