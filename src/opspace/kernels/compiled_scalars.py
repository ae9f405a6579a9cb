"""The functions of `opspace.law.scalars`, compiled; they call one another in this form too."""

from __future__ import annotations

from types import FunctionType, ModuleType
from typing import Any

from opspace.law import scalars
from opspace.machine.jit import jit


def compiled(module: ModuleType) -> dict[str, Any]:
    """Compile every function of a module, with a namespace in which all of them are compiled."""
    names = dict(vars(module))
    for name, function in vars(module).items():
        if isinstance(function, FunctionType) and function.__module__ == module.__name__:
            names[name] = jit(FunctionType(function.__code__, names, name))
    return names


_COMPILED = compiled(scalars)

profile = _COMPILED["profile"]
fade = _COMPILED["fade"]
unrest_of = _COMPILED["unrest_of"]
remembered_unrest = _COMPILED["remembered_unrest"]
ramp = _COMPILED["ramp"]
allowed_speed = _COMPILED["allowed_speed"]
position_command = _COMPILED["position_command"]
closing_command = _COMPILED["closing_command"]
last_closing_command = _COMPILED["last_closing_command"]
asked_for = _COMPILED["asked_for"]
yielding = _COMPILED["yielding"]
hardened = _COMPILED["hardened"]
limit_command = _COMPILED["limit_command"]
limit_presence = _COMPILED["limit_presence"]
stopping_command = _COMPILED["stopping_command"]
last_command = _COMPILED["last_command"]
level_weight = _COMPILED["level_weight"]
goes_on = _COMPILED["goes_on"]
error_length = _COMPILED["error_length"]
leaning = _COMPILED["leaning"]
spread = _COMPILED["spread"]
speed_scale = _COMPILED["speed_scale"]
without_turns = _COMPILED["without_turns"]
room_for = _COMPILED["room_for"]
entering_weight = _COMPILED["entering_weight"]
passed = _COMPILED["passed"]
lag = _COMPILED["lag"]
is_fresh = _COMPILED["is_fresh"]
confidence = _COMPILED["confidence"]
floor_of = _COMPILED["floor_of"]
approach = _COMPILED["approach"]
integral_after = _COMPILED["integral_after"]
