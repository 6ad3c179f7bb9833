"""Compiled loops: the code that must be fast. The rest of the modem reads like the equations.

They run as a library that `phy.engine` builds. Only the build imports this package, and tests.
"""
