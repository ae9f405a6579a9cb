"""What the numbers of the law are where numbers have seven digits instead of sixteen."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from opspace.errors import unknown_name

SINGLE: Mapping[str, float] = MappingProxyType(
    {
        "RANK_TOLERANCE": 1e-4,
        "REGULAR": 1e-5,
        "NORMAL": 1e-2,
        "EPSILON": 4e-7,
        "BROKEN": 1e-5,
        "GIVEN_WAY": 1e-6,
        "LARGEST": float(np.finfo(np.float32).max),
        "SIGNS": 22,
    }
)
"""Constants of the kernels that say how exact numbers are, by name; any other is physics."""

DTYPES = ("float64", "float32")


def constants_of(dtype: str) -> Mapping[str, float]:
    """Return the constants to replace for a type of numbers."""
    return SINGLE if dtype == "float32" else {}


def dtype_name(dtype: object) -> str:
    """Return the name of a type of numbers, given as a name or as NumPy, Warp or torch has it.

    Raises:
        UnknownNameError: It is another one.
    """
    name = getattr(dtype, "__name__", str(dtype)).rpartition(".")[2]
    if name not in DTYPES:
        raise unknown_name("dtype", name, DTYPES)
    return name
