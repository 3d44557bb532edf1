"""Command line of horf: the only place where learning and robot meet."""
