"""Whatever is wrong in a scenario is reported with file, line, key and what would be right."""

import copy
import math
import tempfile
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import ScenarioError
from opspace.scenario import load_scenario, scenario_from
from opspace.scenario.document import key_text, parse, to_yaml
from tests.scenario.examples import EVERYTHING

DATA = parse(EVERYTHING).data
NAMED = {
    ("tasks",),
    ("locked",),
    ("reference",),
    ("frames",),
    ("joint_limits", "joints"),
    ("collisions", "obstacles"),
}
"""Mappings whose keys are names of the user's."""


def walk(data, key=()):
    yield key, data
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for part, value in pairs:
        if isinstance(value, dict | list):
            yield from walk(value, (*key, part))
        else:
            yield (*key, part), value


KEYS = dict(walk(DATA))


def at(data, key):
    for part in key:
        data = data[part]
    return data


def refused(text, *overrides):
    """The error about a text, which names its file on one line."""
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "my.yaml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ScenarioError) as raised:
            load_scenario(path, overrides)
    error = raised.value
    assert "\n" not in str(error)
    if not overrides:
        assert str(error).startswith(str(path))
    return error


def line_of(text, mark):
    (line,) = (i for i, line in enumerate(text.splitlines(), 1) if mark in line)
    return line


def changed(key, value):
    data = copy.deepcopy(DATA)
    at(data, key[:-1])[key[-1]] = value
    # Block style puts every key on a line of its own.
    return to_yaml(data)


# -- every key and every value --------------------------------------------------------------------


@pytest.mark.parametrize(
    "key",
    [key for key, value in KEYS.items() if isinstance(value, dict) and key not in NAMED],
    ids=key_text,
)
def test_an_unknown_key_is_refused_everywhere(key):
    text = changed((*key, "kpp"), 1.0)
    error = refused(text)
    assert error.key == key_text((*key, "kpp"))
    assert error.line == line_of(text, "kpp")
    assert "unknown key" in str(error)
    assert "valid: " in str(error)


@pytest.mark.parametrize(
    "key",
    [
        key
        for key, value in KEYS.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    ],
    ids=key_text,
)
def test_only_finite_numbers_are_numbers(key):
    for bad in (math.nan, math.inf, -math.inf, 10**400, "text", True, None):
        data = copy.deepcopy(DATA)
        at(data, key[:-1])[key[-1]] = bad
        if bad is not None or isinstance(key[-1], int):
            with pytest.raises(ScenarioError, match="must be ") as raised:
                scenario_from(data)
            assert raised.value.key == key_text(key)
    text = changed(key, "BAD").replace("BAD", ".nan")
    error = refused(text)
    assert error.key == key_text(key)
    assert error.line == line_of(text, ".nan")


@pytest.mark.parametrize(
    "key",
    [key for key, value in KEYS.items() if key and key[:-1] not in NAMED],
    ids=key_text,
)
def test_no_value_may_be_of_another_kind(key):
    """A mapping with an odd key stands for nothing that a scenario knows."""
    error = refused(changed(key, {"odd": {"odd": {}}}))
    assert error.key.startswith(key_text(key[:-1]))
    assert error.line is not None


@pytest.mark.parametrize("key", [("robot",), ("duration",), ("tasks",)], ids=key_text)
def test_a_missing_key_is_named(key):
    data = copy.deepcopy(DATA)
    del data[key[0]]
    error = refused(to_yaml(data))
    assert error.key == key[0]
    assert "is missing (" in str(error)


@given(st.text())
def test_any_text_is_read_or_refused_on_one_line(text):
    said = "my.yaml"
    try:
        parse(text, "my.yaml")
    except ScenarioError as error:
        said = str(error)
    assert said.startswith("my.yaml")
    assert len(said.splitlines()) == 1


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    )
)
def test_plain_values_survive_yaml(value):
    read = parse(to_yaml({"value": value})).data["value"]
    assert repr(read) == repr(value)


