"""802.11a reception with the modem's own parts, as a proof on signals that nobody here made.

Nothing of the daemon uses it.
"""

from phy.wifi.bits import RATES, Rate
from phy.wifi.high_throughput import HtSignal
from phy.wifi.reception import RATE_HZ, HtFrame, WifiFrame, receive

__all__ = ["RATES", "RATE_HZ", "HtFrame", "HtSignal", "Rate", "WifiFrame", "receive"]
