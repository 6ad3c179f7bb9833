"""The documents do what they print."""
