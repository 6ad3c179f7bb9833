"""What became of messages: receipts both ways, latencies, and command topics that fell silent."""

from sdrlinkd.link.receipts.delivery import Delivery
from sdrlinkd.link.receipts.receipts import Verdict

__all__ = [
    "Delivery",
    "Verdict",
]
