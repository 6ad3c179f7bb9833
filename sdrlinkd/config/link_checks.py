"""What the sections of the link must agree on."""

from collections.abc import Mapping
from pathlib import Path

from zstandard import ZstdCompressionDict, ZstdCompressor, ZstdError

from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError
from sdrlinkd.link import Qos, Relay, TopicPolicy
from sdrlinkd.wire import Registry


def check_relay(config: Config, node_id: int, registry: Registry, source: str) -> None:
    """Raises ConfigError for what cannot work, citing key, given and allowed."""
    try:
        relay = Relay(config.relay, node_id)
    except ConfigError as error:
        raise ConfigError(f"{source}: {error}") from None
    if config.relay.policy == "routes" and not config.relay.routes:
        raise ConfigError(
            f'{source}: relay.routes: got []; allowed with relay.policy = "routes": FROM>TO, such '
            'as "1>3"'
        )
    if relay.is_on and config.link.hop_limit < 2:
        raise ConfigError(
            f"{source}: link.hop_limit: got {config.link.hop_limit}; allowed with [relay]: at "
            "least 2, the same at all robots"
        )
    for qos in Qos:
        if config.classes.of(qos).parity and not registry.has_control:
            raise ConfigError(
                f"{source}: classes.{qos.label}.parity: got {config.classes.of(qos).parity:g}; it "
                "needs a control channel, a registry of at most 15 topics; allowed here: 0"
            )


def load_dictionaries(
    policies: Mapping[int, TopicPolicy], base: Path, source: str
) -> dict[int, ZstdCompressionDict]:
    """By topic id. Raises ConfigError."""
    found = {}
    for topic_id, policy in policies.items():
        if not policy.dictionary:
            continue
        path = base / policy.dictionary
        try:
            made = ZstdCompressionDict(path.read_bytes())
            ZstdCompressor(dict_data=made)
        except (OSError, ZstdError, ValueError) as error:
            raise ConfigError(
                f"{source}: topic.dictionary: {str(path)!r} cannot be used ({error}); allowed: a "
                "file made by `sdrlinkctl topics train-dict`"
            ) from None
        if not made.dict_id():
            raise ConfigError(
                f"{source}: topic.dictionary: {str(path)!r} is no trained dictionary; allowed: a "
                "file made by `sdrlinkctl topics train-dict`"
            )
        found[topic_id] = made
    return found
