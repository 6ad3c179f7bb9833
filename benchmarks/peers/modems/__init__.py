"""Other OFDM modems, built or found when first asked for: GNU Radio's and liquid-dsp's.

Where one cannot be measured, whoever asks for a figure gets a PeerError that says why.
"""

from benchmarks.peers.modems.gnu_radio import GnuRadio
from benchmarks.peers.modems.liquid import Liquid

__all__ = ["GnuRadio", "Liquid"]
