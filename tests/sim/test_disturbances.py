"""Wrong masses, friction, delay, noise and pushes do what they say, and nothing when they are off."""

import numpy as np
import pytest

import opspace as osc
from opspace.record import load
from opspace.runs.replay_run import replay
from opspace.runs.run import run_scenario
from opspace.scenario import load_scenario
from opspace.scenario.load import scenario_from, to_dict
from opspace.sim import Disturbances, Plant, Push

PANDA = osc.load_robot("panda")
Q = PANDA.q_reference


def plant(**given):
    return Plant(PANDA, Q, disturbances=Disturbances(**given))


def short(**options):
    scenario = load_scenario("showpiece", ["duration=0.3", "events=[]"])
    return scenario_from({**to_dict(scenario), "plant": options})


def test_without_disturbances_the_run_is_what_it_was(tmp_path):
    off = dict.fromkeys(
        ("dry_friction", "mass_error", "delay", "position_noise", "velocity_noise"), 0.0
    )
    run_scenario(short(), tmp_path / "a")
    run_scenario(short(**off, pushes=[]), tmp_path / "b")
    a, b = ((tmp_path / name / "data.f64").read_bytes() for name in "ab")
    assert a == b


def test_masses_are_off_by_up_to_the_error_and_inertias_go_along():
    right, wrong = plant().model, plant(mass_error=0.2, seed=3).model
    heavy = right.body_mass > 1e-9
    factor = wrong.body_mass[heavy] / right.body_mass[heavy]
    assert np.all(np.abs(factor - 1.0) <= 0.2)
    assert np.ptp(factor) > 0.05
    assert np.allclose(wrong.body_inertia[heavy], factor[:, None] * right.body_inertia[heavy])
    again, other = plant(mass_error=0.2, seed=3).model, plant(mass_error=0.2, seed=4).model
    assert np.array_equal(wrong.body_mass, again.body_mass)
    assert not np.array_equal(wrong.body_mass, other.body_mass)
    assert np.array_equal(right.body_mass, plant().model.body_mass)  # no plant spoils another


@pytest.mark.parametrize(("part", "moves"), [(0.5, False), (1.5, True)])
def test_dry_friction_holds_against_less_than_itself(part, moves):
    robot = plant(dry_friction=0.1)
    PANDA.update(Q, np.zeros(7))
    gravity = np.array(PANDA.gravity)
    for _ in range(200):
        robot.advance(gravity + part * 0.1 * PANDA.torque_limit)
    assert np.max(np.abs(robot.q - Q)) > 0.1 if moves else np.allclose(robot.q, Q, atol=1e-4)


def test_a_delayed_torque_is_the_one_of_some_ticks_ago():
    torques = np.random.default_rng(0).uniform(-5.0, 5.0, (30, 7))
    late, early = plant(delay=0.004), plant()
    early_torques = [torques[0]] * 4 + list(torques)
    for tau, now in zip(torques, early_torques, strict=False):
        late.advance(tau)
        early.advance(now)
        assert np.array_equal(late.q, early.q)


def test_noise_has_the_deviation_asked_for_and_leaves_the_robot_alone():
    noisy = plant(position_noise=1e-3, velocity_noise=1e-2, seed=5)
    read = [noisy.measure() for _ in range(2000)]
    dq = np.array([q for q, _ in read]) - Q
    dv = np.array([v for _, v in read])
    assert np.allclose(dq.std(axis=0), 1e-3, rtol=0.1)
    assert np.allclose(dv.std(axis=0), 1e-2, rtol=0.1)
    assert np.all(np.abs(dq.mean(axis=0)) < 1e-4)
    assert np.array_equal(noisy.q, Q)


def test_a_push_is_the_force_at_the_tool_while_it_lasts():
    force = np.array([10.0, -5.0, 3.0])
    pushed, free = plant(pushes=[Push(0.002, 0.003, force)]), plant()
    PANDA.update(Q, np.zeros(7))
    gravity = np.array(PANDA.gravity)
    for tick in range(8):
        t = tick * 1e-3
        PANDA.update(free.q, free.v)
        J = PANDA.jacobian(PANDA.frame_id(PANDA.tool))[:3]
        extra = J.T @ force if 0.0019 < t < 0.0049 else 0.0
        free.advance(gravity + extra)
        pushed.advance(gravity)
        assert np.allclose(pushed.q, free.q, rtol=0.0, atol=1e-12)
    assert np.linalg.norm(pushed.v) > 1e-3


def test_a_run_with_everything_wrong_is_recorded_with_its_truth_and_replays(tmp_path):
    scenario = short(
        mass_error=0.2, dry_friction=0.01, delay=0.001, position_noise=1e-4, velocity_noise=1e-3,
        pushes=[{"at": 0.1, "duration": 0.05, "force": [0.0, 10.0, 0.0]}],
    )  # fmt: skip
    run_scenario(scenario, tmp_path / "a")
    run_scenario(scenario, tmp_path / "b")
    recording = load(tmp_path / "a")
    assert (tmp_path / "a/data.f64").read_bytes() == (tmp_path / "b/data.f64").read_bytes()
    gap = recording.group("q") - recording.group("true/q")
    assert np.allclose(gap.std(), 1e-4, rtol=0.1)
    assert replay(tmp_path / "a").gap == 0.0


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ({"mass_error": 1.0}, "mass_error"),
        ({"delay": -1.0}, "delay"),
        ({"position_noise": np.nan}, "position_noise"),
    ],
)
def test_unusable_numbers_are_named(given, word):
    with pytest.raises(osc.InputError, match=word):
        Disturbances(**given)


def test_a_push_needs_a_force_of_three_numbers():
    with pytest.raises(osc.InputError, match="3 finite numbers"):
        Push(0.0, 1.0, [1.0, 2.0])


def test_friction_of_a_robot_without_torque_limits_is_refused_by_its_key(tmp_path):
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="arm"><link name="a"/><link name="b"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/></joint></robot>'
    )
    data = {
        "robot": str(urdf),
        "duration": 0.1,
        "tasks": {"posture": {"type": "posture", "level": 1}},
        "plant": {"dry_friction": 0.1},
    }
    with pytest.raises(osc.ScenarioError, match=r"plant.*torque limit"):
        run_scenario(scenario_from(data), tmp_path / "run")
