"""The whole law as one walk down the levels that branches only where something is half active."""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from opspace.law.blending import Weighted
from opspace.law.hierarchy import Level, Partial, WhitenedTask, solve_level, stack_rows, start
from opspace.law.scalars import room_for
from opspace.law.singular_directions import (
    Alternative,
    LevelOutcome,
    SigmaBuffer,
    Spectrum,
    solve_level_smoothly,
    spectrum_of,
)


@dataclass(frozen=True)
class LevelReport:
    """What happened at one level on the heaviest branch of the walk.

    Attributes:
        priority: Priority of the level.
        members: Indices of the task sets present, in the order of their rows.
        weight: Weight of the branch that this report describes.
        spectrum: Directions of the level, or None where they were not computed.
        scale: Part of its torque that the level got, the mean over all branches.
    """

    priority: int
    members: tuple[int, ...]
    weight: float
    spectrum: Spectrum | None
    scale: float = 1.0


class Motors(NamedTuple):
    """What the motors can give.

    Attributes:
        L: Lower Cholesky factor of the inertia, shape (n, n).
        start: Torque before the first level, inside the limits, shape (n,), N·m.
        limit: Largest torque of each joint, shape (n,), N·m; inf where there is none.
    """

    L: Float[np.ndarray, "n n"]
    start: Float[np.ndarray, " n"]
    limit: Float[np.ndarray, " n"]

    def scale(self, above: Float[np.ndarray, " n"], below: Float[np.ndarray, " n"]) -> float:
        """Part of the step from û ``above`` to ``below`` that they can give, see `room_for`."""
        part = self.L @ (below - above)
        return room_for(part, self.start + self.L @ above, self.limit)


@dataclass
class WalkReport:
    """The cost of one evaluation and what it found.

    Attributes:
        hard_solves: Corners of the blend: stacks whose hard torque entered the sum.
        level_solves: Levels that were actually solved; corners share the levels above their first
            difference.
        levels: One report per level that was reached.
        got: Per priority the sums of weight times scale, and of weight.
    """

    hard_solves: int = 0
    level_solves: int = 0
    levels: dict[int, LevelReport] = field(default_factory=dict[int, LevelReport])
    got: dict[int, tuple[float, float]] = field(default_factory=dict[int, tuple[float, float]])


class Walk:
    """Sum of weight · H(T; f) over the corners T of a blend, sharing the levels that corners share.

    Args:
        whitened: Every task set.
        levels: Every level, most important first.
        buffer: Buffer on σ for the singular directions, or None for the plain law.
        compensate: False for Eq. 15-16 to the letter.
        want_spectra: Compute every level's spectrum for the report, needed or not.
        motors: Scale levels, the lowest first, so that every branch stays inside the torque limits.
        motion: Whitened velocity Lᵀ q̇, (n,), which a buffer with damping needs; None is at rest.
    """

    def __init__(
        self,
        whitened: Sequence[WhitenedTask],
        levels: Sequence[Level],
        *,
        buffer: SigmaBuffer | None = None,
        compensate: bool = True,
        want_spectra: bool = False,
        motors: Motors | None = None,
        motion: Float[np.ndarray, " n"] | None = None,
    ) -> None:
        self._whitened = whitened
        self._levels = levels
        self._buffer = buffer
        self._compensate = compensate
        self._want_spectra = want_spectra
        self._motors = motors
        self._motion = motion
        self.report = WalkReport()

    def torque(self, blend: Sequence[Weighted], n: int) -> Float[np.ndarray, " n"]:
        """Whitened torque û(h) of the blend, shape (n,)."""
        self.report = WalkReport(hard_solves=len(blend))
        return self._descend(0, start(n), 1.0, blend)

    def _descend(
        self, depth: int, above: Partial, weight: float, blend: Sequence[Weighted]
    ) -> Float[np.ndarray, " n"]:
        if depth == len(self._levels) or not above.Z.shape[1]:
            return sum(corner.weight for corner in blend) * above.u
        level = self._levels[depth]
        groups: dict[frozenset[int], list[Weighted]] = {}
        for corner in blend:
            groups.setdefault(corner.present & level.members, []).append(corner)
        total = np.zeros_like(above.u)
        for members, corners in groups.items():
            share = weight * sum(corner.weight for corner in corners)
            for alternative in self._solve(level, members, above, share):
                weight_here = weight * alternative.weight
                partial = alternative.partial
                if members and self._motors is not None:
                    partial = self._inside(
                        level, above, partial, share * alternative.weight, self._motors
                    )
                total += alternative.weight * self._descend(
                    depth + 1, partial, weight_here, corners
                )
        return total

    def _inside(
        self, level: Level, above: Partial, partial: Partial, share: float, motors: Motors
    ) -> Partial:
        """Scale what a level adds, so that the motors can give it."""
        scale = motors.scale(above.u, partial.u)
        total, weight = self.report.got.get(level.priority, (0.0, 0.0))
        self.report.got[level.priority] = total + share * scale, weight + share
        return Partial(above.u + scale * (partial.u - above.u), partial.Z)

    def _moves(self, above: Partial) -> Float[np.ndarray, " n"]:
        return np.zeros_like(above.u) if self._motion is None else self._motion

    def _solve(
        self, level: Level, members: frozenset[int], above: Partial, share: float
    ) -> list[Alternative]:
        if not members:
            return [Alternative(1.0, above)]
        self.report.level_solves += 1
        J, f = stack_rows(self._whitened, members)
        if self._buffer is None:
            partial = solve_level(J, f, above, compensate=self._compensate)
            spectrum = spectrum_of(J, above) if self._want_spectra else None
            outcome = LevelOutcome([Alternative(1.0, partial)], spectrum)
        else:
            outcome = solve_level_smoothly(
                J,
                f,
                above,
                self._buffer,
                self._moves(above),
                unrest=math.hypot(*(self._whitened[k].unrest for k in members)),
                want_spectrum=self._want_spectra,
            )
        known = self.report.levels.get(level.priority)
        if known is None or share > known.weight:
            self.report.levels[level.priority] = LevelReport(
                level.priority, tuple(sorted(members)), share, outcome.spectrum
            )
        return outcome.alternatives
