"""`--set` reaches every value, is checked like the file, and is named when it is to blame."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import ScenarioError
from opspace.scenario import load_scenario
from opspace.scenario.document import Document, key_text, parse, to_yaml
from opspace.scenario.overrides import apply_overrides
from tests.scenario.examples import EVERYTHING
from tests.scenario.test_errors import KEYS, at


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text(EVERYTHING, encoding="utf-8")
    return file


def set_in(data, *overrides):
    return apply_overrides(Document(None, data, {}), overrides).data


@pytest.mark.parametrize("key", [key for key in KEYS if key], ids=key_text)
def test_every_value_can_be_reached(key):
    data = parse(EVERYTHING).data
    changed = set_in(data, f"{key_text(key)}=[new]")
    assert at(changed, key) == ["new"]
    assert at(data, key) == KEYS[key]


@given(st.lists(st.text(min_size=1), min_size=1), st.text())
def test_any_key_and_text_can_be_set(keys, value):
    """Nothing on the way has to be there."""
    override = f"{key_text(tuple(keys))}={to_yaml([value])[2:]}"
    assert at(set_in({}, override), keys) == value


def test_values_are_read_as_in_the_file(path):
    scenario = load_scenario(
        path,
        [
            "tasks.reach.kp=2e2",
            "tasks.reach.target[2]=1",
            "tasks.turn={type: orientation, level: 4}",
            "tasks.reach.max_speed=",
            "singularity=null",
            "singularity.lower=0.05",
            'joint_limits.joints."arm.1"=[-1, 1]',
        ],
    )
    assert scenario.tasks["reach"].kp == 200.0
    assert scenario.tasks["reach"].target == (0.4, 0.1, 1.0)
    assert scenario.tasks["reach"].max_speed is None
    assert scenario.tasks["turn"].level == 4
    assert scenario.singularity is not None
    assert scenario.singularity.lower == 0.05
    assert scenario.joint_limits is not None
    assert scenario.joint_limits.joints["arm.1"] == (-1.0, 1.0)


def test_the_last_of_two_overrides_counts(path):
    assert load_scenario(path, ["seed=1", "seed=2"]).seed == 2


@pytest.mark.parametrize(
    ("override", "key", "says"),
    [
        ("tasks.reach.kp=-3", "tasks.reach.kp", "not -3"),
        ("tasks.reach.kpp=3", "tasks.reach.kpp", "did you mean 'kp'"),
        ("tasks.reach={}", "tasks.reach.type", "is missing"),
        ("tasks.reach.target[0]=.nan", "tasks.reach.target[0]", "a number [m], not .nan"),
        ("duration=", "duration", "not null"),
        ("tasks.reach.target[3]=1", "tasks.reach.target[3]", "has entries [0] to [2]"),
        ("tasks[0]=1", "tasks[0]", "tasks is not a list"),
        ("duration.x=1", "duration.x", "duration is not a mapping"),
        ("tasks.reach.target.x=1", "tasks.reach.target.x", "not a mapping"),
    ],
)
def test_a_wrong_override_is_named_in_place_of_a_line(path, override, key, says):
    with pytest.raises(ScenarioError) as raised:
        load_scenario(path, [override])
    error = raised.value
    assert (error.key, error.line) == (key, None)
    assert f"--set {override}" in str(error)
    assert says in str(error)


def test_an_override_inside_a_wrong_value_is_named_beside_the_line(path):
    with pytest.raises(ScenarioError) as raised:
        load_scenario(path, ["joint_limits.joints.joint1[0]=1"])
    assert raised.value.key == "joint_limits.joints.joint1"
    assert raised.value.line is not None
    assert "--set joint_limits.joints.joint1[0]=1" in str(raised.value)


def test_an_override_is_not_blamed_for_the_file(path):
    path.write_text(EVERYTHING.replace("level: 2", "level: two"), encoding="utf-8")
    with pytest.raises(ScenarioError) as raised:
        load_scenario(path, ["tasks.reach.kp=5"])
    assert raised.value.key == "tasks.turn.level"
    assert raised.value.line is not None
    assert "--set" not in str(raised.value)


@pytest.mark.parametrize("override", ["", "a", "=1", "a.=1", ".a=1", "a b=1", 'a."b=1', "a[x]=1"])
def test_what_is_no_override_is_refused(path, override):
    with pytest.raises(ScenarioError, match=r"--set .*must be key=value, for example"):
        load_scenario(path, [override])


def test_a_value_that_is_no_yaml_is_refused(path):
    with pytest.raises(ScenarioError, match=r"^--set seed=\[: the value cannot be read as YAML$"):
        load_scenario(path, ["seed=["])
