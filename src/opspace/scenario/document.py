"""Reads YAML into plain values and remembers on which line each of them stands.

Scalars follow the core schema of YAML 1.2, which says what people expect: ``1e3`` is a number,
``no`` and ``12:30`` are text, ``010`` is ten.
"""

from __future__ import annotations

import json
import re
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import Any

import yaml

from opspace.errors import ScenarioError

Key = tuple[str | int, ...]
"""Where a value stands: ``("tasks", "position", "target", 1)``."""

PLAIN_KEY = re.compile(r"[^.\[\]=\"\s]+")
"""A key that needs no quotes in ``--set``."""

# Aliases can make a short text stand for an endless document.
_MAX_VALUES = 100_000

_TAG = "tag:yaml.org,2002:"
_CORE = (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
)


class _Loader(yaml.SafeLoader):
    """Knows the core schema only."""


class _Dumper(yaml.SafeDumper):
    """Quotes what the core schema would not read back as text."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text_node(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    # Unquoted, PyYAML writes line separators that it reads back as spaces.
    style = None if text.isprintable() else '"'
    return dumper.represent_scalar(_TAG + "str", text, style=style)


_Dumper.add_representer(str, _text_node)

for _kind in (_Loader, _Dumper):
    _kind.yaml_implicit_resolvers = {}
    for _name, _pattern, _first in _CORE:
        _kind.add_implicit_resolver(_TAG + _name, re.compile(rf"^(?:{_pattern})$"), _first)


@dataclass(frozen=True)
class Document:
    """A YAML document and where its parts come from.

    Attributes:
        file: Name of the file for messages, or None.
        data: Plain values: dict, list, str, int, float, bool, None.
        origins: For each key the line it stands on, counted from 1, or the text of the override
            that set it.
    """

    file: str | None
    data: Any
    origins: dict[Key, int | str]

    def error(self, key: Key, message: str) -> ScenarioError:
        """Build the error about a key, which need not exist.

        Args:
            key: The offending key.
            message: What is wrong with it and what would be right.

        Returns:
            The error, to be raised by the caller.
        """
        known = key
        while known and known not in self.origins:
            known = known[:-1]
        origin = self.origins.get(known)
        line = origin if isinstance(origin, int) else None
        inside = (below for below in self.origins if below[: len(key)] == key)
        overrides = (self.origins.get(below) for below in (known, *inside))
        override = next((name for name in overrides if isinstance(name, str)), None)
        if override is not None:
            message += f" (set by {override})"
        return ScenarioError(message, file=self.file, line=line, key=key_text(key))


def key_text(key: Key) -> str:
    """Write a key the way ``--set`` reads it, for example ``tasks.position.target[1]``."""
    text = ""
    for part in key:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            plain = PLAIN_KEY.fullmatch(part)
            text += ("." if text else "") + (
                part if plain else json.dumps(part, ensure_ascii=False)
            )
    return text


def parse(text: str, file: str | None = None) -> Document:
    """Read one YAML document.

    Args:
        text: The YAML text.
        file: Name of the file for messages.

    Returns:
        The values and where they stand.

    Raises:
        ScenarioError: The text is not one YAML document of plain values, or gives a key twice.
    """
    try:
        root = yaml.compose(text, Loader=_Loader)
        if root is None:
            raise ScenarioError("is empty", file=file)
        origins: dict[Key, int | str] = {(): root.start_mark.line + 1}
        data = _Construction(file, origins).value(root, (), ())
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        message = f"cannot be read as YAML: {error.reason}"
        raise ScenarioError(message, file=file, line=line) from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        words = ", ".join(word for word in (error.context, error.problem) if word)
        line = mark.line + 1 if mark else None
        raise ScenarioError(f"cannot be read as YAML: {words}", file=file, line=line) from error
    except RecursionError:
        raise ScenarioError("is nested too deeply", file=file) from None
    return Document(file, data, origins)


def to_yaml(data: Any) -> str:
    """Write plain values as YAML that ``parse`` reads back to equal values.

    Args:
        data: dict, list, str, int, float, bool, None.

    Returns:
        The YAML text.
    """
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)


@dataclass
class _Construction:
    """Turns YAML nodes into values, noting the line of each."""

    file: str | None
    origins: dict[Key, int | str]

    def value(self, node: yaml.Node, key: Key, parents: tuple[Hashable, ...]) -> Any:
        if id(node) in parents:
            raise self._error(node, key, "contains itself")
        if len(self.origins) > _MAX_VALUES:
            raise self._error(node, key, f"is one of more than {_MAX_VALUES} values")
        inside = (*parents, id(node))
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            result: dict[str, Any] = {}
            for name, value_node in self._entries(node, key):
                result[name] = self.value(value_node, (*key, name), inside)
            return result
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            items: list[Any] = []
            for i, item in enumerate(node.value):
                self.origins[(*key, i)] = item.start_mark.line + 1
                items.append(self.value(item, (*key, i), inside))
            return items
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, key)
        raise self._error(node, key, f"has the tag {node.tag}, which a scenario cannot use")

    def _entries(self, node: yaml.MappingNode, key: Key) -> Iterator[tuple[str, yaml.Node]]:
        lines: dict[str, int] = {}
        for name_node, value_node in node.value:
            if not isinstance(name_node, yaml.ScalarNode):
                raise self._error(name_node, key, "has a key that is not plain text")
            # A key is its text: a joint may be called 1 or yes.
            name = name_node.value
            line = name_node.start_mark.line + 1
            if name in lines:
                raise self._error(
                    name_node, (*key, name), f"is given twice, first on line {lines[name]}"
                )
            self.origins[(*key, name)] = lines[name] = line
            yield name, value_node

    def _scalar(self, node: yaml.ScalarNode, key: Key) -> Any:
        kind, text = node.tag.removeprefix(_TAG), node.value
        try:
            if kind == "str":
                return text
            if kind == "null":
                return None
            if kind == "bool":
                return text.lower() == "true"
            if kind == "int":
                return int(text, 0) if text[:2] in ("0o", "0x") else int(text)
            if kind == "float":
                special = text.lower().lstrip("+-") in (".inf", ".nan")
                return float(text.replace(".", "") if special else text)
        except ValueError:
            raise self._error(node, key, f"{text[:40]!r} cannot be read as {kind}") from None
        raise self._error(node, key, f"has the tag {node.tag}, which a scenario cannot use")

    def _error(self, node: yaml.Node, key: Key, message: str) -> ScenarioError:
        line = node.start_mark.line + 1
        return ScenarioError(message, file=self.file, line=line, key=key_text(key))
