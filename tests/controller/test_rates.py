"""Ticks that come too seldom for limits or gains are refused, with the number to use."""

from __future__ import annotations

import re

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.controller.rates import longest_period
from opspace.law.scalars import admissible_command

KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])


def built(kind, *tasks, period, **options):
    stack = osc.Stack([*tasks, osc.PostureTask(kp=1.0)])
    return kind(osc.load_robot("puma560"), stack, period=period, **options)


def number_in(error, pattern):
    found = re.search(pattern, str(error.value))
    assert found
    return float(found[1])


class Slow(osc.JointLimits):
    k1, k2 = 2.0, 4.0


class Quick(osc.JointLimits):
    k1, k2 = 30.0, 60.0


LAWS = pytest.mark.parametrize("limits", [osc.JointLimits, Slow, Quick])


@pytest.mark.parametrize("rates", [(10.0, 20.0), (2.0, 4.0), (30.0, 60.0), (5.0, 40.0)])
def test_the_longest_period_is_where_a_joint_that_moves_away_comes_back_to_the_limit(rates):
    """One coordinate, at its limit and moving away as fast as it then may come back."""
    k1, k2 = rates
    longest = longest_period(k1, k2)
    for share in (0.9, 0.999, 1.001, 1.1):
        dt, d, v = share * longest, 0.0, -0.1
        furthest = np.inf
        for _ in range(50):
            v += dt * admissible_command(d, v, 1e3, np.inf, k1, k2, 0.0, 0.1)
            d -= dt * v
            furthest = min(furthest, d, (k1 * d - v) / k1)
        assert (furthest >= -1e-12) == (share < 1.0)


def test_a_thirtieth_of_a_second_is_the_longest_by_default():
    assert longest_period(osc.JointLimits.k1, osc.JointLimits.k2) == pytest.approx(1.0 / 30.0)


@KINDS
@LAWS
def test_a_period_that_breaks_the_limits_is_refused(kind, limits):
    longest = longest_period(limits.k1, limits.k2)
    with pytest.raises(osc.InputError, match="joint limits do not hold") as error:
        built(kind, limits(), period=1.01 * longest)
    built(kind, limits(), period=number_in(error, r"at most ([\d.]+) s"))
    built(kind, limits(mode="buffer"), period=1.01 * longest)
    built(kind, period=1.01 * longest)


@KINDS
@pytest.mark.parametrize("period", [1e-3, 4e-3, 0.02])
@pytest.mark.parametrize(
    "task",
    [
        lambda kp: osc.PositionTask(kp=kp, name="stiff"),
        lambda kp: osc.PoseTask(kp_angular=kp, name="stiff"),
        lambda kp: osc.JointTask("joint2", kp=1.0, kv=2.0 * np.sqrt(kp), name="stiff"),
    ],
)
def test_a_damping_that_diverges_is_refused(kind, period, task):
    with pytest.raises(osc.InputError, match=r"'stiff': kv = .* diverges") as error:
        built(kind, task(1.001 / period**2), period=period)
    most = number_in(error, r"kp = ([\d.e+]+) ")
    built(kind, task(0.99 * most), period=period)


@KINDS
def test_a_task_that_comes_later_is_refused_when_it_is_asked_for(kind):
    controller = built(kind, period=0.01)
    with pytest.raises(osc.InputError, match="'late': kv = "):
        controller.stack.insert(osc.PositionTask(kp=2e4, name="late"), 0.0)
    controller.stack.insert(osc.PositionTask(kp=5e3, name="late"), 0.0)
    unknown = osc.Controller(osc.load_robot("puma560"), osc.Stack([osc.PostureTask()]))
    unknown.stack.insert(osc.PositionTask(kp=2e4, name="late"), 0.0)


@KINDS
def test_the_damping_of_what_is_left_is_looked_at_too(kind):
    with pytest.raises(osc.InputError, match="damping = 300"):
        built(kind, period=0.01, damping=300.0)
