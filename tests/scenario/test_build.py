"""A scenario becomes exactly the objects that it describes."""

import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace
import opspace.sim
import opspace.tasks
from opspace.errors import ScenarioError
from opspace.law import PROFILES
from opspace.robots import load_robot
from opspace.scenario import load_scenario, scenario_from, schema
from opspace.scenario.build import build
from opspace.scenario.build_tasks import build_tasks
from opspace.scenario.document import parse
from opspace.scenario.task_entries import ENTRIES
from opspace.tasks import TASK_KINDS
from tests.scenario.examples import EVERYTHING
from tests.scenario.short import HOLD, short

ROBOT = load_robot("puma560")
HOME = ROBOT.configurations["home"]


def defaults(callable_):
    """Name and default of every parameter; None where one must be given."""
    found = inspect.signature(callable_).parameters.values()
    return {p.name: None if p.default is p.empty else p.default for p in found}


def entry_defaults(entry):
    return {
        key: field.get_default(call_default_factory=True)
        for key, field in entry.model_fields.items()
        if not field.is_required()
    }


# -- one default in two places ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "built"),
    [
        (schema.SingularityEntry, opspace.Singularity),
        (schema.JointLimitsEntry, opspace.tasks.JointLimits),
        (schema.PlantEntry, (opspace.sim.Plant, opspace.sim.Disturbances)),
        (schema.StopEntry, opspace.loop.StopRule),
        *((ENTRIES[name], kind.task) for name, kind in TASK_KINDS.items()),
    ],
)
def test_the_schema_has_the_defaults_of_what_is_built(entry, built):
    parts = built if isinstance(built, tuple) else (built,)
    wanted = {key: value for part in parts for key, value in defaults(part).items()}
    given_ = entry_defaults(entry)
    for of_the_stack in ("target", "present", "activation", "give_way"):
        given_.pop(of_the_stack, None)
    assert given_
    for key, value in given_.items():
        # A scenario says null or {} where the constructor has None.
        assert value == wanted[key] or (not value and wanted[key] in (None, ())), key


def test_every_profile_of_the_law_can_be_written():
    for profile in PROFILES:
        assert short(f"joint_limits.profile={profile}").joint_limits.profile == profile


# -- what is built ---------------------------------------------------------------------------------


def test_a_scenario_that_uses_everything_is_built_and_steps():
    built = build(scenario_from(parse(EVERYTHING).data, ["plant.torque_limits=true"]))
    command = built.controller.step(
        0.0, built.plant.q, built.plant.v, wrenches=built.plant.wrenches()
    )
    assert set(command.tasks) | {"rest"} == set(built.tasks) == set(built.scenario.tasks)
    assert np.isfinite(command.tau).all()
    assert built.plant.dt == built.scenario.dt
    assert built.stop.max_torque == 500


def test_a_tick_is_simulated_in_as_many_steps_as_the_scenario_says():
    plant = build(short("plant={substeps: 20}")).plant
    assert plant.dt == 0.001
    assert plant.model.opt.timestep == pytest.approx(0.001 / 20)
    with pytest.raises(ScenarioError, match=r"plant.*at least one step.*not 0"):
        build(short("plant={substeps: 0}"))


def test_levels_stand_in_the_order_of_their_numbers():
    tasks = {
        "low": {"type": "posture", "level": 7},
        "top": {"type": "orientation", "level": 1},
        "beside": {"type": "joint", "joint": "joint1", "level": 1},
    }
    levels = build(short(tasks=tasks)).stack.levels
    assert [[task.name for task in level] for level in levels] == [["top", "beside"], ["low"]]


@pytest.mark.parametrize("method", ["transition", "switch", "none"])
def test_a_method_changes_profiles_and_nothing_else(method):
    built = build(short(f"method={method}", "singularity.profile=cubic"))
    limits, singularity = built.stack.limits, built.controller.singularity
    if method == "none":
        assert limits is singularity is None
        return
    expected = ("cubic", "quintic") if method == "transition" else ("step", "step")
    assert (singularity.profile, limits.profile) == expected
    assert (singularity.lower, singularity.upper) == (0.05, 0.7)


