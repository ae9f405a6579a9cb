"""Other ways to keep bodies apart see the same wishes and bounds as the library."""

import numpy as np
import pytest

import opspace as osc
from opspace.compare import collision_experiment as experiment
from opspace.compare.projections import AnotherProjection, BarrierProgram, Wanted
from opspace.law.nearest import nearest_acceleration, softness_of_rows
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario


class Same(AnotherProjection):
    """The library's bounds in the library's metric."""

    def step(self, t, q, v, *, wrenches=None):
        found = super().step(t, q, v, wrenches=wrenches)
        self.library = osc.Controller.step(self, t, q, v, wrenches=wrenches).tau
        return found

    def realised(self, wish: Wanted):
        bounds = self._plan.tick.bounds
        self.wish = wish
        guard = self._plan.tick.distances
        softness = softness_of_rows(
            wish.G, wish.most, wish.U @ wish.U.T, np.array(guard.motors), np.array(guard.asked)
        )
        return nearest_acceleration(
            wish.U,
            wish.W,
            wish.acceleration,
            np.array(bounds.lower),
            np.array(bounds.upper),
            -wish.room - wish.balance,
            wish.room - wish.balance,
            wish.G,
            wish.most,
            softness,
        ).acceleration


def test_the_same_bounds_in_the_same_metric_give_the_same_torque():
    built = build(load_scenario("moving-ball"), Same)
    controller, robot = built.controller, built.robot
    rng = np.random.default_rng(0)
    ball = controller.collisions["ball"]
    # The first tick shows the tasks where they are held.
    controller.step(0.0, robot.q_reference, np.zeros(7))
    acted = 0
    for k in range(1, 30):
        ball.place(rng.uniform((0.1, -0.3, 0.4), (0.5, 0.3, 0.9)), velocity=rng.normal(size=3))
        q = robot.q_reference + 0.1 * rng.normal(size=7)
        command = controller.step(1e-3 * k, q, 0.3 * rng.normal(size=7))
        lost = osc.Status.COLLISION_LOST | osc.Status.LIMIT_LOST
        if command.status & lost or np.any(controller._plan.tick.bounds.gave_way > 0.0):
            continue  # lost, or levels have left room before the projection
        acted += osc.Status.COLLISION in command.status
        assert command.tau == pytest.approx(controller.library, abs=1e-5)
        # How fast distances grow: against the distances a moment later.
        wish, h = controller.wish, 1e-6
        here = ball.position + h * ball.velocity[:3]
        ball.place(here, velocity=ball.velocity)
        osc.Controller.step(controller, 1e-3 * k, q + h * wish.v, wish.v)
        D = np.array(controller._plan.tick.distance) - controller.collisions.kept
        assert (D - wish.D) / h == pytest.approx(wish.rate, abs=1e-3)
    assert acted > 5


def test_barriers_keep_a_distance_where_they_can():
    scenario = load_scenario("gap")
    built = build(scenario.model_copy(update={"duration": 1.4}), BarrierProgram)
    least = []

    class Look:
        def observe(self, q, v, command):
            least.append(next(iter(command.distances.values())).distance)

    osc.simulate(built.plant, built.controller, 1.4, [Look()])
    assert min(least) >= 0.0099


@pytest.mark.slow
def test_the_experiment_writes_numbers_and_a_figure(tmp_path, monkeypatch):
    scenario = load_scenario("gap").model_copy(update={"duration": 0.02})
    monkeypatch.setattr(experiment, "load_scenario", lambda name: scenario)
    done = experiment.reproduce_collisions(tmp_path, ["gap"])
    assert (tmp_path / "metrics.json").exists()
    heads, rows = experiment.collisions_table(done)
    assert [row[1] for row in rows] == list(experiment.WAYS)
    assert all(len(row) == len(heads) for row in rows)
    experiment.draw_collisions(done, tmp_path)
    assert (tmp_path / "collisions.png").exists()


def test_a_scene_without_collisions_is_refused(tmp_path):
    with pytest.raises(osc.InputError, match="keeps nothing apart"):
        experiment.reproduce_collisions(tmp_path, ["singularity"])
