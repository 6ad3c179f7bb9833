"""The modem once more in plain NumPy, both transmitter and receiver, as a reference.

It is meant to be read beside the equations of `phy/README.md`, and the kernels are tested against
it. It never runs in a daemon, never uses a kernel, and need not be fast. It shares with `phy` only
tables and arithmetic (grid, layout, MCS, constellation, CRC, sequences, code tables). It computes
everything with samples itself, in double precision except in the demapper.

The modules in the order of the signal, sending: `header`, `viterbi` (its code), `ldpc`, `mapping`,
`ofdm`, `transmitter`. Receiving: `detection`, `timing`, `offset`, `channel`, `smoothing`,
`training`, `tracking`, `demapper`, `equaliser`, and again `viterbi` and `ldpc`; `acquisition`,
`payload` and `receiver` combine them.
"""

from phy.reference.receiver import Receiver
from phy.reference.transmitter import Transmitter

__all__ = ["Receiver", "Transmitter"]
