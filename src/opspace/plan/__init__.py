"""Objects to arrays: the one entrance for everything that runs compiled."""