def test_tasks_find_the_start_and_ask_for_nothing():
    built = build(short("tasks.position.target=null", "start=home"))
    command = built.controller.step(0.0, HOME, np.zeros(6))
    for task in command.tasks.values():
        assert task.error_norm < 1e-9


# -- references ------------------------------------------------------------------------------------

GONE = {"out_duration": 0.3, "hold_duration": 0.1, "back_duration": 0.2, "start_time": 0.1}
POSITION_TARGETS = {
    "minimum_jerk": {"offset": [0.1, 0.0, 0.2], "duration": 1.0, "start_time": 0.1},
    "jerk_limited": {
        "goal": [0.5, 0.0, 0.9],
        "max_velocity": 1.0,
        "max_acceleration": 5.0,
        "max_jerk": 50.0,
    },
    "out_and_back": {"offset": [0.1, 0.1, 0.0], **GONE},
    "swing": {"angle": 4.0, "center": [0.0, 0.0, 0.5], "axis": [0.0, 0.6, 0.8], **GONE},
    "via_points": {"times": [0.5, 1.0], "offsets": [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]},
    "circle": {"radius": 0.2, "period": 1.0, "normal": [0.0, 1.0, 0.2]},
}


def entries():
    """A task for every kind of reference."""
    turn = {"type": "out_and_back", "offset": [0.5, -0.5, 1.0], **GONE}
    tasks = {
        name: {"type": "position", "level": 0, "target": {"type": name, **target}}
        for name, target in POSITION_TARGETS.items()
    }
    tasks["turn"] = {"type": "orientation", "level": 0, "target": turn}
    tasks["com"] = {**tasks["out_and_back"], "type": "com"}
    tasks["away"] = {
        **tasks["out_and_back"],
        "type": "relative_position",
        "frame": "link6",
        "reference_frame": "link3",
    }
    tasks["joints"] = {
        "type": "posture",
        "level": 0,
        "joints": ["joint2", "joint1"],
        "target": {"type": "minimum_jerk", "goal": "vertical", "duration": 1.0},
    }
    return tasks


ENTRIES = entries()


def task_at_home(name, **entry):
    """A task as it is built, the robot at home."""
    ROBOT.update(HOME, np.zeros(6))
    tasks = {name: entry or ENTRIES[name]}
    return build_tasks(short(tasks=tasks), ROBOT)[name]


RETURNING = ("out_and_back", "swing", "turn", "com", "away")


@pytest.mark.parametrize("name", ENTRIES)
def test_every_reference_begins_where_the_robot_is(name):
    task = task_at_home(name)
    terms = task.evaluate(ROBOT, 0.0)
    np.testing.assert_allclose(terms.error, 0.0, atol=1e-12)
    sample = task.target(0.0)
    np.testing.assert_allclose([sample.v, sample.a], 0.0, atol=1e-12)


@pytest.mark.parametrize("name", RETURNING)
def test_what_goes_out_comes_back(name):
    target = task_at_home(name).target
    np.testing.assert_allclose(target(5.0).x, target(0.0).x, atol=1e-12)
    assert np.abs(target(0.45).x - target(0.0).x).max() > 0.05
    np.testing.assert_allclose(target(0.45).v, 0.0, atol=1e-12)


@given(st.floats(0.0, 1.0))
def test_a_swing_keeps_its_distance_and_tells_its_rates(t):
    swing, axis = task_at_home("swing").target, np.array([0.0, 0.6, 0.8])
    center, step = np.array([0.0, 0.0, 0.5]), 1e-5
    x, start = swing(t).x - center, swing(0.0).x - center
    assert np.isclose(np.linalg.norm(x), np.linalg.norm(start))
    assert np.isclose(x @ axis, start @ axis)
    around = [swing(t + k * step) for k in (-1, 0, 1)]
    velocity = (around[2].x - around[0].x) / (2 * step)
    acceleration = (around[2].v - around[0].v) / (2 * step)
    np.testing.assert_allclose(velocity, around[1].v, atol=1e-5)
    np.testing.assert_allclose(acceleration, around[1].a, atol=0.05)


