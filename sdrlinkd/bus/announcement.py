"""The bus's announcement to producers: topics, their types, and the largest message of each."""

from collections.abc import Mapping

import msgspec

from sdrlinkd import __version__
from sdrlinkd.bus.envelope import VERSION_BYTE, Taken, Welcome
from sdrlinkd.config import Setup
from sdrlinkd.link import DEFAULT_POLICY, TopicPolicy
from sdrlinkd.wire import MAX_PDU_SIZE, Topic, max_message_size


def announcement(
    setup: Setup, topics: Mapping[str, Topic], policies: Mapping[int, TopicPolicy], boot: str
) -> bytes:
    """The encoded announcement (bus document, 4.1).

    `topics` are those accepted, by name on the bus, and `policies` the policies in force.
    """
    takes = {
        name: _taken(setup, topic, policies.get(topic.id, DEFAULT_POLICY))
        for name, topic in topics.items()
    }
    welcome = Welcome("sdrlinkd", __version__, [1], boot, list(takes), takes)
    return VERSION_BYTE + msgspec.msgpack.encode(welcome)


def _taken(setup: Setup, topic: Topic, policy: TopicPolicy) -> Taken:
    config = setup.config
    most = config.bus.max_message_bytes
    limits = [(most, f"bus.max_message_bytes = {most}", "tx_too_big")]
    is_filtered = topic.name in setup.transforms
    if policy.max_bytes and not is_filtered:
        cap = policy.max_bytes
        limits.append((cap, f"topic.{topic.name}.max_bytes = {cap}", "tx_size_cap"))
    # Compressed or filtered messages shrink before they are sent, so only the daemon can decide.
    if policy.compress == "none" and not is_filtered:
        size, queue = config.link.pdu_size, config.queue.max_bytes
        key = f"link.pdu_size = {size} (with {MAX_PDU_SIZE}: {max_message_size(MAX_PDU_SIZE)} B)"
        if setup.has_numbers:
            key = f"link.pdu_size = {size}"
        limits.append((setup.largest, key, "tx_too_big"))
        limits.append((queue, f"queue.max_bytes = {queue}", "tx_overflow_new"))
    least, key, over = min(limits, key=lambda each: each[0])
    return Taken(topic.type, least, key, over)
