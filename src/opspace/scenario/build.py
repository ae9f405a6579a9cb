"""Builds robot, stack, controller and plant from a scenario; nothing else does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from opspace.contacts import GroundContact
from opspace.controller import Controller, FallRule, ReferenceController
from opspace.errors import InputError, OpspaceError, UnknownNameError
from opspace.loop import StopRule
from opspace.plan.scales import Singularity
from opspace.robots import Robot, load_robot
from opspace.scenario.build_contacts import build_contacts, build_ground, set_down
from opspace.scenario.build_tasks import build_tasks, check_configuration, configuration
from opspace.scenario.events import Event, depending, in_order, insertion_level, late_tasks
from opspace.scenario.load import to_dict
from opspace.scenario.schema import Scenario
from opspace.scenario.triggers import Ask, Triggers
from opspace.sim import Disturbances, Plant, Push
from opspace.stack import Stack
from opspace.tasks import JointLimits, Task

SWITCH = "step"
"""Activation profile of the method ``switch``."""
SUBSTEPS = 2
"""Steps of the simulation in each tick of a robot on contacts."""
SCENARIO_KEY = "scenario"
"""Where the header of a recording holds its scenario."""


@dataclass(frozen=True)
class Built:
    """A scenario turned into objects, ready for `opspace.loop.simulate`.

    Attributes:
        scenario: What it was built from.
        robot: The robot that the controller computes with.
        stack: The tasks, with the events of the scenario waiting in it.
        tasks: Every task by name, those included that events insert.
        controller: The controller.
        plant: The simulated robot at the start of the run.
        stop: When the run is given up.
        contacts: Every contact by name, those included that events insert.
        triggers: Starts the events that wait for something to be felt; an observer of the run.
    """

    scenario: Scenario
    robot: Robot
    stack: Stack
    tasks: Mapping[str, Task]
    controller: ReferenceController
    plant: Plant
    stop: StopRule
    contacts: Mapping[str, GroundContact]
    triggers: Triggers

    @property
    def header(self) -> dict[str, Any]:
        """What the header of a recording says of the run, for `opspace.BlackBox` too."""
        scenario = self.scenario
        return {SCENARIO_KEY: to_dict(scenario), "seed": scenario.seed, "dt": scenario.dt}


def build(scenario: Scenario, controller: Callable[..., ReferenceController] = Controller) -> Built:
    """Build what a scenario describes.

    Args:
        scenario: The scenario.
        controller: Makes the controller.

    Returns:
        The objects.

    Raises:
        ScenarioError: A name that the robot does not have, or a value that does not fit it.
        ModelError: The robot's file cannot be used.
        MissingExtraError: The robot or the simulator is not installed.
    """
    robot = build_robot(scenario)
    contacts = build_contacts(scenario, robot)
    late = late_tasks(scenario.events, scenario.contacts)
    touching = [contact for name, contact in contacts.items() if name not in late]
    q = set_down(scenario, robot, _start(scenario, robot), touching)
    robot.update(q, np.zeros(robot.nv))
    tasks = build_tasks(scenario, robot)
    stack = Stack(_levels(scenario, tasks), limits=_joint_limits(scenario), contacts=touching)
    kept_apart = _collisions(scenario, robot)
    try:
        driver = controller(
            robot,
            stack,
            blending=scenario.blending,
            torque_limits=scenario.torque_limits,
            bias=scenario.bias,
            singularity=_singularity(scenario),
            **kept_apart,
            **_falling(scenario),
        )
    except (InputError, UnknownNameError) as error:
        raise scenario.error(
            ("joint_limits", *_unknown_joints(scenario, robot)), str(error)
        ) from error
    plant = _plant(scenario, robot, q, contacts)
    members = {**tasks, **contacts}
    open_members = depending(scenario.events)
    triggers = Triggers(lambda: plant.contact_forces, contacts)
    for place, event in in_order(scenario.events):
        ask = _request(scenario, stack, members, place, event)
        if event.when is None and not set(event.tasks) & open_members:
            ask(event.at)
        else:
            triggers.wait(event, ask)
    stop = StopRule(scenario.stop.max_joint_speed, scenario.stop.max_torque)
    return Built(scenario, robot, stack, tasks, driver, plant, stop, contacts, triggers)


def _plant(
    scenario: Scenario, robot: Robot, q: np.ndarray, contacts: Mapping[str, GroundContact]
) -> Plant:
    option = scenario.plant
    try:
        return Plant(
            robot,
            q,
            dt=scenario.dt,
            friction=option.friction,
            torque_limits=option.torque_limits,
            surfaces=[surface.build() for surface in option.surfaces],
            holes=[hole.build() for hole in option.holes],
            disturbances=Disturbances(
                mass_error=option.mass_error,
                dry_friction=option.dry_friction,
                delay=option.delay,
                position_noise=option.position_noise,
                velocity_noise=option.velocity_noise,
                wrench_noise=option.wrench_noise,
                wrench_delay=option.wrench_delay,
                pushes=[
                    Push(push.at, push.duration, push.force, push.frame) for push in option.pushes
                ],
                seed=scenario.seed,
            ),
            ground=build_ground(scenario, contacts),
            substeps=SUBSTEPS if contacts and option.substeps is None else option.substeps,
        )
    except (InputError, UnknownNameError) as error:
        raise scenario.error(("plant",), str(error)) from error


def build_robot(scenario: Scenario) -> Robot:
    """Load the robot of a scenario, with the frames and the payload that it says.

    Args:
        scenario: The scenario.

    Returns:
        The robot.

    Raises:
        ScenarioError: There is no robot of this name, or a name or number does not fit it.
        ModelError: The robot's file cannot be used.
        MissingExtraError: The robot is not installed.
    """
    own_tool = scenario.tool in scenario.frames
    try:
        robot = load_robot(
            scenario.robot,
            backend=scenario.backend,
            floating_base=scenario.floating_base,
            joints=scenario.joints,
            locked=scenario.locked,
            tool=None if own_tool else scenario.tool,
            reference=scenario.reference,
        )
    except UnknownNameError as error:
        raise scenario.error((_key_of(scenario, error.name),), str(error)) from error
    for name, frame in scenario.frames.items():
        try:
            robot.add_frame(name, frame.parent, frame.placement)
        except (InputError, UnknownNameError) as error:
            raise scenario.error(("frames", name), str(error)) from error
    if own_tool:
        assert scenario.tool is not None
        robot.tool = scenario.tool
    if scenario.payload is not None:
        try:
            robot.payload = scenario.payload.build()
        except (InputError, UnknownNameError) as error:
            raise scenario.error(("payload",), str(error)) from error
    return robot


def _key_of(scenario: Scenario, name: str) -> str:
    """Return the key that gave a name."""
    named = {
        "joints": scenario.joints or (),
        "locked": scenario.locked,
        "tool": (scenario.tool,),
        "reference": scenario.reference or (),
    }
    return next((key for key, names in named.items() if name in names), "robot")


def _start(scenario: Scenario, robot: Robot) -> np.ndarray:
    try:
        return check_configuration(configuration(scenario.start, robot), robot)
    except OpspaceError as error:
        raise scenario.error(("start",), str(error)) from error


def _levels(scenario: Scenario, tasks: Mapping[str, Task]) -> dict[float, list[Task]]:
    late = late_tasks(scenario.events, scenario.tasks)
    by_level: dict[float, list[Task]] = {}
    for name, entry in scenario.tasks.items():
        if name not in late:
            by_level.setdefault(float(entry.level), []).append(tasks[name])
    return by_level


def _request(
    scenario: Scenario,
    stack: Stack,
    members: Mapping[str, Task | GroundContact],
    place: int,
    event: Event,
) -> Ask:
    """Make what asks the stack for an event, to start at a time [s], or at once where it is None."""
    smooth = scenario.method == "transition"
    duration = event.duration if smooth else 0.0
    profile = event.profile if smooth else SWITCH
    first, last = members[event.tasks[0]], members[event.tasks[-1]]

    def ask(at: float | None) -> None:
        if at is None and event.kind == "remove" and not _there(stack, first):
            return  # what it waited for has not come
        timing: Any = {"profile": profile, "start_time": at}
        try:
            match event.kind:
                case "insert":
                    if isinstance(first, GroundContact):
                        stack.insert(first, duration, **timing)
                    else:
                        level = insertion_level(event, scenario.tasks)
                        stack.insert(first, level, duration, **timing)
                case "remove":
                    stack.remove(first, duration, wait=event.wait, **timing)
                case "move":
                    assert isinstance(first, Task)
                    assert event.level is not None
                    stack.move(first, event.level, duration, **timing)
                case "swap":
                    assert isinstance(first, Task)
                    assert isinstance(last, Task)
                    stack.swap(first, last, duration, **timing)
        except OpspaceError as error:
            raise scenario.error(("events", place), str(error)) from error

    return ask


def _there(stack: Stack, member: Task | GroundContact) -> bool:
    return member.name in stack.contacts or member in stack


def _joint_limits(scenario: Scenario) -> JointLimits | None:
    option = scenario.joint_limits
    if option is None or scenario.method == "none":
        return None
    return JointLimits(
        option.buffer,
        mode=option.mode,
        joints=option.joints,
        speeds=option.speeds,
        clearance=option.clearance,
        observer_time=option.observer_time,
        brake_acceleration=option.brake_acceleration,
        profile=SWITCH if scenario.method == "switch" else option.profile,
    )


def _collisions(scenario: Scenario, robot: Robot) -> dict[str, Any]:
    """Bind what is kept apart to the robot; the option of a controller, none where there is nothing."""
    if scenario.collisions is None or scenario.method == "none":
        return {}
    try:
        guard = scenario.collisions.build()
        guard.bind(robot)
    except OpspaceError as error:
        raise scenario.error(("collisions",), str(error)) from error
    return {"collisions": guard}


def _falling(scenario: Scenario) -> dict[str, Any]:
    """Make the rule by which a robot on contacts is given up; the option of a controller."""
    option = scenario.falling
    if option is None or not scenario.contacts:
        return {}
    return {"falling": FallRule(option.after, option.tilt)}


def _unknown_joints(scenario: Scenario, robot: Robot) -> tuple[str, ...]:
    """Name the entry of the joint limits that has a joint which the robot has not, if there is one."""
    option = scenario.joint_limits
    named = {} if option is None else {"joints": option.joints, "speeds": option.speeds or {}}
    return tuple(key for key, joints in named.items() if set(joints) - set(robot.joint_names))[:1]


def _singularity(scenario: Scenario) -> Singularity | None:
    option = scenario.singularity
    if option is None or scenario.method == "none":
        return None
    profile = SWITCH if scenario.method == "switch" else option.profile
    return Singularity(
        option.lower,
        option.upper,
        option.scale,
        profile,
        option.release,
        option.damping,
        option.near,
    )
