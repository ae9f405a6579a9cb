"""What the entries of a scenario are made of: numbers with unit and range, and mappings.

Every check words its own message, with the range, the unit and the valid choices, so that a wrong
value can be reported on one line.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

PROBLEM = "opspace"
"""Type of the errors that ``problem`` builds."""

_SHOWN = 60
# Larger ones are not exact in every reader of JSON.
_MAX_WHOLE = 2**53
_YAML_WORDS = {
    "None": "null",
    "True": "true",
    "False": "false",
    "nan": ".nan",
    "inf": ".inf",
    "-inf": "-.inf",
}


def problem(message: str, key: str | int | None = None) -> PydanticCustomError:
    """Build the error about a value, to be raised by its check.

    Args:
        message: What is wrong and what would be right.
        key: Entry of the checked value that is to blame; None for the value itself.

    Returns:
        The error.
    """
    return PydanticCustomError(PROBLEM, "{message}", {"message": message, "key": key})


def listed(choices: Iterable[str], wrong: Any = None) -> str:
    """Write valid choices, after those near a wrong one.

    Args:
        choices: Every valid name.
        wrong: The name as given; anything but text is near to nothing.

    Returns:
        For example ``; did you mean 'kp'? (valid: kp, kv)``.
    """
    valid = list(choices)
    near = difflib.get_close_matches(wrong, valid, cutoff=0.5) if isinstance(wrong, str) else []
    hint = f"; did you mean {' or '.join(repr(name) for name in near)}?" if near else ""
    return f"{hint} (valid: {', '.join(valid) or 'none'})"


def shown(value: Any) -> str:
    """Write a wrong value as YAML has it, shortened to one line."""
    text = _flow(value)
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def _flow(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    text = repr(value)
    return _YAML_WORDS.get(text, text)


class Entry(BaseModel):
    """A mapping with fixed keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _check_keys(cls, data: Any) -> Any:
        if isinstance(data, cls):
            return data
        if not isinstance(data, dict):
            raise problem(f"must be a mapping (key: value), not {shown(data)}")
        fields = cls.model_fields
        for key in data:
            if key not in fields:
                raise problem("unknown key" + listed(fields, key), str(key))
        for key, field in fields.items():
            if field.is_required() and key not in data:
                raise problem(f"is missing ({field.description})", key)
        return data


@dataclass(frozen=True)
class Number:
    """A number with unit and range; used as ``Annotated[float, Number("s", above=0.0)]``.

    Attributes:
        unit: SI unit, ``1`` for none.
        above: Exclusive lower bound.
        at_least: Inclusive lower bound.
        at_most: Inclusive upper bound.
        size: None for one number; n for a list of n; ``any`` for a list of any length above zero;
            ``rows`` for one number or a list with one for each row.
        otherwise: What else could stand here, for the message.
    """

    unit: str
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    size: int | Literal["any", "rows"] | None = None
    otherwise: str = ""

    def words(self) -> str:
        """Say what is accepted, for example ``a number above 0 [s]``."""
        bounds = (("above", self.above), ("at least", self.at_least), ("at most", self.at_most))
        given = " and ".join(f"{word} {bound:g}" for word, bound in bounds if bound is not None)
        what = {
            None: "a number",
            "any": "a list of numbers",
            "rows": "a number or a list of numbers",
        }.get(self.size, f"a list of {self.size} numbers")
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        return f"{what}{' ' + given if given else ''}{unit}{self.otherwise}"

    def check(self, value: Any) -> float | tuple[float, ...]:
        """Turn a value into a float or a tuple of floats.

        Args:
            value: Value as read.

        Returns:
            The number or the numbers.

        Raises:
            PydanticCustomError: It is not what ``words`` says.
        """
        several = isinstance(value, list | tuple)
        if several and self._fits(len(value)):
            return tuple(self._number(item, i) for i, item in enumerate(value))
        if several or self.size not in {None, "rows"}:
            raise problem(f"must be {self.words()}, not {shown(value)}")
        return self._number(value)

    def _fits(self, count: int) -> bool:
        return count == self.size if isinstance(self.size, int) else bool(self.size and count)

    def _number(self, item: Any, place: int | None = None) -> float:
        try:
            number = float(item) if _is_number(item) else math.nan
        except OverflowError:
            number = math.inf
        if (
            not math.isfinite(number)
            or (self.above is not None and number <= self.above)
            or (self.at_least is not None and number < self.at_least)
            or (self.at_most is not None and number > self.at_most)
        ):
            wanted = self if place is None else replace(self, size=None, otherwise="")
            raise problem(f"must be {wanted.words()}, not {shown(item)}", place)
        return number

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


@dataclass(frozen=True)
class Checked:
    """A value that a function reads; used as ``Annotated[int, Checked(whole)]``.

    Attributes:
        read: Takes the value as written; gives the one to keep, or raises ``problem``.
    """

    read: Callable[[Any], Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)


def whole(value: Any) -> int:
    """Read a whole number from zero on.

    Args:
        value: Value as written.

    Returns:
        The number.

    Raises:
        PydanticCustomError: It is anything else.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _MAX_WHOLE:
        raise problem(f"must be a whole number from 0 to {_MAX_WHOLE}, not {shown(value)}")
    return value
