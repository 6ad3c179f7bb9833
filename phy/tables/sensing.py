"""State of the energy detector; see `phy.kernels.sensing`."""

from phy.sizes import SENSE_WINDOW

# Content of the state: the floor (0: none yet), the index after the last busy window, the index of
# the next sample, the number of samples in the current window, the index of the first window of the
# present run of busy windows, the index after the last run that was longer than a pulse, the index
# until which bursts explain the energy, the number of runs that were no longer than a pulse, where
# the last ones of these began, and the powers of the current window.
FLOOR, BUSY_UNTIL, NEXT, FILLED, RUN_FROM, CARRIER_UNTIL, EXPLAINED_UNTIL = 0, 1, 2, 3, 4, 5, 6
N_SHORT, SHORT = 7, 8
MOST_SHORT = 16
"""Number of short runs that are kept."""
POWERS = SHORT + MOST_SHORT
N_STATE = POWERS + SENSE_WINDOW
APART = 4 * SENSE_WINDOW
"""Samples without energy that end a run."""
LEAST_PULSE, MOST_PULSE = 2 * SENSE_WINDOW, 8 * SENSE_WINDOW
"""Length of the runs that pulses of N_PULSE samples make. Those of several robots in one mini-slot
overlap, as clocks drift. The shortest burst has 568 samples."""

LEAST_FLOOR = 1e-12
"""The floor is at least this."""
