"""What tests compare stage by stage; not a part of the interface.

The inside of `phy` may change as long as these names keep their meaning. `phy.kernels` and
`phy.reference`, which the tests compare, have doors of their own.
"""

from phy import compute, convolutional, crc, ldpc, preamble
from phy.acquisition import Acquisition, Missed
from phy.channel.fading import BLOCK as FADING_BLOCK
from phy.channel.fading import jakes, moving_filter
from phy.channel.resampling import N_TAPS, echo_filters, stretch
from phy.engine import files, library, targets
from phy.engine.builder import compile_kernels
from phy.engine.entries import BLOCK, ENTRIES
from phy.estimation import in_planes, new_channel, new_scratch, tones
from phy.header import BurstHeader
from phy.header_code import checked as checked_header
from phy.header_code import header_bits, parse_header
from phy.interleaver import order
from phy.mapping import axes, mapping
from phy.ofdm import to_tones
from phy.oversampling import low_pass
from phy.segmentation import LIFTINGS, QuasiCyclic, Segmentation, least_coded, segmentation
from phy.sequences import polarity, whitening
from phy.sizes import N_LANES, NOISE_CHUNK
from phy.stream import SampleStream
from phy.tables import notch as notch_tables
from phy.tables.block import FIELDS, ArgumentBlock, block_of
from phy.tables.burst import (
    DELAY,
    DOUBT,
    DRIFT,
    DUE,
    GAIN,
    MOVES,
    N_FOLLOWED,
    NO,
    PHASE,
    SCALED,
    SLOPE,
    SLOPE_USED,
    SPREAD,
    TURNS,
)
from phy.tables.detector import (
    DC_IMAG,
    DC_REAL,
    FLOOR,
    FORGETS,
    HISTORY,
    PATIENCE,
    SURE,
    new_search_memory,
)
from phy.tables.notch import new_notch_memory
from phy.transmitter import header_samples

__all__ = [  # noqa: RUF022 (by stage)
    # How a burst begins.
    "preamble",
    "BurstHeader",
    "checked_header",
    "header_bits",
    "header_samples",
    "parse_header",
    # Codes and check sums.
    "convolutional",
    "crc",
    "ldpc",
    "LIFTINGS",
    "QuasiCyclic",
    "Segmentation",
    "least_coded",
    "segmentation",
    # From coded bits to samples, and from samples to tones.
    "axes",
    "mapping",
    "order",
    "polarity",
    "to_tones",
    "whitening",
    # The search for bursts.
    "DC_IMAG",
    "DC_REAL",
    "FLOOR",
    "FORGETS",
    "HISTORY",
    "PATIENCE",
    "SURE",
    "Acquisition",
    "Missed",
    "SampleStream",
    "new_notch_memory",
    "new_search_memory",
    "notch_tables",
    # What is known of a burst's channel.
    "DELAY",
    "DOUBT",
    "DRIFT",
    "DUE",
    "GAIN",
    "MOVES",
    "N_FOLLOWED",
    "NO",
    "PHASE",
    "SLOPE",
    "SCALED",
    "SLOPE_USED",
    "SPREAD",
    "TURNS",
    "in_planes",
    "new_channel",
    "new_scratch",
    "tones",
    # The simulated air, and other rates.
    "FADING_BLOCK",
    "NOISE_CHUNK",
    "N_TAPS",
    "echo_filters",
    "jakes",
    "low_pass",
    "moving_filter",
    "stretch",
    # The engine, and how kernels are called.
    "compute",
    "files",
    "library",
    "targets",
    "BLOCK",
    "ENTRIES",
    "FIELDS",
    "N_LANES",
    "ArgumentBlock",
    "block_of",
    "compile_kernels",
]
