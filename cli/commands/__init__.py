"""One file a command of `horf`."""
