"""The run-time checker of annotations: each function, once for every form of what goes in and out.

Whether shapes and types fit their annotations is a matter of the form alone, so nothing is missed;
the checker itself is twenty times as slow as the functions that it checks.
"""

import dataclasses
import functools
import inspect
from types import CodeType, FunctionType

import jaxtyping
import numpy as np
from beartype import BeartypeConf, beartype

# An int is welcome where a float is expected (PEP 484).
check = beartype(conf=BeartypeConf(is_pep484_tower=True))
_at_every_call = jaxtyping.jaxtyped
_seen: dict[CodeType, set] = {}


def check_annotations(modules):
    """Check what enters and leaves the functions and the data classes of modules not yet imported."""
    jaxtyping.install_import_hook(modules, f"{__name__}.check")
    jaxtyping.jaxtyped = checked  # what the hook writes above every function and class


def checked(*, typechecker):
    """Decorate a function, or the ``__init__`` of a data class."""

    def decorate(target):
        if not inspect.isclass(target):
            return _checked_function(target, typechecker)
        if dataclasses.is_dataclass(target):
            target.__init__ = _checked_function(target.__init__, typechecker)
        return target

    return decorate


def _checked_function(function, typechecker):
    seen = _seen.setdefault(function.__code__, set())

    @functools.wraps(function)
    def call(*args, **kwargs):
        enters = form(args), form(tuple(kwargs.items()))
        if enters in seen:
            result = function(*args, **kwargs)
            if (enters, form(result)) not in seen:
                _at_every_call(_answering(function, result), typechecker=typechecker)(
                    *args, **kwargs
                )
        else:
            result = _at_every_call(function, typechecker=typechecker)(*args, **kwargs)
            seen.add(enters)
        seen.add((enters, form(result)))
        return result

    return call


def _answering(function, result):
    """Stand in for a function that is not to run twice: the same annotations, this result."""

    def answer(*args, **kwargs):
        return result

    parts = function.__name__, None, answer.__closure__
    stand_in = FunctionType(answer.__code__, function.__globals__, *parts)
    return functools.update_wrapper(stand_in, function)


def form(value):
    """All that annotations can tell of a value: types, shapes, and which of the literal words."""
    kind = type(value)
    if kind is np.ndarray:
        return value.dtype, value.shape
    if kind is tuple or kind is list:
        return kind, tuple(map(form, value))
    if kind is frozenset or kind is set:
        return kind, frozenset(map(form, value))
    # Of a tuple with names an annotation says no more than which it is.
    return value if kind is str else kind
