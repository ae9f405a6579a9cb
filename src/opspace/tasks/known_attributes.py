"""Objects that people assign to while a robot moves, and that refuse a name that means nothing."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from inspect import isfunction
from typing import TYPE_CHECKING

from opspace.errors import InputError, unknown_name


class KnownAttributes:
    """Takes assignments to what it has; only its own methods give it something new.

    It has what its class declares (a property, a class attribute, an annotation) and what is there
    already. Assigning to a method is refused, too: a subclass overrides it.
    """

    if not TYPE_CHECKING:  # a type checker would take any name for an attribute

        def __setattr__(self, name: str, value: object) -> None:
            """Set an attribute, or refuse a name that nothing would read."""
            if name not in self.__dict__:
                _check_new(self, name)
            super().__setattr__(name, value)


def _check_new(owner: KnownAttributes, name: str) -> None:
    kind = type(owner)
    if hasattr(kind, name):
        refused = isfunction(getattr(kind, name)) and name != "activation"
        if refused and not _from_within(owner):
            raise InputError(f"{name} is a method of {kind.__name__}: override it in a subclass")
    elif name not in _annotated(kind) and not _from_within(owner):
        raise unknown_name(f"attribute of {kind.__name__}", name, sorted(_choices(owner)))


def _from_within(owner: object) -> bool:
    """Tell whether the assignment stands in a method, where the object is ``self``."""
    frame = sys._getframe(2)
    while frame.f_code.co_name == "__setattr__" and frame.f_back is not None:
        frame = frame.f_back
    return frame.f_locals.get("self") is owner


def _annotated(kind: type) -> set[str]:
    return {name for one in kind.__mro__ for name in getattr(one, "__annotations__", ())}


def _choices(owner: KnownAttributes) -> Iterator[str]:
    kind = type(owner)
    for name in {*dir(kind), *_annotated(kind), *vars(owner)}:
        found = getattr(kind, name, None)
        fixed = isfunction(found) or (isinstance(found, property) and found.fset is None)
        if not name.startswith("_") and not fixed:
            yield name
