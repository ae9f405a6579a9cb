"""Drivers of robots, each in a file of its own that nothing else here imports."""
