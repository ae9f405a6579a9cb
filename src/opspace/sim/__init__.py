"""The plant and the one loop around it."""
