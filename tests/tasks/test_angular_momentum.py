"""The momentum of a robot in the air is kept, and its rate is what the task says it is."""

import numpy as np
import pytest

import opspace as osc
from opspace.errors import InputError

H = 1e-5


def momentum(robot, task, q, v):
    robot.update(q, v)
    return task.evaluate(robot, 0.0).J @ v


@pytest.mark.parametrize("name", ["solo12", "g1"])
def test_its_rate_is_that_of_differences_and_gravity_cannot_change_it(name):
    robot, task = osc.load_robot(name), osc.AngularMomentumTask(kv=5.0)
    task.bind(robot)
    rng = np.random.default_rng(0)
    for _ in range(3):
        q = robot.integrate(robot.q_reference, 0.3 * rng.normal(size=robot.nv), 1.0)
        v, a = rng.normal(size=(2, robot.nv))
        robot.update(q, v)
        terms = task.evaluate(robot, 0.0)
        size = 1.0 + np.max(np.abs(terms.J @ v))
        ahead, behind = (
            momentum(robot, task, robot.integrate(q, v + 0.5 * s * a, s), v + s * a)
            for s in (H, -H)
        )
        rate = terms.J @ a + terms.drift
        assert np.max(np.abs((ahead - behind) / (2.0 * H) - rate)) < 1e-5 * (
            size + np.max(np.abs(rate))
        )
        assert np.allclose(terms.acceleration, -5.0 * terms.J @ v)
        robot.update(q, v)
        fall = np.linalg.solve(robot.M, -robot.bias)
        assert np.max(np.abs(terms.J @ fall + terms.drift)) < 1e-8 * size


def test_it_belongs_to_floating_bases():
    with pytest.raises(InputError, match="bolted down"):
        osc.Controller(osc.load_robot("ur5"), osc.Stack([osc.AngularMomentumTask()]))
    with pytest.raises(InputError, match="kv"):
        osc.AngularMomentumTask(kv=-1.0)
