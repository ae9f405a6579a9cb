"""Checks of the numbers that a user hands to a task or a reference."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opspace.errors import InputError

Array = NDArray[np.float64]

_NUMERIC = "biufO"
"""Kinds of arrays that may hold real numbers; others are turned into floats in strange ways."""
_LONG = 80
_FLOAT = np.dtype(float)
_FEW = 16
"""Of so many numbers a sum in Python takes less time than a look with NumPy."""


def finite_array(value: ArrayLike, shape: tuple[int | None, ...] | None, what: str) -> Array:
    """Copy a value into a read-only float64 array of the given shape.

    Args:
        value: Numbers to check.
        shape: Required shape, None for any; within it None stands for any length of that axis.
        what: What the value is, at the start of the error message.

    Returns:
        A read-only copy.

    Raises:
        InputError: Not numbers, another shape, or a value that is not finite.
    """
    array = numbers(value, what)
    if shape is not None and array.shape != shape and not _fits(array.shape, shape):
        raise InputError(f"{what} must have shape {_words(shape)}, not {array.shape}")
    require_finite(array, what)
    array.flags.writeable = False
    return array


def require_finite(array: Array, what: str) -> None:
    """Refuse numbers of which one is not finite.

    Args:
        array: The numbers.
        what: What they are, at the start of the error message.

    Raises:
        InputError: One is not.
    """
    # The sum is finite, unless the numbers are too large for it.
    if array.size <= _FEW and math.isfinite(sum(array.ravel().tolist())):
        return
    if not np.isfinite(array).all():
        raise InputError(f"{what} must be finite, not {shown(array.tolist())}")


def numbers(value: ArrayLike, what: str) -> Array:
    """Copy a value into a float64 array of whatever shape it has.

    Args:
        value: Numbers.
        what: What the value is, at the start of the error message.

    Returns:
        A copy.

    Raises:
        InputError: Not numbers, or rows of different lengths.
    """
    if type(value) is np.ndarray and value.dtype is _FLOAT:
        return value.copy()
    try:
        found = np.array(value)
        if found.dtype.kind in _NUMERIC:
            return found.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(f"{what} must be numbers, not {shown(value)}")


def positive(value: float, what: str) -> float:
    """Return a finite number above zero.

    Args:
        value: Number to check.
        what: What the value is, at the start of the error message.

    Returns:
        The number as a float.

    Raises:
        InputError: Not a number, not finite, zero or below.
    """
    number = finite(value, what)
    if number <= 0.0:
        raise InputError(f"{what} must be above zero, not {number}")
    return number


def finite(value: ArrayLike, what: str) -> float:
    """Return a finite number.

    Args:
        value: Number to check.
        what: What the value is, at the start of the error message.

    Returns:
        The number as a float.

    Raises:
        InputError: Not a number or not finite.
    """
    try:
        number = float(value)  # pyright: ignore[reportArgumentType] - or it is refused
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{what} must be a number, not {shown(value)}") from None
    if not math.isfinite(number):
        raise InputError(f"{what} must be finite, not {number}")
    return number


def shown(value: object) -> str:
    """Write any value on one line that is not too long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONG else f"{text[:_LONG]}..."


def brief(numbers: ArrayLike) -> str:
    """Write numbers for a person, on one line, with four digits."""
    written = np.array2string(
        np.asarray(numbers, dtype=float),
        formatter={"float_kind": "{:.4g}".format},
        separator=", ",
        threshold=16,
    )
    return " ".join(written.split())


def _fits(got: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return got == wanted or (
        len(got) == len(wanted)
        and all(want is None or size == want for size, want in zip(got, wanted, strict=True))
    )


def _words(shape: tuple[int | None, ...]) -> str:
    inner = ", ".join("any" if size is None else str(size) for size in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"
