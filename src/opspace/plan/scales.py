"""Options of the controller, and what they mean for a robot and its tasks."""

from __future__ import annotations

import weakref
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.law import SigmaBuffer
from opspace.law.scalars import TURN_PER_METRE
from opspace.plan.calibration import Calibration, Workspace
from opspace.robots.protocol import Robot
from opspace.tasks import ForceTask, JointTask, PostureTask, Task

NEAR = 0.3
"""How far from its target a task in metres is anything but at rest there, m, if nobody says."""


@dataclass(frozen=True)
class Singularity:
    """How directions that the robot is about to lose are faded out (Section 4.1).

    With ``scale="relative"`` the eigenvalues σ of Eq. 25 are multiples of what is usual for the
    task on this robot: the median over the workspace of the smallest eigenvalue of its own Λ⁻¹,
    separately for rows in metres and in radians. One default then serves every robot. With
    ``scale="absolute"`` they are in 1/kg and 1/(kg·m²), as in the paper.

    A direction inside the buffer answers less and is damped, but arrives; only in the lower part of
    the buffer, ``release``, do the levels below get its motion, see `opspace.law.SigmaBuffer`. With
    a narrower release fewer reachable targets rest with an error, and an arm that has been stretched
    out comes back later, perhaps not at all.

    A task that rests at its target inside the release would keep an error there, since the levels below
    pull at it. So both buffers lie lower where a level has been nearly at rest at its targets for some
    0.3 s: 0.01 to 0.05 and 0.01 to 0.03 with the defaults. A level is the nearer to rest the smaller its
    errors are against ``near`` and the slower the robot is as a whole, see
    `opspace.law.scalars.unrest_of`; what is fast or far away has the buffers above. A robot that waits
    just out of reach is nearer to its singularity then, and leaves it more steeply.

    Args:
        lower: σ at and below which a direction is absent.
        upper: σ at and above which a direction is fully active.
        scale: ``"relative"`` or ``"absolute"``.
        profile: Name of the activation profile.
        release: Part of the buffer, from its lower edge, in which a direction is released to the levels
            below. 1 is the one buffer of the paper, in which directions are released wherever they
            fade, and a task that rests inside it keeps an error.
        damping: Of the joint motion along a direction that answers in part, 1/s; none with release 1.
        near: How far from its target a task in metres is anything but at rest there, m; one in radians
            is at 1 rad for each 0.3 m of it. 0 has the same buffers at rest as in motion; None is
            0.3 m, or 0 with one buffer, absolute eigenvalues or the profile of a switch.

    Raises:
        InputError: Not 0 < lower < upper, not 0 < release <= 1, a damping or ``near`` below 0, or a
            ``near`` above it with one buffer or absolute eigenvalues.
        UnknownNameError: An unknown scale or profile.
    """

    lower: float = 0.05
    upper: float = 0.7
    scale: str = "relative"
    profile: str = "quintic"
    release: float = 0.4
    damping: float = field(default=10.0, repr=False)
    near: float | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.scale not in ("relative", "absolute"):
            raise unknown_name("scale", self.scale, ("relative", "absolute"))
        if not 0.0 < self.release <= 1.0:
            raise InputError(f"release is a part of the buffer, 0 to 1, got {self.release}")
        if self.near is not None and not 0.0 <= self.near < float("inf"):
            raise InputError(f"near is a distance, 0 for none, got {self.near}")
        if self.near and not self._may_rest:
            raise InputError(
                "near takes two buffers of relative eigenvalues: release below 1, scale 'relative'"
            )
        _ = self.buffer

    @property
    def _may_rest(self) -> bool:
        return self.release < 1.0 and self.scale == "relative"

    @property
    def rests_within(self) -> tuple[float, float]:
        """How near its target a task is at rest, m and rad; 0 where buffers are the same at rest."""
        # What is switched is mixed with nothing.
        usual = NEAR if self._may_rest and self.profile != "step" else 0.0
        near = usual if self.near is None else self.near
        return near, TURN_PER_METRE * near

    @property
    def buffer(self) -> SigmaBuffer:
        """The buffers as numbers."""
        if self.release == 1.0:
            return SigmaBuffer(self.lower, self.upper, self.profile)
        edge = self.lower + self.release * (self.upper - self.lower)
        return SigmaBuffer(self.lower, self.upper, self.profile, edge, self.damping)


