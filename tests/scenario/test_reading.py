"""A scenario says the same after it was written and read again."""

import inspect
from pathlib import Path

import pytest
from hypothesis import given

from opspace import tasks
from opspace.errors import ScenarioError, UnknownNameError
from opspace.law import PROFILES
from opspace.robots.registry import BACKENDS
from opspace.scenario import (
    Scenario,
    dump_scenario,
    load_scenario,
    scenario_from,
    schema,
    shipped_scenarios,
    to_dict,
)
from opspace.scenario.document import parse
from opspace.scenario.task_entries import ENTRIES
from opspace.stack.groups import RULES
from tests.scenario.examples import EVERYTHING, STANDING, scenarios

TASKS = {
    "position": (ENTRIES["position"], tasks.PositionTask),
    "orientation": (ENTRIES["orientation"], tasks.OrientationTask),
    "pose": (ENTRIES["pose"], tasks.PoseTask),
    "posture": (ENTRIES["posture"], tasks.PostureTask),
    "joint": (ENTRIES["joint"], tasks.JointTask),
    "angular_momentum": (ENTRIES["angular_momentum"], tasks.AngularMomentumTask),
    "com": (ENTRIES["com"], tasks.ComTask),
    "relative_position": (ENTRIES["relative_position"], tasks.RelativePositionTask),
    "relative_orientation": (ENTRIES["relative_orientation"], tasks.RelativeOrientationTask),
    "relative_pose": (ENTRIES["relative_pose"], tasks.RelativePoseTask),
    "force": (ENTRIES["force"], tasks.ForceTask),
    "impedance": (ENTRIES["impedance"], tasks.ImpedanceTask),
}
NOT_ARGUMENTS = {"type", "level", "present", "activation", "give_way"}


def saved(directory, text, name="my.yaml"):
    path = directory / name
    path.write_text(text, encoding="utf-8")
    return path


def same(first, second):
    """Equal, and of equal types: true is not 1 and 1 is not 1.0."""
    return first == second and repr(first) == repr(second)


@given(scenarios())
def test_a_scenario_survives_writing_and_reading(data):
    scenario = scenario_from(data)
    assert same(scenario_from(to_dict(scenario)), scenario)
    assert same(scenario_from(parse(dump_scenario(scenario)).data), scenario)


@pytest.mark.parametrize("name", shipped_scenarios())
def test_every_shipped_scenario_loads(tmp_path, name):
    scenario = load_scenario(name)
    assert scenario.description
    assert same(load_scenario(saved(tmp_path, dump_scenario(scenario))), scenario)


def test_both_experiments_of_the_paper_are_shipped():
    assert {"singularity", "joint-limit"} <= set(shipped_scenarios())


def test_everything_can_be_said(tmp_path):
    found = [load_scenario(saved(tmp_path, text)) for text in (EVERYTHING, STANDING)]
    assert {task.type for scenario in found for task in scenario.tasks.values()} == set(TASKS)
    said = {field for scenario in found for field in scenario.model_fields_set}
    assert set(Scenario.model_fields) == said
    for scenario in found:
        assert same(load_scenario(saved(tmp_path, dump_scenario(scenario))), scenario)


def test_numbers_are_read_as_people_write_them(tmp_path):
    scenario = load_scenario(saved(tmp_path, EVERYTHING))
    assert scenario.duration == 10.0
    assert scenario.dt == 0.002
    assert scenario.tasks["reach"].kp == (100.0, 200.0)


def test_a_scenario_cannot_be_changed(tmp_path):
    scenario = load_scenario(saved(tmp_path, EVERYTHING))
    with pytest.raises(ValueError, match="frozen"):
        scenario.duration = 5.0


@pytest.mark.parametrize("kind", TASKS)
def test_keys_and_defaults_are_those_of_the_constructor(kind):
    entry, task = TASKS[kind]
    arguments = inspect.signature(task).parameters
    fields = dict(entry.model_fields)
    assert set(fields) - NOT_ARGUMENTS == set(arguments) - {"name"}
    for key in set(fields) - NOT_ARGUMENTS:
        default = arguments[key].default
        if default is inspect.Parameter.empty:
            # frame of a relative task: the file may leave out what stands for the robot's tool.
            assert fields[key].is_required() or fields[key].default is None
        else:
            assert fields[key].default == default


NOT_IN_FILES: set[type[tasks.Task]] = set()


def test_every_task_is_known_to_the_schema():
    known = {task for _, task in TASKS.values()}
    offered = {
        item
        for item in vars(tasks).values()
        if inspect.isclass(item) and issubclass(item, tasks.Task) and not inspect.isabstract(item)
    }
    assert offered - NOT_IN_FILES == known


def choices(model, key):
    return model.model_fields[key].annotation.__args__


def test_choices_are_those_of_the_library():
    assert choices(schema.Scenario, "blending") == tuple(RULES)
    assert choices(schema.Scenario, "backend") == BACKENDS
    assert choices(schema.SingularityEntry, "profile") == PROFILES


def entries(model):
    for child in model.__subclasses__():
        yield child
        yield from entries(child)


def test_every_key_is_described():
    found = list(entries(schema.Entry))
    assert len(found) > 20
    for model in found:
        for key, field in model.model_fields.items():
            assert field.description, f"{model.__name__}.{key}"


# -- where a scenario comes from ------------------------------------------------------------------


def test_an_unknown_name_lists_the_shipped_ones():
    with pytest.raises(UnknownNameError, match=r"did you mean 'singularity'.*valid: .*\.yaml"):
        load_scenario("singularty")


@pytest.mark.parametrize("source", ["absent.yaml", "./absent", Path("absent")])
def test_a_missing_file_is_named(source):
    with pytest.raises(ScenarioError, match=r"absent.*No such file"):
        load_scenario(source)


def test_a_robot_file_is_found_beside_the_scenario(tmp_path, monkeypatch):
    path = saved(tmp_path, EVERYTHING.replace("puma560", "arm/my.urdf"))
    assert load_scenario(path).robot == str(tmp_path / "arm" / "my.urdf")
    monkeypatch.chdir(tmp_path)
    assert load_scenario("my.yaml").robot == str(tmp_path / "arm" / "my.urdf")


def test_a_robot_file_of_an_override_is_found_from_here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("singularity", ["robot=my.xml"])
    assert scenario.robot == str(tmp_path / "my.xml")
    assert load_scenario("singularity", ["robot=/arms/my.xml"]).robot == "/arms/my.xml"
