"""The runs of a sweep: each follows from its number alone."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from opspace.errors import InputError
from opspace.scenario.load import scenario_from, to_dict
from opspace.scenario.schema import Scenario
from opspace.sweep.random_scenario import random_scenario
from opspace.sweep.vary import Variation

RANDOM = "random"
"""Name of the source whose every run is a scenario drawn anew."""
SEED_KEY = "seed"


@dataclass(frozen=True)
class SweepPlan:
    """What is run.

    Attributes:
        base: The scenario in plain values; None draws a new one for every run.
        vary: What changes from run to run.
        runs: How many runs are drawn; None runs the grid of all values once.
        seed: What the draws come from.
    """

    base: Mapping[str, Any] | None
    vary: Sequence[Variation] = ()
    runs: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.runs is not None and self.runs < 1:
            raise InputError(f"--runs must be at least 1, got {self.runs}")
        if self.seed < 0:
            raise InputError(f"--seed must be at least 0, got {self.seed}")
        keys = [variation.key for variation in self.vary]
        for key in keys:
            if keys.count(key) > 1:
                raise InputError(f"--vary {key} is given twice")
        if self.runs is None:
            ranges = [variation.key for variation in self.vary if not variation.choices]
            if self.base is None or not self.vary or ranges:
                what = f"the range of {ranges[0]}" if ranges else "what is drawn"
                raise InputError(f"--runs must say how often {what} is drawn")

    @property
    def size(self) -> int:
        """Number of runs."""
        if self.runs is not None:
            return self.runs
        return math.prod(len(variation.choices) for variation in self.vary)

    def values(self, index: int) -> dict[str, Any]:
        """Tell what the varied keys are in a run, by key."""
        if self.runs is None:
            grid = itertools.product(*(variation.choices for variation in self.vary))
            chosen = next(itertools.islice(grid, index, None))
        else:
            rng = self._stream(index, 0)
            chosen = [variation.draw(rng) for variation in self.vary]
        return {v.key: value for v, value in zip(self.vary, chosen, strict=True)}

    def scenario(self, index: int) -> Scenario:
        """Build the scenario of a run.

        Args:
            index: Number of the run, from 0.

        Returns:
            The scenario; its seed is the run's own unless it is varied or the sweep is a grid.

        Raises:
            ScenarioError: The values do not make a scenario.
        """
        base = self.base
        if base is None:
            base = random_scenario(self._stream(index, 1))
        overrides = [v.override(self.values(index)[v.key]) for v in self.vary]
        if self.runs is not None:
            overrides.insert(0, f"{SEED_KEY}={self._stream(index, 2).integers(2**32)}")
        return scenario_from(base, overrides)

    def to_json(self) -> dict[str, Any]:
        """Write the plan as plain values; two plans are the same sweep if these are equal."""
        vary = [
            {"key": v.key, "choices": list(v.choices)}
            if v.choices
            else {"key": v.key, "low": v.low, "high": v.high, "logarithmic": v.logarithmic}
            for v in self.vary
        ]
        base = None if self.base is None else dict(self.base)
        return {"base": base, "vary": vary, "runs": self.runs, "seed": self.seed}

    def _stream(self, index: int, purpose: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(index, purpose)))


def run_id(scenario: Scenario) -> str:
    """Name a run by what it is: equal scenarios have equal names."""
    text = json.dumps(to_dict(scenario), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
