"""Other OFDM modems, built or located on first use: GNU Radio's and liquid-dsp's.

If one cannot be measured, any request for a figure raises PeerError with the reason.
"""

from benchmarks.peers.modems.gnu_radio import GnuRadio
from benchmarks.peers.modems.liquid import Liquid

__all__ = ["GnuRadio", "Liquid"]
