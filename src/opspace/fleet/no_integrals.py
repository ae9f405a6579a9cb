"""What robots of a fleet call where no task of theirs has a ki."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from opspace.kernels.integrals import forget_sum, learn, push


def forget_nothing(work, sums, i):
    """Have no integral."""


def push_nothing(work, sums):
    """Have no integral."""


def learn_nothing(work, sums, status):
    """Have no integral."""


WITHOUT: Mapping[Callable[..., Any], Callable[..., Any]] = {
    forget_sum: forget_nothing,
    push: push_nothing,
    learn: learn_nothing,
}
"""What is called where no task has a ki, by what is called otherwise."""
