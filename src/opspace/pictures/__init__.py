"""Pictures and films of recorded motion."""
