"""What a robot can be asked for, and how the wish moves in time."""

from types import MappingProxyType

from opspace.tasks.activations import ActivationProduct as ActivationProduct
from opspace.tasks.activations import ActivationUnion as ActivationUnion
from opspace.tasks.activations import DistanceBuffer as DistanceBuffer
from opspace.tasks.activations import JointBuffer as JointBuffer
from opspace.tasks.angular_momentum import AngularMomentumTask as AngularMomentumTask
from opspace.tasks.collision_avoidance import CollisionAvoidance as CollisionAvoidance
from opspace.tasks.com import ComTask as ComTask
from opspace.tasks.contact import Contact as Contact
from opspace.tasks.contact import GiveWay as GiveWay
from opspace.tasks.force import ForceTask as ForceTask
from opspace.tasks.impedance import ImpedanceTask as ImpedanceTask
from opspace.tasks.joint import JointTask as JointTask
from opspace.tasks.joint_limits import JointLimits as JointLimits
from opspace.tasks.kinds import TaskKind
from opspace.tasks.obstacles import Ball as Ball
from opspace.tasks.obstacles import Box as Box
from opspace.tasks.obstacles import Capsule as Capsule
from opspace.tasks.obstacles import ConvexMesh as ConvexMesh
from opspace.tasks.obstacles import HalfSpace as HalfSpace
from opspace.tasks.orientation import OrientationTask as OrientationTask
from opspace.tasks.other_robot import OtherRobot as OtherRobot
from opspace.tasks.pose import PoseTask as PoseTask
from opspace.tasks.position import PositionTask as PositionTask
from opspace.tasks.posture import PostureTask as PostureTask
from opspace.tasks.references import Chain as Chain
from opspace.tasks.references import Circle as Circle
from opspace.tasks.references import Constant as Constant
from opspace.tasks.references import JerkLimited as JerkLimited
from opspace.tasks.references import MinimumJerk as MinimumJerk
from opspace.tasks.references import OrientationJerkLimited as OrientationJerkLimited
from opspace.tasks.references import OrientationMinimumJerk as OrientationMinimumJerk
from opspace.tasks.references import PoseReference as PoseReference
from opspace.tasks.references import Reference as Reference
from opspace.tasks.references import Sample as Sample
from opspace.tasks.references import ViaPoints as ViaPoints
from opspace.tasks.relative import RelativeOrientationTask as RelativeOrientationTask
from opspace.tasks.relative import RelativePoseTask as RelativePoseTask
from opspace.tasks.relative import RelativePositionTask as RelativePositionTask
from opspace.tasks.task import Task as Task
from opspace.tasks.task import TaskTerms as TaskTerms
from opspace.tasks.touch_memory import Touch as Touch
from opspace.tasks.tracking import TrackingTask as TrackingTask

TASK_KINDS = MappingProxyType(
    {
        "position": TaskKind(PositionTask, "position"),
        "orientation": TaskKind(OrientationTask, "orientation"),
        "pose": TaskKind(PoseTask, "pose"),
        "posture": TaskKind(PostureTask, "joints"),
        "joint": TaskKind(JointTask, "joint"),
        "com": TaskKind(ComTask, "position"),
        "angular_momentum": TaskKind(AngularMomentumTask, "momentum"),
        "relative_position": TaskKind(RelativePositionTask, "position"),
        "relative_orientation": TaskKind(RelativeOrientationTask, "orientation"),
        "relative_pose": TaskKind(RelativePoseTask, "pose"),
        "force": TaskKind(ForceTask, "force", sprung=True),
        "impedance": TaskKind(ImpedanceTask, "position", sprung=True),
    }
)
"""Every task that ticks compute from numbers, under the name that scenarios give it."""
