"""Rows without what pads them: one robot's numbers are worked on one by one, beside those of others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from opspace.kernels import whole_vectors


def _as_many(count: int) -> int:
    """Numbers that so many take."""
    return count


ONE_BY_ONE: Mapping[Callable[..., Any], Callable[..., Any]] = {
    whole_vectors.whole: _as_many,
    whole_vectors.whole_before: _as_many,
}
