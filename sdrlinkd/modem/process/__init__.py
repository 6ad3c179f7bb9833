"""Everything that touches samples: the radio, its receiver and its modulator.

It runs in a process of its own wherever samples come in real time, so that nothing that the daemon
does delays them. In lock-step, and for radios without a pace, it runs in the daemon's process: each
block is then done before the next one. No other part of sdrlinkd uses the transmitter and receiver
of `phy`, or a radio. It never decides what is sent, or when.
"""

from sdrlinkd.modem.process.loading import Loading
from sdrlinkd.modem.process.modem_here import ModemHere
from sdrlinkd.modem.process.modem_process import ModemProcess, RadioWanted
from sdrlinkd.modem.process.radios import make_radio

__all__ = ["Loading", "ModemHere", "ModemProcess", "RadioWanted", "make_radio"]