@given(st.dictionaries(st.text("ab\n", min_size=1), st.lists(st.integers()) | st.integers()))
def test_each_key_is_on_the_line_that_is_reported(data):
    """PyYAML's own marks count from zero."""
    text = yaml.safe_dump({"top": data})
    origins = parse(text).origins
    root = yaml.compose(text).value[0][1]
    for name, node in root.value if isinstance(root, yaml.MappingNode) else ():
        assert origins["top", name.value] == name.start_mark.line + 1
        if isinstance(node, yaml.SequenceNode):
            for i, item in enumerate(node.value):
                assert origins["top", name.value, i] == item.start_mark.line + 1


# -- particular mistakes --------------------------------------------------------------------------

MISTAKES = [
    ("kp: [100, 200]", "kp: [100, 200, 300]", "tasks.reach.kp", "list of 2 numbers, not 3"),
    ("kp: [100, 200]", "kp: -1", "tasks.reach.kp", "at least 0 [1/s²], not -1"),
    ("max_speed: 0.5", "max_speed: 0", "tasks.reach.max_speed", "above 0 [m/s], not 0"),
    ("axes: xz", "axes: xx", "tasks.reach.axes", "letters xyz, each once, not 'xx'"),
    ("axes: xz", "axes: ''", "tasks.reach.axes", "letters xyz"),
    ("axes_frame: tool", "axes_frame: tol", "tasks.reach.axes_frame", "did you mean 'tool'"),
    ("level: 3\n    joints", "level: -1\n    joints", "tasks.rest.level", "not -1"),
    ("level: 3\n    joints", "level: 1.5\n    joints", "tasks.rest.level", "not 1.5"),
    ("type: joint\n", "type: jiont\n", "tasks.wrist.type", "did you mean 'joint'"),
    ("    type: joint\n", "", "tasks.wrist.type", "is missing (valid: position, "),
    ("[0.4, 0.1, 0.9]", "[0.4, 0.1]", "tasks.reach.target", "3 numbers [m]"),
    ("[0, 1, 0, 0]", "[0, 1, 0, 1]", "tasks.turn.target.goal", "norm 1, not 1.41421"),
    ("[0, 1, 0, 0]", "[0, 1, 0, 1e200]", "tasks.turn.target.goal", "norm 1, not 1e+200"),
    ("minimum_jerk", "minimal_jerk", "tasks.turn.target.type", "did you mean 'minimum_jerk'"),
    ("minimum_jerk", "circle", "tasks.turn.target.type", "valid: hold, minimum_jerk, out"),
    ("duration: 2\n", "offset: [0, 0, 1]\n", "tasks.turn.target.duration", "is missing (time"),
    ("duration: 2\n", "duration: 2\n      offset: [0, 0, 1]\n", "tasks.turn.target", "either"),
    ("goal: [0, 1, 0, 0]\n", "{}\n", "", "YAML"),
    ("times: [1, 2]", "times: [2, 1]", "tasks.rest.target.times", "must rise from start_time 0"),
    ("times: [1, 2]", "times: [1, 2, 3]", "tasks.rest.target.points", "as many as times, 3"),
    ("points: [", "offsets: [[1], [2]]\n      points: [", "tasks.rest.target", "either"),
    ("[reference, [0.1, 0.2]]", "[]", "tasks.rest.target.points", "at least one"),
    (
        "[reference, [0.1, 0.2]]",
        "[reference, 3]",
        "tasks.rest.target.points[1]",
        "reference, not 3",
    ),
    ("joints: [joint1, joint2]", "joints: []", "tasks.rest.joints", "at least one"),
    ("joints: [joint1, joint2]", "joints: joint1", "tasks.rest.joints", "a list, not 'joint1'"),
    ("joints: [joint1, joint2]", "joints: [1]", "tasks.rest.joints[0]", "must be text, not 1"),
    ("normal: [0, 1, 0]", "normal: [0, 0, 0]", "tasks.circle.target.normal", "not be zero"),
    ("  circle:", "  a/b:", "tasks.a/b", "without a slash"),
    ("[-0.75, 0.75]", "[0.75, -0.75]", "joint_limits.joints.joint1", "[lower, upper]"),
    ("upper: 0.02", "upper: 0.001", "singularity.upper", "above lower, 0.01, not 0.001"),
    ("friction: true", "friction: yes", "plant.friction", "true or false, not 'yes'"),
    (
        "blending: chain",
        "blending: chian",
        "blending",
        "did you mean 'chain'? (valid: auto, idv, chain, smooth-chain)",
    ),
    ("duration: 1e1", "duration: 3601", "duration", "above 0 and at most 3600 [s], not 3601"),
    ("duration: 1e1", "duration: 1e-3", "dt", "not be longer than the duration, 0.001 s"),
    ("seed: 5", "seed: 5\nseed: 6", "seed", "given twice, first on line 15"),
    ("  wrist:", "  rest:", "tasks.rest", "given twice"),
    ("robot: puma560", "robot: ' '", "robot", "name of a robot"),
    ("  max_torque: 500", "  max_torque: [", "", "YAML"),
    ("  max_torque: 500", "  max_torque: *x", "", "undefined alias"),
    ("  max_torque: 500", "  max_torque: !!python/name:os.system", "stop.max_torque", "tag"),
    ("  max_torque: 500", "  max_torque: &x [*x]", "stop.max_torque[0]", "contains itself"),
    ("  max_torque: 500", "  max_torque: !!int x", "stop.max_torque", "cannot be read as int"),
    ("  max_torque: 500", "  ? [1]\n  : 2", "stop", "not plain text"),
    ("  max_torque: 500", "---\na: 1", "", "another document"),
    ("remove: wrist", "remove: wrsit", "events[3]", "unknown task 'wrsit'; did you mean 'wrist'"),
    (
        "remove: wrist",
        "level: 1",
        "events[3]",
        "exactly one of insert, remove, move, swap, not none",
    ),
    ("remove: wrist", "remove: wrist, move: rest", "events[3]", "not remove and move"),
    ("remove: wrist", "remove: wrist, level: 1", "events[3].level", "remove takes no level"),
    ("move: rest, level: -1", "move: rest", "events[1].level", "is missing (number of the level"),
    ("swap: [rest, reach]", "swap: [rest, rest]", "events[2].swap", "two different tasks"),
    ("at: 0.3", "at: -1", "events[3].at", "at least 0 [s], not -1"),
    ("  max_torque: 500", "  max_torque: \x07", "", "special characters"),
]