def test_a_swing_turns_by_its_angle():
    swing = {"type": "swing", "angle": np.pi / 2, "center": [0.0, 0.0, 0.0], **GONE}
    target = task_at_home("quarter", type="position", level=0, target=swing).target
    (x, y, z), far = target(0.0).x, target(0.45).x
    np.testing.assert_allclose(far, [-y, x, z], atol=1e-12)


def test_a_circle_passes_through_the_start_at_its_radius():
    circle, normal = task_at_home("circle").target, np.array([0.0, 1.0, 0.2])
    start = circle(0.0).x
    points = np.array([circle(t).x for t in np.linspace(0.0, 3.0, 200)])
    assert np.allclose((points - start) @ normal, 0.0)
    assert np.isclose(np.linalg.norm(points - start, axis=1).max(), 0.4, atol=1e-3)


# -- what does not fit the robot -------------------------------------------------------------------


def refused(tmp_path, key, value):
    """The error about one changed value, from a file."""
    path = tmp_path / "my.yaml"
    text = (
        "robot: puma560\nstart: home\nduration: 1\njoint_limits:\n  joints: {joint1: [-1, 1]}\n"
        "tasks:\n  reach:\n    type: position\n    level: 0\n    frame: tool\n    target: null\n"
        "  rest:\n    type: posture\n    level: 1\n    joints: [joint1]\n    target: home\n"
        "  turn:\n    type: orientation\n    level: 1\n    target: null\n"
    )
    path.write_text(text, encoding="utf-8")
    build(load_scenario(path))
    changed = text.replace(key, value)
    assert changed != text
    path.write_text(changed, encoding="utf-8")
    with pytest.raises(ScenarioError) as raised:
        build(load_scenario(path))
    error = raised.value
    assert str(error).startswith(f"{path}:{error.line}: ")
    assert "\n" not in str(error)
    assert any(
        before != after and error.line == i
        for i, (before, after) in enumerate(
            zip(text.splitlines(), changed.splitlines(), strict=True), 1
        )
    )
    return error


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("puma560", "puma650", "robot", "did you mean 'puma560'"),
        ("frame: tool", "frame: toll", "tasks.reach.frame", "did you mean 'tool'"),
        ("[joint1]", "[joint7]", "tasks.rest.joints[0]", "valid: joint1, joint2"),
        ("{joint1:", "{join1:", "joint_limits.joints", "did you mean 'joint1'"),
        ("start: home", "start: hom", "start", "did you mean 'home'"),
        ("start: home", "start: [0, 1]", "start", "must have 6 numbers"),
        ("target: home", "target: hom", "tasks.rest.target", "did you mean 'home'"),
        ("target: home", "target: [0, 1]", "tasks.rest.target", "not 2 numbers"),
        (
            "level: 1\n    target: null",
            "level: 1\n    target: {type: minimum_jerk, offset: [0, 0, 4], duration: 1}",
            "tasks.turn.target",
            "less than half a turn",
        ),
    ],
)
def test_what_the_robot_does_not_have_is_named_with_its_line(tmp_path, old, new, key, words):
    error = refused(tmp_path, old, new)
    assert error.key == key
    assert words in str(error)


def test_without_a_file_the_key_is_named():
    tasks = {**HOLD["tasks"], "position": {"type": "position", "level": 1, "frame": "toll"}}
    with pytest.raises(ScenarioError, match=r"^scenario: tasks\.position\.frame: unknown frame"):
        build(short(tasks=tasks))
