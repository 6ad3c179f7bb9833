"""The modem once more in plain NumPy, both transmitter and receiver, as a reference.

It is meant to be read beside the equations of `phy/README.md`, and the kernels are tested against
it. It also runs where there are no kernels: it never uses one. It shares with `phy` only
tables and arithmetic (grid, layout, MCS, constellation, CRC, sequences, code tables). It computes
everything with samples itself, in double precision except in the demapper.

The modules in the order of the signal, sending: `header`, `viterbi` (its code), `ldpc`, `mapping`,
`ofdm`, `transmitter`. Receiving: `detection`, `timing`, `offset`, `channel`, `smoothing`,
`training`, `tracking`, `demapper`, `equaliser`, and again `viterbi` and `ldpc`; `acquisition`,
`payload` and `receiver` combine them. `kernels` has what is not the modem itself: the air's noise
and delay, resampling, and the sense of a busy channel.
"""

from phy.reference import (
    acquisition,
    channel,
    demapper,
    detection,
    equaliser,
    header,
    ldpc,
    mapping,
    ofdm,
    offset,
    smoothing,
    timing,
    tracking,
    training,
    viterbi,
)
from phy.reference.kernels import KERNELS
from phy.reference.receiver import Receiver
from phy.reference.transmitter import Transmitter

__all__ = [
    "KERNELS",
    "Receiver",
    "Transmitter",
    "acquisition",
    "channel",
    "demapper",
    "detection",
    "equaliser",
    "header",
    "ldpc",
    "mapping",
    "ofdm",
    "offset",
    "smoothing",
    "timing",
    "tracking",
    "training",
    "viterbi",
]
