"""Kinds of joints of a rigid-body tree; compiled code is made with these numbers."""

ALIGNED, HINGE, SLIDE, TRANSLATION, BALL = range(5)
"""The first turns about an axis of the joint, the second about any."""
