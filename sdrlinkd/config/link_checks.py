"""Checks that the link's sections of the configuration agree with each other."""

import re
from collections.abc import Mapping
from pathlib import Path

from zstandard import ZstdCompressionDict, ZstdCompressor, ZstdError

from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError
from sdrlinkd.link import FixedRoutes, Qos, TopicPolicy
from sdrlinkd.wire import MIN_SEALED_SIZE, Registry

_COMMANDS = re.compile(r"/robot_\{(src_id|src)\}/?")


def check_bridge(config: Config, has_numbers: bool) -> None:
    """Check that topics of robots on other airs can be sent, if they are.

    Raises ConfigError, which begins with the key and says what was given and what is allowed.
    """
    if config.fleet.bridge and not has_numbers:
        raise ConfigError(
            f"fleet.bridge: got {config.fleet.bridge}; it needs topics beyond the registry "
            "(auto = true at all robots); allowed here: []"
        )
    if config.fleet.bridge and _COMMANDS.fullmatch(config.rx_format):
        raise ConfigError(
            f'rx_format: got "{config.rx_format}", the form of commands to robots; allowed with '
            'fleet.bridge: any other, such as "/rx_robot_{src_id}"'
        )


def check_relay(config: Config, registry: Registry) -> None:
    """Check that the settings of relays and parity fit the rest of the link.

    Raises ConfigError, which begins with the key and says what was given and what is allowed.
    """
    is_auto = config.relay.policy == "auto"
    relays = FixedRoutes(config.relay).is_on or is_auto
    if config.relay.policy == "routes" and not config.relay.routes:
        raise ConfigError(
            'relay.routes: got []; allowed with relay.policy = "routes": FROM>TO, such as "1>3"'
        )
    if is_auto and not registry.has_control:
        raise ConfigError(
            'relay.policy: got "auto"; it needs the control channel, so at most 15 topics; allowed '
            'here: "none", "routes", "flood"'
        )
    if relays and config.link.hop_limit < 2:
        raise ConfigError(
            f"link.hop_limit: got {config.link.hop_limit}; allowed with relay.policy = "
            f'"{config.relay.policy}": at least 2, the same at all robots'
        )
    for qos in Qos:
        if config.classes.of(qos).parity and not registry.has_control:
            raise ConfigError(
                f"classes.{qos.label}.parity: got {config.classes.of(qos).parity:g}; it "
                "needs the control channel, so at most 15 topics; allowed here: 0"
            )


def check_reserved(config: Config, named: Mapping[str, TopicPolicy], registry: Registry) -> None:
    """Check that what topics reserve can be reserved.

    Raises ConfigError, which begins with the key and says what was given and what is allowed.
    """
    for name, policy in named.items():
        if not policy.reserve:
            continue
        key = f"topic.{name}.reserve: got true; it needs"
        if not (policy.period_s and policy.max_bytes):
            raise ConfigError(
                f"{key} period_s and max_bytes above 0, which say how often and how much; allowed "
                "without: false"
            )
        if not registry.has_control:
            raise ConfigError(
                f"{key} the control channel, so at most 15 topics; allowed here: false"
            )
        if not config.admission.share:
            raise ConfigError(f"{key} admission.share above 0; allowed with 0: false")


def check_security(config: Config, registry: Registry) -> None:
    """Check that PDUs can be sealed, if they should be.

    Raises ConfigError, which begins with the key and says what was given and what is allowed.
    """
    security = config.security
    if security.mode == "off":
        return
    if config.link.pdu_size < MIN_SEALED_SIZE:
        raise ConfigError(
            f"link.pdu_size: got {config.link.pdu_size}; allowed with security.mode = "
            f'"{security.mode}": at least {MIN_SEALED_SIZE}'
        )
    if not registry.has_control:
        raise ConfigError(
            f'security.mode: got "{security.mode}"; it needs the control channel, so at most 15 '
            'topics; allowed here: "off"'
        )
    if "\0" in security.keys + security.state_dir:
        raise ConfigError("security.keys, security.state_dir: a NUL; allowed: names of files")


def load_dictionaries(
    policies: Mapping[int, TopicPolicy], registry: Registry, base: Path
) -> dict[int, ZstdCompressionDict]:
    """The zstd dictionaries that `policies` name, by topic id. Raises ConfigError."""
    found = {}
    for topic_id, policy in policies.items():
        if not policy.dictionary:
            continue
        path = base / policy.dictionary
        key = f"topic.{registry.topics[topic_id].name}.dictionary"
        try:
            made = ZstdCompressionDict(path.read_bytes())
            ZstdCompressor(dict_data=made)
        except (OSError, ZstdError, ValueError) as error:
            raise ConfigError(
                f"{key}: {str(path)!r} cannot be used ({error}); allowed: a "
                "file made by `sdrlinkctl topics train-dict`"
            ) from None
        if not made.dict_id():
            raise ConfigError(
                f"{key}: {str(path)!r} is not a trained dictionary; allowed: a "
                "file made by `sdrlinkctl topics train-dict`"
            )
        found[topic_id] = made
    return found
