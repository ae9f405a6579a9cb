"""Intermediate desired values by the paper's own recursion, for the law or for any other controller."""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from opspace.law.hierarchy import Level, WhitenedTask, hard_law

Solver = Callable[[frozenset[int], Sequence[Float[np.ndarray, " _"]]], Float[np.ndarray, " n"]]
"""(present, desired values of all task sets) → command, of whatever controller is to be blended."""

Outcome = Callable[[int, Float[np.ndarray, " n"]], Float[np.ndarray, " m"]]
"""(k, command) → what the command does to task set k, for example J_k A⁻¹ Γ."""


class Recursion:
    """The recursion over subsets, each solved once (Eq. 9, Eq. 12, Eq. 13, Eq. 18, Eq. 20, Eq. 23).

    f_k^i(S) = h_k f_k + (1 − h_k) J_k A⁻¹ Γ(S∖k)        Γ(S) = H(S; f^i(S))        Γ(∅) = H(∅)

    Args:
        desired: f̃_k of every task set.
        activations: h_k of every task set.
        solve: The controller H with every task set of the subset fully active.
        outcome: Acceleration that a command causes in one task set.
        drop_inactive: Leave task sets with h = 0 out of the subsets, which changes nothing for a
            controller that the theorem of docs/theory.md covers.

    Attributes:
        solves: How many times the controller has been called.
    """

    def __init__(
        self,
        desired: Sequence[Float[np.ndarray, " _"]],
        activations: Sequence[float],
        solve: Solver,
        outcome: Outcome,
        *,
        drop_inactive: bool = True,
    ) -> None:
        self._desired = desired
        self._activations = activations
        self._solve = solve
        self._outcome = outcome
        self._drop_inactive = drop_inactive
        self._commands: dict[frozenset[int], Float[np.ndarray, " n"]] = {}
        self.solves = 0

    def command(self, subset: frozenset[int]) -> Float[np.ndarray, " n"]:
        """Γ(S): the command for a subset with its activations."""
        present = subset
        if self._drop_inactive:
            present = frozenset(k for k in subset if self._activations[k] > 0.0)
        if present not in self._commands:
            values = [
                self.intermediate(k, present) if k in present else self._desired[k]
                for k in range(len(self._desired))
            ]
            self.solves += 1
            self._commands[present] = self._solve(present, values)
        return self._commands[present]

    def intermediate(self, k: int, subset: frozenset[int]) -> Float[np.ndarray, " m"]:
        """f_k^i(S): the intermediate desired value of task set k in a subset that contains it."""
        h = self._activations[k]
        if h == 1.0:
            return self._desired[k]
        return h * self._desired[k] + (1.0 - h) * self._outcome(k, self.command(subset - {k}))


def law_recursion(
    whitened: Sequence[WhitenedTask],
    levels: Sequence[Level],
    activations: Sequence[float],
    n: int,
    *,
    compensate: bool = True,
) -> Recursion:
    """Set up the recursion for the hard law itself, in whitened coordinates.

    Args:
        whitened: Every task set.
        levels: Every level, most important first.
        activations: h_k of every task set.
        n: Number of joints.
        compensate: False for Eq. 15-23 to the letter.

    Returns:
        The recursion, whose commands are whitened torques û.
    """

    def solve(
        present: frozenset[int], values: Sequence[Float[np.ndarray, " _"]]
    ) -> Float[np.ndarray, " n"]:
        fed = [
            WhitenedTask(task.J, f, task.unrest) for task, f in zip(whitened, values, strict=True)
        ]
        return hard_law(fed, levels, present, n, compensate=compensate)

    return Recursion(
        [task.f for task in whitened],
        activations,
        solve,
        lambda k, u: whitened[k].J @ u,
        drop_inactive=compensate,
    )