DEFAULT_SINGULARITY = Singularity()


FORCE = 0.1
"""Reference of the rows of forces as a part of that of motions. What such a row asks for is damping, and
a speed that falls with σ, whose torques stay bounded where σ goes to zero: it fades much later."""


class Scales:
    """What σ is measured in: one reference per task row, the same whenever the task is prepared.

    Args:
        robot: The robot of the controller.
        option: How singular directions are faded out, None for not at all.
    """

    def __init__(self, robot: Robot, option: Singularity | None) -> None:
        self._robot = robot
        self._option = option
        self._workspace = Workspace(robot)
        self._known: dict[int, tuple[weakref.ref[Task], np.ndarray, np.ndarray]] = {}
        self.buffer: SigmaBuffer | None = None
        # Rows of Lᵀ have σ = 1 in whatever is left; this puts them above any buffer.
        self.joint, self.unit = 1.0, 1.0
        if option is not None:
            self.buffer = option.buffer
            # A⁻¹ has no eigenvalue below joint_sigma: joint rows scaled like this are never
            # singular.
            self.joint = 0.5 * self._workspace.joint_sigma / option.upper
            self.unit = 0.5 / option.upper

    def prepare(self, task: Task) -> None:
        """Bind a task and its activation to the robot, and find its scale where that is not known yet.

        Args:
            task: A task that no tick is using.

        Raises:
            InputError: It does not fit the robot.
            UnknownNameError: It names what the robot does not have.
        """
        if self._find(task) is None:
            workspace = self._workspace.reference(task)
            task.reset()
            entry = (weakref.ref(task), workspace, self._scale(task, workspace))
            alive = {k: v for k, v in self._known.items() if v[0]() is not None}
            # Replaced as a whole, because a tick in another thread may be reading it.
            self._known = {**alive, id(task): entry}
        task.bind(self._robot)
        bind = getattr(task.activation, "bind", None)
        if bind is not None:
            bind(self._robot)

    def reference(self, task: Task) -> np.ndarray:
        """Return the reference of a prepared task's rows, (m,).

        Raises:
            InputError: It is not prepared.
        """
        found = self._find(task)
        if found is None:
            raise InputError(
                f"task {task.name!r} was not prepared for this controller: a stack belongs to one "
                "controller, the last one that was built with it"
            )
        return found[1]

    def references(self, tasks: Iterable[Task]) -> list[np.ndarray]:
        """Return `reference` of every task."""
        return [self.reference(task) for task in tasks]

    @property
    def know_rest(self) -> bool:
        """Whether a task can be at rest at its target."""
        return self._option is not None and self._option.rests_within[0] > 0.0

    def near(self, task: Task) -> np.ndarray:
        """Return 1/e₀ of a task's rows for `unrest_of` of the law, (m,), 0 where never at rest."""
        if self._option is None or isinstance(task, PostureTask | JointTask):
            return np.zeros(task.rows)
        within: dict[str, float] = dict(zip(("m", "rad"), self._option.rests_within, strict=True))
        found = [within.get(unit, 0.0) for unit in task.error_units]
        return np.array([1.0 / e if e > 0.0 else 0.0 for e in found])

    def calibration(self, tasks: list[Task]) -> Calibration:
        """Return the scales of the robot and of prepared tasks."""
        found = {task.name: self._find(task) for task in tasks}
        return Calibration(
            self._workspace.brake,
            self._workspace.joint_sigma,
            {name: scales[0] for name, scales in found.items() if scales is not None},
        )

    def _find(self, task: Task) -> tuple[np.ndarray, np.ndarray] | None:
        # By identity: a task of one's own need not be hashable.
        entry = self._known.get(id(task))
        return entry[1:] if entry is not None and entry[0]() is task else None

    def _scale(self, task: Task, workspace: np.ndarray) -> np.ndarray:
        if self._option is None:
            return np.ones(task.rows)
        if isinstance(task, PostureTask | JointTask):
            return np.full(task.rows, self.joint)
        if self._option.scale == "absolute":
            return np.ones(task.rows)
        return FORCE * workspace if isinstance(task, ForceTask) else workspace
