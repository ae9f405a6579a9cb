"""The tick compiled: from the robot's arrays to the torque in one call."""
