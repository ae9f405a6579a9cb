"""TSID drives the humanoid: the same plant, tasks and gains, changed as it offers."""

import importlib.util

import numpy as np
import pytest

from opspace import EdgeContact, PointContact, PositionTask
from opspace.command import Status
from opspace.compare import METHODS
from opspace.compare.humanoid import VARIANTS, usable_variants
from opspace.compare.methods import methods_left_out
from opspace.compare.tsid_model import tsid_installed
from opspace.errors import InputError
from opspace.plots.contact_figure import COLORS, TITLES
from opspace.scenario import load_scenario
from opspace.scenario.build import build
from opspace.tasks.rotation import skew

needs_tsid = pytest.mark.skipif(not tsid_installed(), reason="needs TSID's Python package")
HAND = "right_rubber_hand"


def standing():
    return build(load_scenario("humanoid"), METHODS["tsid"].controller)


def steps(built, times, q=None, v=None):
    q = built.plant.q if q is None else q
    v = built.plant.v if v is None else v
    return [built.controller.step(t, q, v) for t in times]


def test_it_is_left_out_and_refused_with_what_to_install(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert "tsid" not in usable_variants()
    assert "tsid" in methods_left_out(load_scenario("humanoid"))
    assert VARIANTS["tsid"].needs.startswith("pip install tsid==")
    with pytest.raises(InputError, match="needs TSID's Python package: pip install tsid=="):
        steps(standing(), [0.0])


def test_a_folder_of_its_name_is_not_the_package(monkeypatch, tmp_path):
    before = tsid_installed()
    (tmp_path / "tsid").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    assert importlib.util.find_spec("tsid") is not None
    assert tsid_installed() == before


def test_every_variant_can_be_drawn():
    assert set(VARIANTS) == set(COLORS) == set(TITLES)
    assert len(set(COLORS.values())) == len(COLORS)


def test_a_package_that_does_not_import_is_told(monkeypatch):
    def broken(name):
        raise ImportError(f"no symbol in {name}")

    monkeypatch.setattr("opspace.compare.tsid_model.tsid_installed", lambda: True)
    monkeypatch.setattr("opspace.compare.tsid_model.importlib.import_module", broken)
    with pytest.raises(InputError, match="does not import: no symbol"):
        steps(standing(), [0.0])


def acceleration(robot, command, contacts):
    """What torque and forces of a command do, M q̈ = τ + Σ Jᵀ λ − b by the library's own model."""
    pushed = command.tau - robot.bias
    for contact in contacts.values():
        told = command.contacts[contact.name]
        frame = robot.frame_id(contact.frame)
        J, arm = robot.jacobian(frame), robot.rotation(frame) @ contact.offset
        pushed = pushed + (J[:3] - skew(arm) @ J[3:]).T @ told.force + J[3:].T @ told.moment
    return np.linalg.solve(robot.M, pushed)


def weighted(terms, weights, held):
    """Accelerations that minimise Σ w ‖J q̈ + J̇ q̇ − f*‖² among those that contacts leave, J q̈ = γ."""
    J = np.concatenate([one.J for one in held])
    start = np.linalg.pinv(J) @ np.concatenate([one.acceleration for one in held])
    free = np.linalg.svd(J)[2][np.linalg.matrix_rank(J) :].T
    rows = np.concatenate([w**0.5 * one.J for w, one in zip(weights, terms, strict=True)])
    wanted = np.concatenate(
        [w**0.5 * (one.acceleration - one.drift) for w, one in zip(weights, terms, strict=True)]
    )
    return start + free @ np.linalg.lstsq(rows @ free, wanted - rows @ start)[0]


@needs_tsid
@pytest.mark.parametrize("seed", range(4))
def test_without_limits_it_finds_the_least_of_the_weighted_squares(seed, monkeypatch):
    """Its torque and forces do in our model what the gains ask for, each task by its weight."""
    monkeypatch.setattr("opspace.compare.tsid_on_contacts.FREE_FORCE", 1e-9)
    built, rng = standing(), np.random.default_rng(seed)
    robot, q, v = built.controller.robot, built.plant.q.copy(), built.plant.v.copy()
    feet = {name: built.contacts[name] for name in ("left", "right")}
    built.controller.step(0.0, q, v)
    q[7:] += 0.002 * rng.normal(size=q.size - 7)
    robot.update(q, v)
    J = np.concatenate([contact.evaluate(robot).J for contact in feet.values()])
    v = 0.02 * rng.normal(size=v.size)
    v -= np.linalg.pinv(J) @ J @ v  # TSID takes the drift of a foot that moves otherwise
    command = built.controller.step(0.001, q, v)
    assert Status.FAULT not in command.status
    assert all(0.0 < contact.cone_use < 0.99 for contact in command.contacts.values())
    found = acceleration(robot, command, feet)
    held = [contact.evaluate(robot) for contact in feet.values()]
    for terms in held:
        np.testing.assert_allclose(terms.J @ found, terms.acceleration, atol=1e-6)
    asked = [
        (m.level, m.task.evaluate(robot, 0.001)) for m in built.controller.stack.begin_tick(0.001)
    ]
    weights = [max(10.0**-level, 1e-3) for level, _ in asked]
    best = weighted([terms for _, terms in asked], weights, held)
    np.testing.assert_allclose(found, best, atol=1e-3)
    com = built.tasks["com"].evaluate(robot, 0.001)
    error = com.J @ found + com.drift - com.acceleration
    assert np.linalg.norm(error) < 0.1 * np.linalg.norm(com.acceleration)


@needs_tsid
def test_a_task_comes_at_once_whatever_duration_is_asked():
    torques = []
    for duration in (0.0, 0.5):
        built = standing()
        before = steps(built, [0.0, 0.001])[-1]
        hand = PositionTask(HAND, np.array([0.19, -0.14, 0.73]), name="new")
        built.controller.stack.insert(hand, level=0.5, duration=duration)
        after = steps(built, [0.002, 0.003])
        assert np.abs(after[0].tau - before.tau).max() > 1.0
        torques.append([command.tau for command in after])
    np.testing.assert_array_equal(*torques)


@needs_tsid
def test_the_largest_force_of_a_contact_that_goes_is_lowered_over_the_duration():
    built = standing()
    begin = steps(built, [0.0, 0.001])[-1].contacts["right"].force[2]
    built.controller.stack.remove("right", 0.1, wait=False)
    times = 0.002 + 0.001 * np.arange(100)
    forces = [command.contacts["right"].force[2] for command in steps(built, times)]
    most = begin * (1.0 - (times - times[0]) / 0.1)
    assert forces[0] == pytest.approx(begin, rel=0.05)
    assert np.all(forces <= most + 0.01)
    (gone,) = steps(built, [0.2])
    assert "right" not in gone.contacts
    # One that comes back is there at once, and stays when the time of the ramp is over.
    built.controller.stack.insert(built.contacts["right"], 0.3)
    built_up = steps(built, [0.201, 0.3, 0.6])
    assert all(command.contacts["right"].force[2] > 10.0 for command in built_up)


@needs_tsid
@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda stack: stack.insert(PositionTask(HAND, ki=1.0, name="sum"), level=4), "'sum'"),
        (
            lambda stack: stack.insert(PositionTask(HAND, max_speed=1.0, name="slow"), level=4),
            "'slow'",
        ),
        (
            lambda stack: stack.insert(PointContact(HAND, offset=(0.1, 0.0, 0.0), name="tip")),
            "'tip'",
        ),
        (lambda stack: stack.insert(EdgeContact(HAND, half=0.1, name="rail")), "'rail'"),
    ],
)
def test_what_tsid_has_no_equal_of_is_refused_by_name(change, named):
    built = standing()
    change(built.controller.stack)
    with pytest.raises(InputError, match=f"the method tsid .*{named}"):
        steps(built, [0.0])