@pytest.mark.parametrize(("right", "wrong", "key", "says"), MISTAKES)
def test_a_mistake_is_explained(right, wrong, key, says):
    assert right in EVERYTHING
    text = EVERYTHING.replace(right, wrong, 1)
    error = refused(text)
    assert error.key == key
    assert says in str(error)
    first = EVERYTHING[: EVERYTHING.index(right)].count("\n") + 1
    assert abs(error.line - first) <= 4


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("# nothing\n", "is empty"),
        ("5", "must be a mapping"),
        ("[1, 2]", "must be a mapping"),
        ("[" * 2000, "nested too deeply"),
        ("tasks: {}\nrobot: a\nduration: 1", "tasks: must have at least one task"),
        ("tasks: 5\nrobot: a\nduration: 1", "tasks: must be a mapping (name: value), not 5"),
        ("tasks: {a: 5}\nrobot: a\nduration: 1", "tasks.a: must be a mapping (key: value), not 5"),
    ],
)
def test_what_is_no_scenario_is_refused(text, says):
    assert says in str(refused(text))


def test_a_file_of_another_encoding_is_refused(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_bytes("robot: Müller".encode("latin-1"))
    with pytest.raises(ScenarioError, match="UTF-8"):
        load_scenario(path)


def test_a_short_text_cannot_stand_for_an_endless_one():
    rows = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    assert "more than" in str(refused("\n".join(rows)))


def test_the_first_of_several_mistakes_is_reported():
    text = EVERYTHING.replace("axes: xz", "axes: xx").replace("blending: chain", "blending: x")
    assert refused(text).key == "blending"
