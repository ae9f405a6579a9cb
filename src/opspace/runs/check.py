"""What the controller will see of a robot, before anything moves."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from itertools import islice
from typing import Any

import numpy as np

from opspace.controller import Controller
from opspace.errors import InputError
from opspace.plan.calibration import BRAKE_RANGE, STRUCTURAL, Calibration
from opspace.plan.scales import Singularity
from opspace.robots.adapter import AdapterBase, held_joints
from opspace.robots.joint_units import joint_units
from opspace.robots.motor_range import motor_range
from opspace.robots.protocol import Robot
from opspace.robots.sampled_postures import sample_postures
from opspace.stack import Stack
from opspace.tasks import OrientationTask, PositionTask, Task

NEAR_LIMIT = 0.1
"""A reference posture closer to a joint limit than this is reported, rad or m..."""
NEAR_END = 0.1
"""... unless it is further away than this part of the range: fingers go a few centimetres."""
POSTURES = 8
"""Postures in which a joint is tried out."""
UNMOVED = 1e-9
"""A tool that moves less than this, m or rad per rad or m, is not moved."""
ROUNDING = 1e-12
"""What is smaller is none, in whatever unit."""


@dataclass(frozen=True)
class JointReport:
    """One joint as the controller sees it; None where the file does not say.

    Attributes:
        name: Its name.
        unit: Of its position, rad or m.
        reference: Position in the reference posture, rad or m.
        lower: Lower limit, rad or m.
        upper: Upper limit, rad or m.
        max_velocity: rad/s or m/s.
        max_torque: In both directions, N·m or N.
        least_torque: N·m or N.
        most_torque: N·m or N.
        gravity: Torque that holds the reference posture, N·m or N; springs of the file count.
        brake: Acceleration with which joint limits count on braking, rad/s² or m/s².
    """

    name: str
    unit: str
    reference: float
    lower: float | None
    upper: float | None
    max_velocity: float | None
    max_torque: float | None
    least_torque: float | None
    most_torque: float | None
    gravity: float
    brake: float | None


@dataclass(frozen=True)
class RobotCheck:
    """A robot as the controller sees it.

    Attributes:
        robot: Its name.
        source: Its file.
        dof: Number of velocity coordinates.
        tool: Default tool frame.
        joints: Its joints; those of a floating base are left out.
        locked: Where joints of the file are held, rad or m; None for those with several
            coordinates.
        coupled: Joints that follow others, with the relation.
        beside: Joints that do not move the tool: wheels and casters of a base that stands, fingers, the
            other arm.
        sigma: Eigenvalues of J M⁻¹ Jᵀ at the reference posture by task, strongest first, as
            multiples of what is usual in the workspace.
        scale: That mean by task, 1/kg or 1/(kg·m²).
        buffer: Multiples at which directions are absent and fully active.
        warnings: What deserves a look.
    """

    robot: str
    source: str
    dof: int
    tool: str
    joints: tuple[JointReport, ...]
    locked: dict[str, float | None]
    coupled: tuple[str, ...]
    beside: tuple[str, ...]
    sigma: dict[str, tuple[float, ...]]
    scale: dict[str, float]
    buffer: tuple[float, float]
    warnings: tuple[str, ...]


def check_robot(robot: Robot) -> RobotCheck:
    """Ask a controller with default settings what it makes of a robot.

    Args:
        robot: The robot; its state is changed.

    Returns:
        The report.
    """
    option = Singularity()
    sigma: dict[str, tuple[float, ...]] = {}
    scale: dict[str, float] = {}
    warnings: list[str] = []
    calibration = None
    for task in (OrientationTask(), PositionTask()):
        try:
            controller = Controller(robot, Stack([task]), singularity=option)
        except InputError as error:
            warnings.append(str(error))
            break
        calibration = controller.calibration
        sigma[task.name] = _sigma(controller)
        scale[task.name] = float(calibration.references[task.name][0])
        warnings += _singular(task, sigma[task.name], option, _directions(robot, task))
    robot.update(robot.q_reference, np.zeros(robot.nv))
    joints = _joints(robot, calibration)
    return RobotCheck(
        robot=robot.name,
        source=str(robot.source or "in memory"),
        dof=robot.nv,
        tool=robot.tool,
        joints=joints,
        locked=dict(held_joints(robot)),
        coupled=_coupled(robot),
        beside=() if calibration is None else _beside(robot),
        sigma=sigma,
        scale=scale,
        buffer=(option.lower, option.upper),
        warnings=(*_of_file(robot), *warnings, *_joint_warnings(joints)),
    )


def to_plain(report: RobotCheck) -> dict[str, Any]:
    """Write a report in JSON's types.

    Args:
        report: The report.

    Returns:
        The same, with null for what is not known.
    """
    return asdict(report)


def rounded(value: float) -> str:
    """Write a number for people: three digits, thousands in full, what is rounding only as zero."""
    size = abs(value)
    return f"{value:.0f}" if 999.5 <= size < 1e6 else f"{value if size > ROUNDING else 0.0:.3g}"


def _sigma(controller: Controller) -> tuple[float, ...]:
    robot = controller.robot
    (level,) = controller.step(0.0, robot.q_reference, np.zeros(robot.nv)).levels
    return tuple(level.sigma.tolist())


def _joints(robot: Robot, calibration: Calibration | None) -> tuple[JointReport, ...]:
    base = robot.nq - int(np.sum(robot.actuated))
    reference = robot.q_reference[base:]
    units, motors = joint_units(robot), motor_range(robot)
    found = []
    for place, i in enumerate(np.flatnonzero(robot.actuated)):
        found.append(
            JointReport(
                name=robot.joint_names[i],
                unit=units[i],
                reference=float(reference[place]),
                lower=_known(robot.q_lower[i]),
                upper=_known(robot.q_upper[i]),
                max_velocity=_known(robot.velocity_limit[i]),
                max_torque=_known(robot.torque_limit[i]),
                least_torque=_known(motors.least[i]),
                most_torque=_known(motors.most[i]),
                gravity=float(robot.bias[i]),
                brake=None if calibration is None else float(calibration.brake[i]),
            )
        )
    return tuple(found)


def _of_file(robot: Robot) -> tuple[str, ...]:
    """Return what was found when the file was read; a robot of one's own has none."""
    return robot.description.warnings if isinstance(robot, AdapterBase) else ()


