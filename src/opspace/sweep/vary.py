"""What a sweep changes from run to run: ``tasks.position.kp=25..400``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from opspace.errors import InputError
from opspace.scenario.document import parse, to_yaml

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"(log\s+)?({_NUMBER})\.\.({_NUMBER})")
_FORMS = "KEY=LOW..HIGH, KEY=log LOW..HIGH or KEY=[VALUE, ...]"


@dataclass(frozen=True)
class Variation:
    """One key of a scenario and the values that it takes.

    Attributes:
        key: The key, as ``--set`` takes it.
        choices: The values, of a list; empty for a range.
        low: Lower end of a range.
        high: Upper end of a range.
        logarithmic: Whether the logarithm is uniform in the range.
    """

    key: str
    choices: tuple[Any, ...] = ()
    low: float = 0.0
    high: float = 0.0
    logarithmic: bool = False

    @staticmethod
    def read(text: str) -> Variation:
        """Read a variation from the command line.

        Args:
            text: ``KEY=LOW..HIGH`` (uniform), ``KEY=log LOW..HIGH``, or ``KEY=[VALUE, ...]`` in YAML.

        Returns:
            The variation.

        Raises:
            InputError: It is none of these, or the range is empty.
        """
        key, equals, values = text.partition("=")
        key, values = key.strip(), values.strip()
        if not (key and equals):
            raise InputError(f"--vary {text}: must be {_FORMS}")
        found = _RANGE.fullmatch(values)
        if found is None:
            return Variation(key, _listed(text, values))
        low, high, logarithmic = float(found[2]), float(found[3]), bool(found[1])
        if not (low < high and math.isfinite(high - low)):
            raise InputError(f"--vary {text}: {low:g} must be below {high:g}")
        if logarithmic and low <= 0.0:
            raise InputError(f"--vary {text}: a logarithmic range must begin above 0")
        return Variation(key, (), low, high, logarithmic)

    def draw(self, rng: np.random.Generator) -> Any:
        """Draw a value."""
        if self.choices:
            return self.choices[int(rng.integers(len(self.choices)))]
        if self.logarithmic:
            return float(np.exp(rng.uniform(np.log(self.low), np.log(self.high))))
        return float(rng.uniform(self.low, self.high))

    def override(self, value: Any) -> str:
        """Write a value as ``--set`` takes it."""
        return f"{self.key}={flow(value)}"


def flow(value: Any) -> str:
    """Write a plain value as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(k)}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow(item) for item in value) + "]"
    return to_yaml({"x": value}).strip().removeprefix("x:").strip()


def _listed(text: str, values: str) -> tuple[Any, ...]:
    if not values.startswith("["):
        raise InputError(f"--vary {text}: must be {_FORMS}")
    data = parse(values).data
    if not isinstance(data, list) or not data:
        raise InputError(f"--vary {text}: the list of values is empty")
    return tuple(data)
