"""Desired motions as functions of time."""

from opspace.tasks.references.chain import Chain as Chain
from opspace.tasks.references.circle import Circle as Circle
from opspace.tasks.references.jerk_limited import JerkLimited as JerkLimited
from opspace.tasks.references.minimum_jerk import MinimumJerk as MinimumJerk
from opspace.tasks.references.orientation_jerk_limited import (
    OrientationJerkLimited as OrientationJerkLimited,
)
from opspace.tasks.references.orientation_minimum_jerk import (
    OrientationMinimumJerk as OrientationMinimumJerk,
)
from opspace.tasks.references.pose_reference import PoseReference as PoseReference
from opspace.tasks.references.sample import Constant as Constant
from opspace.tasks.references.sample import Reference as Reference
from opspace.tasks.references.sample import Sample as Sample
from opspace.tasks.references.via_points import ViaPoints as ViaPoints
