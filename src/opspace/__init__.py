"""Operational space control with continuous task transitions.

Everything public is here under one name; it is imported when it is first used, so that
``import opspace`` costs nothing.
"""

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from opspace.command import Command as Command
    from opspace.command import ContactStatus as ContactStatus
    from opspace.command import Distance as Distance
    from opspace.command import LevelStatus as LevelStatus
    from opspace.command import Status as Status
    from opspace.command import TaskStatus as TaskStatus
    from opspace.contacts import EdgeContact as EdgeContact
    from opspace.contacts import GroundContact as GroundContact
    from opspace.contacts import PointContact as PointContact
    from opspace.contacts import SoleContact as SoleContact
    from opspace.controller import Controller as Controller
    from opspace.controller.falling import FallRule as FallRule
    from opspace.errors import InputError as InputError
    from opspace.errors import MissingExtraError as MissingExtraError
    from opspace.errors import ModelError as ModelError
    from opspace.errors import ModelWarning as ModelWarning
    from opspace.errors import OpspaceError as OpspaceError
    from opspace.errors import RecordingError as RecordingError
    from opspace.errors import RobotStoppedError as RobotStoppedError
    from opspace.errors import ScenarioError as ScenarioError
    from opspace.errors import UnknownNameError as UnknownNameError
    from opspace.export.c_library import export_c as export_c
    from opspace.fleet import Fleet as Fleet
    from opspace.fleet import ForceArrays as ForceArrays
    from opspace.fleet import TaskArrays as TaskArrays
    from opspace.law import Activation as Activation
    from opspace.law import Buffer as Buffer
    from opspace.law import LawInfo as LawInfo
    from opspace.law import Profile as Profile
    from opspace.law import Ramp as Ramp
    from opspace.law import SigmaBuffer as SigmaBuffer
    from opspace.law import TaskSet as TaskSet
    from opspace.law import intermediate_values as intermediate_values
    from opspace.law import task_torque as task_torque
    from opspace.loop import AnyPlant as AnyPlant
    from opspace.loop import Driver as Driver
    from opspace.loop import DriverFacts as DriverFacts
    from opspace.loop import Loop as Loop
    from opspace.loop import LoopReport as LoopReport
    from opspace.loop import Observer as Observer
    from opspace.loop import Outcome as Outcome
    from opspace.loop import RealTime as RealTime
    from opspace.loop import RobotState as RobotState
    from opspace.loop import SharedHistory as SharedHistory
    from opspace.loop import Stepping as Stepping
    from opspace.loop import StopRule as StopRule
    from opspace.loop import simulate as simulate
    from opspace.plan.calibration import Calibration as Calibration
    from opspace.plan.scales import Singularity as Singularity
    from opspace.record import Column as Column
    from opspace.record import Recorder as Recorder
    from opspace.record import Recording as Recording
    from opspace.record import load as load
    from opspace.record.black_box import BlackBox as BlackBox
    from opspace.record.observer import TickRecorder as TickRecorder
    from opspace.record.replay import Replay as Replay
    from opspace.record.replay import replay as replay
    from opspace.robots import JointTorqueSensor as JointTorqueSensor
    from opspace.robots import Payload as Payload
    from opspace.robots import Robot as Robot
    from opspace.robots import RobotInfo as RobotInfo
    from opspace.robots import WristSensor as WristSensor
    from opspace.robots import available_robots as available_robots
    from opspace.robots import load_robot as load_robot
    from opspace.robots.shapes import LinkCapsule as LinkCapsule
    from opspace.runs.loop_recorder import LoopRecorder as LoopRecorder
    from opspace.sim import Board as Board
    from opspace.sim import Ground as Ground
    from opspace.sim import Hole as Hole
    from opspace.sim import Plant as Plant
    from opspace.sim import Surface as Surface
    from opspace.sim import Wall as Wall
    from opspace.stack import Stack as Stack
    from opspace.tasks import ActivationProduct as ActivationProduct
    from opspace.tasks import ActivationUnion as ActivationUnion
    from opspace.tasks import AngularMomentumTask as AngularMomentumTask
    from opspace.tasks import Ball as Ball
    from opspace.tasks import Box as Box
    from opspace.tasks import Capsule as Capsule
    from opspace.tasks import Chain as Chain
    from opspace.tasks import Circle as Circle
    from opspace.tasks import CollisionAvoidance as CollisionAvoidance
    from opspace.tasks import ComTask as ComTask
    from opspace.tasks import Constant as Constant
    from opspace.tasks import Contact as Contact
    from opspace.tasks import ConvexMesh as ConvexMesh
    from opspace.tasks import DistanceBuffer as DistanceBuffer
    from opspace.tasks import ForceTask as ForceTask
    from opspace.tasks import GiveWay as GiveWay
    from opspace.tasks import HalfSpace as HalfSpace
    from opspace.tasks import ImpedanceTask as ImpedanceTask
    from opspace.tasks import JerkLimited as JerkLimited
    from opspace.tasks import JointBuffer as JointBuffer
    from opspace.tasks import JointLimits as JointLimits
    from opspace.tasks import JointTask as JointTask
    from opspace.tasks import MinimumJerk as MinimumJerk
    from opspace.tasks import OrientationJerkLimited as OrientationJerkLimited
    from opspace.tasks import OrientationMinimumJerk as OrientationMinimumJerk
    from opspace.tasks import OrientationTask as OrientationTask
    from opspace.tasks import OtherRobot as OtherRobot
    from opspace.tasks import PoseReference as PoseReference
    from opspace.tasks import PoseTask as PoseTask
    from opspace.tasks import PositionTask as PositionTask
    from opspace.tasks import PostureTask as PostureTask
    from opspace.tasks import Reference as Reference
    from opspace.tasks import RelativeOrientationTask as RelativeOrientationTask
    from opspace.tasks import RelativePoseTask as RelativePoseTask
    from opspace.tasks import RelativePositionTask as RelativePositionTask
    from opspace.tasks import Sample as Sample
    from opspace.tasks import Task as Task
    from opspace.tasks import TaskTerms as TaskTerms
    from opspace.tasks import Touch as Touch
    from opspace.tasks import TrackingTask as TrackingTask
    from opspace.tasks import ViaPoints as ViaPoints
    from opspace.view import RunRequest as RunRequest
    from opspace.view import Viewer as Viewer

