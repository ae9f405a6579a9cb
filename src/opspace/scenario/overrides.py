"""Changes single values of a scenario from the command line: ``tasks.position.kp=200``."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Sequence
from typing import Any

from opspace.errors import ScenarioError
from opspace.scenario.document import PLAIN_KEY, Document, Key, key_text, parse

_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"')
_INDEX = re.compile(r"\[([0-9]+)\]")


def apply_overrides(document: Document, overrides: Sequence[str]) -> Document:
    """Set values by key, one after the other.

    Args:
        document: The document; it stays as it is.
        overrides: Each ``key=value``: the keys joined by dots, list entries as ``[0]``, a key with
            odd characters in double quotes, the value in YAML. Mappings on the way that are
            absent or null are created.

    Returns:
        The changed document, in which each changed value is traced to its override.

    Raises:
        ScenarioError: An override that is not ``key=value``, or that leads nowhere.
    """
    if not overrides:
        return document
    data, origins = copy.deepcopy(document.data), dict(document.origins)
    for override in overrides:
        name = "--set " + override.replace("\n", "\\n")
        key, value = _split(override, name)
        changed = Document(document.file, data, origins)
        _assign(changed, key, value, name)
        for below in [old for old in origins if old[: len(key)] == key]:
            del origins[below]
        origins[key] = name
    return Document(document.file, data, origins)


def _split(override: str, name: str) -> tuple[Key, Any]:
    """Read ``key=value``."""
    key: list[str | int] = []
    at = 0
    while True:
        quoted = _QUOTED.match(override, at)
        word = quoted or PLAIN_KEY.match(override, at)
        if word is None:
            break
        key.append(json.loads(word.group()) if quoted else word.group())
        at = word.end()
        while index := _INDEX.match(override, at):
            key.append(int(index.group(1)))
            at = index.end()
        if override[at : at + 1] == "=":
            return tuple(key), _value(override[at + 1 :], name)
        if override[at : at + 1] != ".":
            break
        at += 1
    raise ScenarioError("must be key=value, for example tasks.position.kp=200", file=name)


def _value(text: str, name: str) -> Any:
    try:
        return parse(text).data if text.strip(" ") else None
    except ScenarioError:
        raise ScenarioError("the value cannot be read as YAML", file=name) from None


def _assign(document: Document, key: Key, value: Any, name: str) -> None:
    holder = document.data
    for depth, part in enumerate(key):
        _check_step(document, holder, key[:depth], part, name)
        if depth == len(key) - 1:
            holder[part] = value
        else:
            if isinstance(part, str) and holder.get(part) is None:
                holder[part] = {}
            holder = holder[part]


def _check_step(document: Document, holder: Any, at: Key, part: str | int, name: str) -> None:
    """Refuse to enter a value that has no such entry."""
    here = key_text(at) if at else "the scenario"
    if isinstance(part, int):
        if not isinstance(holder, list):
            problem = f"{here} is not a list"
        elif part >= len(holder):
            problem = (
                f"{here} has entries [0] to [{len(holder) - 1}]" if holder else f"{here} is empty"
            )
        else:
            return
    elif isinstance(holder, dict):
        return
    else:
        problem = f"{here} is not a mapping, so it has no key {part!r}"
    raise ScenarioError(f"{problem} (from {name})", file=document.file, key=key_text((*at, part)))
