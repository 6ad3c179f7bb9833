"""Other OFDM modems, built or found when first asked for: GNU Radio's and liquid-dsp's.

Each modem says by `is_there` whether it can be measured on this machine.
"""

from benchmarks.peers.modems.gnu_radio import GnuRadio
from benchmarks.peers.modems.liquid import Liquid

__all__ = ["GnuRadio", "Liquid"]
