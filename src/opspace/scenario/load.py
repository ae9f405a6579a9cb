"""Reads scenarios: strict, and with every error on one line that says where and what would do."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from opspace.errors import ScenarioError, unknown_name
from opspace.scenario.document import Document, Key, parse, to_yaml
from opspace.scenario.fields import PROBLEM, listed, shown
from opspace.scenario.overrides import apply_overrides
from opspace.scenario.schema import Scenario

SUFFIXES = (".yaml", ".yml")
_ROBOT_SUFFIXES = (".urdf", ".xml")
_LIBRARY = Path(__file__).parent / "library"


def shipped_scenarios() -> tuple[str, ...]:
    """List the scenarios that come with the package."""
    return tuple(sorted(path.stem for path in _LIBRARY.glob("*.yaml")))


def load_scenario(source: str | Path, overrides: Sequence[str] = ()) -> Scenario:
    """Read a scenario from a file or from the package.

    Args:
        source: A path (ending in .yaml or .yml, or with a directory), or a shipped name.
        overrides: Single values to change, each ``key=value`` such as ``tasks.position.kp=200``.

    Returns:
        The scenario. A relative path of a robot is that of the file, or of the working directory
        where it comes from an override, and has become absolute.

    Raises:
        UnknownNameError: There is no such shipped scenario.
        ScenarioError: The file cannot be read, or says something that a scenario cannot say.
    """
    path = _path(source)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"cannot be read: {error.strerror}", file=path) from error
    except UnicodeDecodeError as error:
        raise ScenarioError("is not UTF-8 text", file=path) from error
    document = apply_overrides(parse(text, str(path)), overrides)
    return _validated(_with_robot_path(document, path.parent))


def scenario_from(data: Mapping[str, Any], overrides: Sequence[str] = ()) -> Scenario:
    """Build a scenario from plain values, such as those that ``to_dict`` gives.

    Args:
        data: The values.
        overrides: Single values to change, each ``key=value``.

    Returns:
        The scenario.

    Raises:
        ScenarioError: The values say something that a scenario cannot say.
    """
    return _validated(apply_overrides(Document(None, dict(data), {}), overrides))


def to_dict(scenario: Scenario) -> dict[str, Any]:
    """Write a scenario as plain values with every default filled in.

    Args:
        scenario: The scenario.

    Returns:
        dict, list, str, int, float, bool and None; ``scenario_from`` reads it back.
    """
    return scenario.model_dump(mode="json")


def dump_scenario(scenario: Scenario) -> str:
    """Write a scenario as YAML text with every default filled in.

    Args:
        scenario: The scenario.

    Returns:
        The text; ``load_scenario`` reads a file with it back to an equal scenario.
    """
    return to_yaml(to_dict(scenario))


def _path(source: str | Path) -> Path:
    path = Path(source)
    if isinstance(source, Path) or path.suffix in SUFFIXES or "/" in source or os.sep in source:
        return path
    if source not in shipped_scenarios():
        error = unknown_name("scenario", source, shipped_scenarios())
        raise error.reworded(f"{error}; a scenario file ends in {' or '.join(SUFFIXES)}")
    return _LIBRARY / f"{source}.yaml"


def _with_robot_path(document: Document, directory: Path) -> Document:
    if not isinstance(document.data, dict) or not isinstance(document.data.get("robot"), str):
        return document
    robot = Path(document.data["robot"])
    if robot.suffix not in _ROBOT_SUFFIXES:
        return document
    base = Path() if isinstance(document.origins.get(("robot",)), str) else directory
    absolute = str((base / robot.expanduser()).absolute())
    return Document(document.file, {**document.data, "robot": absolute}, document.origins)


def _validated(document: Document) -> Scenario:
    try:
        return Scenario.model_validate(document.data).read_from(document)
    except ValidationError as error:
        problems = [_located(details) for details in error.errors(include_url=False)]
    # The one that stands first in the file; those of overrides have no line and come last.
    errors = [document.error(key, message) for key, message in problems]
    raise min(errors, key=lambda e: (e.line is None, e.line or 0)) from None


def _located(details: ErrorDetails) -> tuple[Key, str]:
    """Tell key and message of one of pydantic's errors."""
    # Names in angle brackets are kinds of entries, not keys: see tag_of.
    key: Key = tuple(
        part for part in details["loc"] if not (isinstance(part, str) and part[:1] == "<")
    )
    context, value = details.get("ctx", {}), details["input"]
    kind = details["type"]
    if kind == PROBLEM:
        return key if context["key"] is None else (*key, context["key"]), context["message"]
    if kind == "union_tag_invalid":
        if not isinstance(value, dict):
            return key, f"must be a mapping (key: value), not {shown(value)}"
        tags = [tag.strip("'<> ") for tag in context["expected_tags"].split(",")]
        choices = [tag for tag in tags if tag != "value"]
        if "type" not in value:
            return (*key, "type"), "is missing" + listed(choices)
        wrong = value["type"]
        return (*key, "type"), f"unknown type {shown(wrong)}" + listed(choices, wrong)
    if kind == "literal_error":
        choices = [word.strip("' ") for word in context["expected"].replace(" or ", ",").split(",")]
        return key, f"unknown choice {shown(value)}" + listed(choices, value)
    words = {
        "bool_type": "true or false",
        "string_type": "text",
        "dict_type": "a mapping (name: value)",
        "list_type": "a list",
        "too_short": "a list with at least one entry",
    }
    return key, f"must be {words[kind]}, not {shown(value)}" if kind in words else details["msg"]
