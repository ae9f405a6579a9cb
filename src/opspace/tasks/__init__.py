"""What a robot can be asked for, and how the wish moves in time."""

from opspace.tasks.activations import ActivationProduct as ActivationProduct
from opspace.tasks.activations import DistanceBuffer as DistanceBuffer
from opspace.tasks.activations import JointBuffer as JointBuffer
from opspace.tasks.base import Task as Task
from opspace.tasks.base import TaskTerms as TaskTerms
from opspace.tasks.com import ComTask as ComTask
from opspace.tasks.joint import JointTask as JointTask
from opspace.tasks.joint_limits import JointLimits as JointLimits
from opspace.tasks.orientation import OrientationTask as OrientationTask
from opspace.tasks.pose import PoseTask as PoseTask
from opspace.tasks.position import PositionTask as PositionTask
from opspace.tasks.posture import PostureTask as PostureTask
from opspace.tasks.references import Chain as Chain
from opspace.tasks.references import Circle as Circle
from opspace.tasks.references import Constant as Constant
from opspace.tasks.references import JerkLimited as JerkLimited
from opspace.tasks.references import MinimumJerk as MinimumJerk
from opspace.tasks.references import OrientationMinimumJerk as OrientationMinimumJerk
from opspace.tasks.references import PoseReference as PoseReference
from opspace.tasks.references import Reference as Reference
from opspace.tasks.references import Sample as Sample
from opspace.tasks.references import ViaPoints as ViaPoints
from opspace.tasks.relative import RelativeOrientationTask as RelativeOrientationTask
from opspace.tasks.relative import RelativePoseTask as RelativePoseTask
from opspace.tasks.relative import RelativePositionTask as RelativePositionTask
from opspace.tasks.tracking import TrackingTask as TrackingTask