def _coupled(robot: Robot) -> tuple[str, ...]:
    return tuple(map(str, robot.description.couplings)) if isinstance(robot, AdapterBase) else ()


def _beside(robot: Robot) -> tuple[str, ...]:
    """Name the joints that move the tool in none of some postures."""
    moved, frame = np.zeros(robot.nv), robot.frame_id(robot.tool)
    for q in islice(sample_postures(robot), POSTURES):
        robot.update(q, np.zeros(robot.nv))
        moved = np.maximum(moved, np.abs(robot.jacobian(frame)).max(axis=0))
    return tuple(n for n, most in zip(robot.joint_names, moved, strict=True) if most < UNMOVED)


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _directions(robot: Robot, task: Task) -> int:
    """Count the directions of a task that some posture moves: no other would bring more."""
    most = 0
    for q in islice(sample_postures(robot), POSTURES):
        robot.update(q, np.zeros(robot.nv))
        J = task.evaluate(robot, 0.0).J
        sigma = np.linalg.eigvalsh(J @ np.linalg.solve(robot.M, J.T))
        most = max(most, int(np.sum(sigma > STRUCTURAL * sigma[-1])))
    return most


def _singular(
    task: Task, sigma: tuple[float, ...], option: Singularity, directions: int
) -> list[str]:
    found: list[str] = []
    if directions < task.rows:
        missing = task.rows - directions
        found.append(
            f"{missing} of {task.rows} directions of the {task.name} cannot be moved at all"
        )
    weakest = sigma[directions - 1] if 0 < directions <= len(sigma) else option.upper
    if weakest >= option.upper:
        return found
    released = option.buffer.release_upper
    effect = (
        f"below {released:.2g}, where lower levels pull at it and targets keep an error"
        if weakest < released
        else f"below {option.upper:g}, where it answers less and targets are reached later"
    )
    return [
        *found,
        f"the reference posture is near a singularity of the {task.name}: the weakest "
        f"eigenvalue {rounded(weakest)} lies {effect}; load_robot(reference=...) takes another",
    ]


def _joint_warnings(joints: tuple[JointReport, ...]) -> list[str]:
    def named(found: list[JointReport]) -> str:
        return ", ".join(joint.name for joint in found)

    unknown = [j for j in joints if j.max_torque is None]
    near = [j for j in joints if _room(j) < min(NEAR_LIMIT, NEAR_END * _range(j))]
    weak = [j for j in joints if not _holds(j)]
    slow = [j for j in joints if j.brake == BRAKE_RANGE[0]]
    checks = [
        (unknown, "no torque limit is known for {}; nothing keeps their torque in bounds"),
        (near, f"the reference posture is within {NEAR_LIMIT:g} of a limit of {{}}"),
        (weak, "the reference posture cannot be held: its torque is above the limit of {}"),
        (slow, "some posture leaves almost no torque to brake {}: their limits act early"),
    ]
    return [words.format(named(found)) for found, words in checks if found]


def _holds(joint: JointReport) -> bool:
    """Whether a motor gives what the reference posture takes."""
    least, most = joint.least_torque, joint.most_torque
    return (least is None or least <= joint.gravity) and (most is None or joint.gravity <= most)


def _range(joint: JointReport) -> float:
    """How far a joint can go, rad or m."""
    return _upper(joint) - _lower(joint)


def _lower(joint: JointReport) -> float:
    return -math.inf if joint.lower is None else joint.lower


def _upper(joint: JointReport) -> float:
    return math.inf if joint.upper is None else joint.upper


def _room(joint: JointReport) -> float:
    """Distance of the reference posture from the nearer limit."""
    return min(joint.reference - _lower(joint), _upper(joint) - joint.reference)
