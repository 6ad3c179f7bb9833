"""Sizes that kernels share with the code that calls them."""

N_COLUMNS = 24
"""Number of block columns of an LDPC code of IEEE 802.11."""
SENSE_WINDOW = 64
"""Number of samples of which the energy detector takes the mean power."""
N_PULSE = 3 * SENSE_WINDOW
"""Length of a pulse of energy in samples: wherever it begins, two whole windows lie inside."""
NOISE_CHUNK = 1024
"""Number of noise samples with one pair of keys; also the size of the working memory."""
MAX_LLR = 511
"""Largest LLR that the Viterbi decoder takes."""
SLIP_EVERY = 256
"""Interval in payload symbols at which FFT windows are aligned to the sender's clock."""
N_LANES = 8
"""Number of float32 that kernels compute with at once."""
N_LANES_INT16 = 32
"""Number of int16 that the LDPC decoder computes with at once."""


def whole_lanes(n: int) -> int:
    """Round `n` up to a whole number of vectors of N_LANES."""
    return -(-n // N_LANES) * N_LANES
