"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.client import producer
from sdrlinkd.client.arrivals import Arrivals
from sdrlinkd.client.deadline import Deadline, milliseconds
from sdrlinkd.client.messages import decode_in, new_ack_topic, new_late_topic, topic_filter
from sdrlinkd.client.paths import is_prepared

__all__ = [
    "CONSTANTS",
    "Arrivals",
    "Deadline",
    "decode_in",
    "is_prepared",
    "milliseconds",
    "new_ack_topic",
    "new_late_topic",
    "topic_filter",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "still_there_s": (producer, "STILL_THERE_S"),
    "gone_s": (producer, "GONE_S"),
    "look_s": (producer, "LOOK_S"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["gone_s"], 0.5)`."""
