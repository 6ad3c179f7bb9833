"""Compiled loops: the code that must be fast. The rest of the modem reads like the equations.

They run as a library that `phy.engine` builds. Only the build imports this package, and tests.
"""

from phy.kernels import bits, lanes
from phy.kernels.acquisition import acquire, fold, settle
from phy.kernels.argument_block import opener
from phy.kernels.blanking import blank, find_pulses
from phy.kernels.convolution import convolve
from phy.kernels.decisions import expected_level
from phy.kernels.demapper import axis_llrs
from phy.kernels.demodulator import demodulate, learn_channel, slip, to_tones
from phy.kernels.detector import detector_sums, sanitise, search, strongest
from phy.kernels.equaliser import equalise, start_tracking
from phy.kernels.ldpc import decode_blocks, decode_codeword
from phy.kernels.ldpc_encoder import encode_blocks
from phy.kernels.list_viterbi import list_decode
from phy.kernels.modulator import modulate, modulate_bits
from phy.kernels.noise import add_noise
from phy.kernels.notch import cut_lines, find_lines
from phy.kernels.resampler import filter_strided, interpolate
from phy.kernels.rotation import lean, lean_more
from phy.kernels.sensing import sense
from phy.kernels.smoothing import doubt_more, follow, move_on, smooth
from phy.kernels.timing import correlate, locate
from phy.kernels.tracking import correct, predict
from phy.kernels.training import estimate, learn, least_squares, turn_back
from phy.kernels.viterbi import decode_block, decode_rows

__all__ = [  # noqa: RUF022 (by use)
    # What the interpreter calls: `phy.engine.entries` has the types.
    "acquire",
    "add_noise",
    "blank",
    "convolve",
    "cut_lines",
    "decode_blocks",
    "decode_rows",
    "demodulate",
    "encode_blocks",
    "filter_strided",
    "find_lines",
    "find_pulses",
    "interpolate",
    "learn_channel",
    "list_decode",
    "modulate",
    "modulate_bits",
    "sanitise",
    "search",
    "sense",
    "settle",
    "slip",
    "strongest",
    "to_tones",
    # The steps of these, for tests.
    "axis_llrs",
    "correct",
    "correlate",
    "decode_block",
    "decode_codeword",
    "detector_sums",
    "doubt_more",
    "equalise",
    "estimate",
    "expected_level",
    "fold",
    "follow",
    "lean",
    "lean_more",
    "learn",
    "least_squares",
    "locate",
    "move_on",
    "predict",
    "smooth",
    "start_tracking",
    "turn_back",
    # What all are made of, likewise.
    "bits",
    "lanes",
    "opener",
]
