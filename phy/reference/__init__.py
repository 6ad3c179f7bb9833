"""The reference owns this modem once more, in plain NumPy: the transmitter and the receiver.

It is written to be read beside the equations of `phy/README.md`, and the kernels of both are tested
against it. It never runs in a daemon, it never uses a kernel, and its speed does not matter.
What is arithmetic alone (grid, layout, MCS, constellation, CRC, sequences, code tables) it takes
from `phy`; what is made of samples it computes itself: in double precision, but for the demapper.

The modules stand in the order of the signal. What is sent: `header`, `viterbi` (its code), `ldpc`,
`mapping`, `ofdm`, `transmitter`. What is received: `detection`, `timing`, `offset`, `channel`,
`smoothing`, `training`, `tracking`, `demapper`, `equaliser`, and again `viterbi` and `ldpc`;
`acquisition`, `payload` and `receiver` put them together.
"""

from phy.reference.receiver import Receiver
from phy.reference.transmitter import Transmitter

__all__ = ["Receiver", "Transmitter"]