_NAMES = {
    "opspace.command": "Command ContactStatus Distance LevelStatus Status TaskStatus",
    "opspace.contacts": "EdgeContact GroundContact PointContact SoleContact",
    "opspace.controller": "Controller",
    "opspace.controller.falling": "FallRule",
    "opspace.errors": (
        "InputError MissingExtraError ModelError ModelWarning OpspaceError RecordingError "
        "RobotStoppedError ScenarioError UnknownNameError"
    ),
    "opspace.export.c_library": "export_c",
    "opspace.fleet": "Fleet ForceArrays TaskArrays",
    "opspace.law": (
        "Activation Buffer LawInfo Profile Ramp SigmaBuffer TaskSet intermediate_values task_torque"
    ),
    "opspace.record": "Column Recorder Recording load",
    "opspace.record.black_box": "BlackBox",
    "opspace.record.observer": "TickRecorder",
    "opspace.record.replay": "Replay replay",
    "opspace.robots": (
        "JointTorqueSensor Payload Robot RobotInfo WristSensor available_robots load_robot"
    ),
    "opspace.robots.shapes": "LinkCapsule",
    "opspace.runs.loop_recorder": "LoopRecorder",
    "opspace.loop": (
        "AnyPlant Driver DriverFacts Loop LoopReport Observer Outcome RealTime RobotState "
        "SharedHistory Stepping StopRule simulate"
    ),
    "opspace.plan.calibration": "Calibration",
    "opspace.plan.scales": "Singularity",
    "opspace.sim": "Board Ground Hole Plant Surface Wall",
    "opspace.stack": "Stack",
    "opspace.tasks": (
        "ActivationProduct ActivationUnion AngularMomentumTask Ball Box Capsule Chain Circle "
        "CollisionAvoidance ComTask Constant Contact ConvexMesh DistanceBuffer ForceTask GiveWay "
        "HalfSpace ImpedanceTask JerkLimited JointBuffer JointLimits JointTask MinimumJerk "
        "OrientationJerkLimited OrientationMinimumJerk OrientationTask OtherRobot PoseReference "
        "PoseTask "
        "PositionTask PostureTask Reference RelativeOrientationTask RelativePoseTask "
        "RelativePositionTask Sample Task TaskTerms Touch TrackingTask ViaPoints"
    ),
    "opspace.view": "RunRequest Viewer",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = ["__version__", *sorted(_HOME)]  # noqa: PLE0604  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        found: Any = metadata.version("opspace")
    elif name in _HOME:
        found = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module 'opspace' has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
