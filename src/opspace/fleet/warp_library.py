"""Warp, which fleets run in, and arrays of others in its terms."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from opspace.errors import InputError, missing_extra


@cache
def warp() -> Any:
    """Return Warp, imported when it is first needed.

    Raises:
        MissingExtraError: It is not installed.
    """
    try:
        import warp as found  # pyright: ignore[reportMissingImports] # noqa: PLC0415
    except ImportError as error:
        raise missing_extra("warp-lang", "gpu") from error
    found.init()
    return found


def device_of(name: object) -> Any:
    """Return a device of Warp by its name.

    Raises:
        InputError: There is no such device here.
    """
    wp = warp()
    try:
        return wp.get_device(name)
    except (ValueError, RuntimeError) as error:
        known = ", ".join(repr(str(device)) for device in wp.get_devices())
        raise InputError(f"there is no device {name!r} here (valid: {known})") from error


def as_warp(given: Any, name: str, shape: tuple[int, ...], dtype: Any, device: Any) -> Any:
    """Return an array of Warp that shares its memory with what is given.

    Args:
        given: An array of Warp, a tensor of torch, or an array of NumPy.
        name: What it is called in errors.
        shape: The shape that it must have.
        dtype: The type of Warp that its numbers must have.
        device: Where it must be.

    Raises:
        InputError: It is something else, or has another shape, type or place.
    """
    wp = warp()
    if isinstance(given, np.ndarray):
        found = _of_numpy(given, name, dtype, device)
    elif isinstance(given, wp.array):
        found = given
    elif type(given).__module__.partition(".")[0] == "torch":
        found = wp.from_torch(given.detach())
    else:
        raise InputError(
            f"{name} must be an array of Warp or NumPy or a tensor of torch, "
            f"not {type(given).__name__}"
        )
    if found.shape != shape or found.dtype != dtype or found.device != device:
        raise InputError(
            f"{name} must have shape {shape}, numbers of {dtype.__name__} and be on {device}; it has "
            f"{tuple(found.shape)}, {getattr(found.dtype, '__name__', found.dtype)} and {found.device}"
        )
    if found.strides[-1] != wp.types.type_size_in_bytes(dtype):
        raise InputError(f"the numbers of a row of {name} must lie side by side")
    return found


def _of_numpy(given: np.ndarray, name: str, dtype: Any, device: Any) -> Any:
    wp = warp()
    wanted = wp.dtype_to_numpy(dtype)
    if not device.is_cpu:
        raise InputError(f"{name} is an array of NumPy; a fleet on {device} takes what is there")
    if given.dtype != wanted:
        raise InputError(f"{name} must have numbers of {dtype.__name__}, it has {given.dtype}")
    return wp.array(given, dtype=dtype, device=device, copy=False)


def workspace_of(count: int, memory: int, lanes: int, device: Any) -> Any:
    """Make the memory that robots work in, for whole groups of as many as share a part.

    Args:
        count: Number of robots.
        memory: Bytes of each, a multiple of 8.
        lanes: How many share a part.
        device: Where it shall be.

    Raises:
        InputError: The device has not so much.
    """
    wp, groups = warp(), -(-count // lanes)
    try:
        return wp.empty((groups, lanes * memory // 8), dtype=wp.int64, device=device)
    except RuntimeError as error:
        size = groups * lanes * memory / 2**20
        raise InputError(
            f"{count} of these robots work in {size:.0f} MiB, which {device} has not free; make the "
            "fleet smaller, or give its stack fewer rows and levels"
        ) from error


def robots_of(robots: Any, count: int) -> np.ndarray:
    """Return which robots are meant, (count,) of bool.

    Args:
        robots: None for all, a mask, or their numbers.
        count: Number of robots.

    Raises:
        InputError: It is none of them, or names a robot that there is not.
    """
    if robots is None:
        return np.ones(count, bool)
    if hasattr(robots, "numpy"):
        robots = robots.detach().cpu().numpy() if hasattr(robots, "detach") else robots.numpy()
    found = np.asarray(robots)
    if found.dtype == bool:
        if found.shape != (count,):
            raise InputError(f"a mask of robots has shape ({count},), not {found.shape}")
        return found.copy()
    if found.size == 0:
        return np.zeros(count, bool)
    if not np.issubdtype(found.dtype, np.integer):
        raise InputError(f"robots are a mask or their numbers, not {found.dtype}")
    if found.min() < 0 or found.max() >= count:
        raise InputError(f"robots have the numbers 0 to {count - 1}")
    mask = np.zeros(count, bool)
    mask[found] = True
    return mask
