"""Directions of levels for a report, in arrays that are made once."""

from __future__ import annotations

from threading import Lock

import numpy as np

from opspace.machine.field_table import Record
from opspace.machine.record import Handle
from opspace.plan.entries import KERNELS
from opspace.plan.records import SPECTRUM


class Spectra:
    """Works out the directions of levels, from any thread.

    Args:
        option: Options of the controller.
    """

    def __init__(self, option: np.ndarray) -> None:
        self._option = option
        self._made: dict[tuple[int, ...], tuple[Record, Handle]] = {}
        self._lock = Lock()

    def of(
        self, B: np.ndarray, unrest: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return σ, activations, responses and the directions as columns, strongest first (Eq. 25).

        Args:
            B: (rows, free) rows of the level in the basis of the free motions.
            unrest: How far the level is from rest at its target.
        """
        with self._lock:
            found = self._made.get(B.shape)
            if found is None:
                sizes = {"fewer": min(B.shape), "more": max(B.shape)}
                record = SPECTRUM.make(
                    sizes,
                    {
                        "B": np.zeros(B.shape),
                        "option": self._option,
                        "unrest": np.zeros(1),
                    },
                )
                found = self._made[B.shape] = record, record.handle()
            record, handle = found
            record.B[:] = B
            record.unrest[0] = unrest
            record.directions.fill(0.0)  # those of no length are left out
            KERNELS["spectrum"](handle.address)
            told = record.sigma, record.activation, record.response, record.directions
            return tuple(map(np.copy, told))  # pyright: ignore[reportReturnType]
