"""Measures why messages waited at their source: behind others, for the channel, or for a retry."""

from collections.abc import Iterable
from dataclasses import dataclass

from sdrlinkd.link.transmit.burst import Burst
from sdrlinkd.wire import Waits

WEIGHT = 1 / 32
"""Weight of the newest message in the means."""
WHOLE = 255


@dataclass(slots=True)
class TopicTxDelay:
    """Mean waits of a topic's recent messages, in s."""

    queue_s: float = 0.0
    access_s: float = 0.0
    again_s: float = 0.0
    n: int = 0
    is_told: bool = True


class TxDelayMeters:
    """Measures the wait of one message per burst: the first one, which waited for the channel."""

    def __init__(self) -> None:
        self._of_topic: dict[int, TopicTxDelay] = {}

    def left(self, burst: Burst) -> None:
        """Measure a burst that has left."""
        message = burst.carried[0][0] if burst.carried[0] else None
        if message is None or message.is_whole or message.arrived_at > burst.first_start:
            return
        topic = self._of_topic.setdefault(message.topic_id, TopicTxDelay())
        topic.n += 1
        topic.is_told = False
        weight = max(WEIGHT, 1 / topic.n)
        ready_at = min(max(burst.ready_at, message.arrived_at), burst.first_start)
        topic.queue_s += weight * (ready_at - message.arrived_at - topic.queue_s)
        topic.access_s += weight * (burst.first_start - ready_at - topic.access_s)
        topic.again_s += weight * (burst.start - burst.first_start - topic.again_s)

    def report_ms(self, topic_id: int) -> dict[str, float]:
        """Recent mean waits of a topic by the field names of `TopicReport`; empty: unknown."""
        topic = self._of_topic.get(topic_id)
        if topic is None:
            return {}
        return {
            "queue_ms": 1e3 * topic.queue_s,
            "access_ms": 1e3 * topic.access_s,
            "again_ms": 1e3 * topic.again_s,
        }

    def records(self) -> Iterable[Waits]:
        """WAITS records of topics sent since the last call."""
        for topic_id, topic in self._of_topic.items():
            total_s = topic.queue_s + topic.access_s + topic.again_s
            if topic.is_told or total_s <= 0:
                continue
            topic.is_told = True
            parts = (topic.queue_s, topic.access_s, topic.again_s)
            yield Waits(topic_id, *(round(WHOLE * each / total_s) for each in parts))
