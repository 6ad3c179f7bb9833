"""Sizes that compiled kernels share with the arithmetic of bursts."""

N_COLUMNS = 24
"""Number of block columns of an LDPC code of IEEE 802.11."""
SENSE_WINDOW = 64
"""Number of samples of which the energy detector takes the mean power."""
