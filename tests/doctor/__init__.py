"""Whether this machine can carry a node."""
