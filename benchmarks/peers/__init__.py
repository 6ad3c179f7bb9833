"""Other modems, measured in the same run where they are installed."""

from benchmarks.peers.gnu_radio import GnuRadio
from benchmarks.peers.liquid import Liquid

__all__ = ["GnuRadio", "Liquid"]
