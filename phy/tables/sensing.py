"""State of the energy detector; see `phy.kernels.sensing`."""

from phy.sizes import SENSE_WINDOW

# Content of the state: the floor (0: none yet), the index after the last busy window, the index of
# the next sample, the number of samples in the current window, and their powers.
FLOOR, BUSY_UNTIL, NEXT, FILLED, POWERS = 0, 1, 2, 3, 4
N_STATE = POWERS + SENSE_WINDOW

LEAST_FLOOR = 1e-12
"""The floor is at least this."""
