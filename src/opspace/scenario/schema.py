"""Everything that a scenario file can say, with units, ranges and defaults."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator, model_validator

from opspace.errors import ScenarioError
from opspace.law.scalars import LIMIT_LAWS
from opspace.scenario.contact_entries import AnyContact, GroundEntry
from opspace.scenario.document import Document, Key, key_text
from opspace.scenario.events import Event, ProfileName, check_events
from opspace.scenario.fields import Checked, Entry, Number, listed, problem, shown, whole
from opspace.scenario.obstacle_entries import CollisionsEntry
from opspace.scenario.robot_entries import FrameEntry, PayloadEntry
from opspace.scenario.surface_entries import HoleEntry, SurfaceEntry
from opspace.scenario.targets import Configuration
from opspace.scenario.task_entries import AnyTask

if TYPE_CHECKING:
    from typing_extensions import Self

    LimitMode = str
else:
    LimitMode = Literal[tuple(LIMIT_LAWS)]


class SingularityEntry(Entry):
    """How directions that the robot is about to lose are faded out.

    With the scale ``relative``, eigenvalues are multiples of the mean over the robot's workspace of
    the diagonal of J M⁻¹ Jᵀ, separately for rows in m and in rad.
    """

    lower: Annotated[float, Number("1", above=0.0)] = Field(
        default=0.05, description="eigenvalue at and below which a direction is absent"
    )
    upper: Annotated[float, Number("1", above=0.0)] = Field(
        default=0.7, description="eigenvalue at and above which a direction is fully active"
    )
    scale: Literal["relative", "absolute"] = Field(
        default="relative",
        description="multiples of what is usual in the workspace, or absolute [1/kg, 1/(kg·m²)]",
    )
    profile: ProfileName = Field(default="quintic", description="shape of the activation")
    release: Annotated[float, Number("1", above=0.0, at_most=1.0)] = Field(
        default=0.4,
        description="part of the buffer in which directions are released to lower levels",
    )
    damping: Annotated[float, Number("1/s", at_least=0.0)] = Field(
        default=10.0, description="of the joint motion along a direction that answers in part"
    )
    near: Annotated[float, Number("m", at_least=0.0)] | None = Field(
        default=None,
        description="so near its target the buffers are lower; 0 for the same at rest as in motion, "
        "null for 0.3 m with two relative buffers",
    )

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.lower >= self.upper:
            raise problem(f"must be above lower, {self.lower:g}, not {self.upper:g}", "upper")
        return self


class JointLimitsEntry(Entry):
    """How joints are kept within their limits."""

    mode: LimitMode = Field(
        default="admissible",
        description="act on the admissible acceleration, or within a buffer on the position",
    )
    joints: dict[str, Annotated[tuple[float, ...], Number("rad or m", size=2)]] = Field(
        default_factory=dict, description="joint: [lower, upper] in place of the robot's own limits"
    )
    clearance: Annotated[float, Number("rad or m", at_least=0.0)] = Field(
        default=0.0, description="how far inside its limits every joint is kept [rad or m]"
    )
    observer_time: Annotated[float, Number("s", above=0.0)] | None = Field(
        default=None,
        description="time with which limits learn what the model does not explain [s]; null: never",
    )
    speeds: dict[str, Annotated[float, Number("rad/s or m/s", above=0.0)]] | None = Field(
        default_factory=dict,
        description="joint: largest speed in place of the robot's own limit; null limits no speed",
    )
    buffer: Annotated[float, Number("rad or m", above=0.0)] = Field(
        default=0.1, description="width of the buffer inside each limit, for mode buffer [rad or m]"
    )
    brake_acceleration: Annotated[float, Number("rad/s²", above=0.0)] | None = Field(
        default=None,
        description="what a joint can brake with [rad/s²]; null derives it from the robot",
    )
    profile: ProfileName = Field(default="quintic", description="shape of the activation")

    @field_validator("joints")
    @classmethod
    def _check_order(cls, joints: dict[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
        for joint, (lower, upper) in joints.items():
            if lower >= upper:
                raise problem(f"must be [lower, upper], not {shown([lower, upper])}", joint)
        return joints


class PushEntry(Entry):
    """A force on the robot for some time."""

    at: Annotated[float, Number("s", at_least=0.0)] = Field(description="when it begins [s]")
    duration: Annotated[float, Number("s", above=0.0)] = Field(description="how long it lasts [s]")
    force: Annotated[tuple[float, ...], Number("N", size=3)] = Field(
        description="force in world axes [N]"
    )
    frame: str | None = Field(
        default=None, description="name of the frame that is pushed; null is the tool"
    )


class PlantEntry(Entry):
    """What the simulated robot has and the controller does not know about."""

    friction: bool = Field(default=False, description="simulate the friction in the robot's file")
    dry_friction: Annotated[float, Number("1", at_least=0.0, at_most=1.0)] = Field(
        default=0.0, description="dry friction of every joint, as a part of its torque limit"
    )
    mass_error: Annotated[float, Number("1", at_least=0.0, at_most=0.9)] = Field(
        default=0.0,
        description="every link's mass and inertia are off by up to this part, drawn from the seed",
    )
    delay: Annotated[float, Number("s", at_least=0.0, at_most=0.1)] = Field(
        default=0.0, description="how late a torque reaches the joints [s], in whole ticks"
    )
    position_noise: Annotated[float, Number("rad or m", at_least=0.0)] = Field(
        default=0.0, description="standard deviation of measured joint positions [rad or m]"
    )
    velocity_noise: Annotated[float, Number("rad/s or m/s", at_least=0.0)] = Field(
        default=0.0, description="standard deviation of measured joint velocities [rad/s or m/s]"
    )
    pushes: list[PushEntry] = Field(
        default_factory=list, description="forces on the robot, with times"
    )
    surfaces: list[SurfaceEntry] = Field(
        default_factory=list, description="what the tool may press; the wrench there is measured"
    )
    holes: list[HoleEntry] = Field(
        default_factory=list,
        description="holes that a peg on the tool may be put into; the wrench there is measured",
    )
    wrench_noise: Annotated[float, Number("N", at_least=0.0)] = Field(
        default=0.0,
        description="standard deviation of measured forces [N]; of moments a tenth of it [N·m]",
    )
    wrench_delay: Annotated[float, Number("s", at_least=0.0, at_most=0.1)] = Field(
        default=0.0, description="how late a wrench is measured [s], in whole ticks"
    )
    torque_limits: bool = Field(
        default=True, description="saturate the torque at the robot's limits"
    )
    substeps: Annotated[int, Checked(whole)] | None = Field(
        default=None,
        description="steps of the simulation in each tick; null is 1, and more where something touches",
    )


class FallingEntry(Entry):
    """When a robot on contacts is given up: from then on its joints are only damped."""

    after: Annotated[float, Number("s", above=0.0)] = Field(
        default=0.2, description="how long it may be not balanced without getting better [s]"
    )
    tilt: Annotated[float, Number("rad", above=0.0)] = Field(
        default=1.0, description="how far its base may turn from where it was upright [rad]"
    )


class StopEntry(Entry):
    """When a run is given up."""

    max_joint_speed: Annotated[float, Number("rad/s or m/s", above=0.0)] | None = Field(
        default=None, description="joint speed that ends the run [rad/s or m/s]; null is none"
    )
    max_torque: Annotated[float, Number("N·m", above=0.0)] | None = Field(
        default=None, description="joint torque that ends the run [N·m]; null is none"
    )


@dataclass(frozen=True)
class Origin:
    """Where a scenario was read from; it takes no part in comparisons."""

    document: Document | None = field(default=None, compare=False)


class Scenario(Entry):
    """One run: a robot, its tasks and how long."""

    _origin: Origin = PrivateAttr(default=Origin())

    description: str = Field(default="", description="what the scenario shows")
    robot: str = Field(description="name of a robot, or path of a .urdf or .xml file")
    backend: Literal["pinocchio", "mujoco"] = Field(
        default="pinocchio", description="library that computes the controller's dynamics"
    )
    floating_base: bool = Field(default=False, description="free the root link")
    joints: list[str] | None = Field(
        default=None,
        description='names or patterns ("left_*") of the joints to control; those with a motor '
        "where not given",
    )
    locked: dict[str, Annotated[float, Number("rad or m")]] = Field(
        default_factory=dict, description="joint, or pattern: position at which to hold it"
    )
    tool: str | None = Field(
        default=None, description="default tool frame; that of the robot where not given"
    )
    reference: dict[str, Annotated[float, Number("rad or m")]] | None = Field(
        default=None,
        description="joint: its position in the reference posture; others stay where the file has "
        "them",
    )
    frames: dict[str, FrameEntry] = Field(
        default_factory=dict, description="name: a frame of one's own, fixed to another"
    )
    payload: PayloadEntry | None = Field(
        default=None, description="what the robot carries; null is nothing"
    )
    duration: Annotated[float, Number("s", above=0.0, at_most=3600.0)] = Field(
        description="simulated time [s]"
    )
    dt: Annotated[float, Number("s", above=0.0, at_most=0.1)] = Field(
        default=0.001, description="control tick [s]"
    )
    seed: Annotated[int, Checked(whole)] = Field(
        default=0, description="seed of every random number"
    )
    start: Configuration = Field(
        default="reference", description="configuration at the start [rad or m], or its name"
    )
    method: Literal["transition", "switch", "none"] = Field(
        default="transition",
        description="events, contacts, joint limits and singular directions fade or switch; with none "
        "events and contacts "
        "switch and the others are not handled at all",
    )
    torque_limits: Literal["report", "priority"] = Field(
        default="report",
        description="what happens above the motors' limits: report it, or let levels give way, "
        "the lowest first",
    )
    blending: Literal["auto", "idv", "chain", "smooth-chain"] = Field(
        default="auto",
        description="blend of simultaneous transitions: idv for 3 and the chain beyond, "
        "idv with 2^k hard torques, chain with k + 1, or smooth-chain without its kinks",
    )
    bias: Literal["joint", "task"] = Field(
        default="joint",
        description="compensate gravity and Coriolis in every joint or in the tasks only",
    )
    tasks: dict[str, AnyTask] = Field(description="name: what the robot is asked for")
    contacts: dict[str, AnyContact] = Field(
        default_factory=dict,
        description="name: what a robot with a floating base stands on and holds on to; one that "
        "starts in a named configuration is set down on those that are present",
    )
    ground: GroundEntry | None = Field(
        default_factory=GroundEntry,
        description="what contacts really touch; null is nothing",
    )
    falling: FallingEntry | None = Field(
        default_factory=FallingEntry,
        description="when a robot on contacts is given up and only damped; null is never",
    )
    events: list[Event] = Field(
        default_factory=list, description="changes of the stack while the robot moves, with times"
    )
    joint_limits: JointLimitsEntry | None = Field(
        default_factory=JointLimitsEntry, description="joint limit avoidance; null is none"
    )
    collisions: CollisionsEntry | None = Field(
        default=None, description="what the robot must not touch; null is nothing"
    )
    singularity: SingularityEntry | None = Field(
        default_factory=SingularityEntry,
        description="singularity avoidance; null is none, which a robot on contacts has where "
        "nothing is said",
    )
    plant: PlantEntry = Field(default_factory=PlantEntry, description="the simulated robot")
    stop: StopEntry = Field(default_factory=StopEntry, description="when a run is given up")

    @field_validator("robot")
    @classmethod
    def _check_robot(cls, robot: str) -> str:
        if not robot.strip():
            raise problem("must be the name of a robot or the path of a robot file")
        return robot

    @model_validator(mode="before")
    @classmethod
    def _no_buffer_on_contacts(cls, data: Any) -> Any:
        # What is usual in flight says nothing about a robot that stands.
        if isinstance(data, dict) and data.get("contacts"):
            return {"singularity": None, **data}
        return data

    @field_validator("tasks")
    @classmethod
    def _check_names(cls, tasks: dict[str, AnyTask]) -> dict[str, AnyTask]:
        if not tasks:
            raise problem("must have at least one task")
        for name in tasks:
            if not _usable(name):
                raise problem("a task's name must be text without a slash", name)
        return tasks

    @field_validator("contacts")
    @classmethod
    def _check_contacts(
        cls, contacts: dict[str, AnyContact], info: ValidationInfo
    ) -> dict[str, AnyContact]:
        for name in contacts:
            if not _usable(name):
                raise problem("a contact's name must be text without a slash", name)
            if name in info.data.get("tasks", {}):
                raise problem("is the name of a task already", name)
        return contacts

    @model_validator(mode="after")
    def _check_boards(self) -> Self:
        for i, board in enumerate(self.ground.boards if self.ground else ()):
            if board.contact not in self.contacts:
                message = f"boards[{i}]: unknown contact {shown(board.contact)}"
                raise problem(message + listed(self.contacts, board.contact), "ground")
        return self

    @model_validator(mode="after")
    def _check_tick(self) -> Self:
        if self.dt > self.duration:
            raise problem(f"must not be longer than the duration, {self.duration:g} s", "dt")
        return self

    @field_validator("events")
    @classmethod
    def _check_events(cls, events: list[Event], info: ValidationInfo) -> list[Event]:
        if "tasks" in info.data and "contacts" in info.data:
            check_events(events, info.data["tasks"], info.data["contacts"])
        return events

    def __reduce__(self) -> tuple[Any, ...]:
        """Be pickled as plain values; the classes of entries are made and have no place of their own."""
        return _again, (self.model_dump(mode="json"), self._origin)

    def read_from(self, document: Document) -> Self:
        """Remember the document that this was read from, for ``error``."""
        self._origin = Origin(document)
        return self

    def error(self, key: Key, message: str) -> ScenarioError:
        """Build the error about a key that turned out wrong when the scenario was used.

        Args:
            key: The offending key, for example ``("tasks", "position", "frame")``.
            message: What is wrong and what would be right.

        Returns:
            The error, with file and line where the scenario came from a file.
        """
        document = self._origin.document
        if document is None:
            return ScenarioError(message, key=key_text(key))
        return document.error(key, message)


def _usable(name: str) -> bool:
    return bool(name.strip()) and "/" not in name and name == name.strip()


def _again(data: dict[str, Any], origin: Origin) -> Scenario:
    scenario = Scenario.model_validate(data)
    scenario._origin = origin
    return scenario
