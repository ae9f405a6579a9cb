"""Operational space control with continuous task transitions."""
