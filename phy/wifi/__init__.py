"""802.11a reception with the modem's own parts, as a proof on third-party signals.

The daemon does not use it.
"""

from phy.wifi.bits import RATES, Rate
from phy.wifi.high_throughput import HtSignal
from phy.wifi.reception import RATE_HZ, HtFrame, WifiFrame, receive

__all__ = ["RATES", "RATE_HZ", "HtFrame", "HtSignal", "Rate", "WifiFrame", "receive"]
