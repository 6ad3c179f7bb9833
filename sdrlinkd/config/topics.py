"""Which topics a configuration means: registry, declared topics, subscriptions and policies."""

from functools import cache
from pathlib import Path

from sdrlinkd.config.load import parse_toml
from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError, RegistryError, UserError
from sdrlinkd.files import read_bounded
from sdrlinkd.link import TopicPolicy, TypePolicies
from sdrlinkd.wire import DECLARED_TOPIC_ID, Registry, is_topic_name, parse_registry

REGISTRY = "registry.csv"
"""The registry beside a configuration that names none."""
BY_TYPE = Path(__file__).with_name("policies.toml")
"""What topics get by their message type."""


def registry_of(config: Config, base: Path) -> Registry:
    """The registry in use, which has no topics if there is no file. Raises RegistryError."""
    if not config.registry and not (base / REGISTRY).exists():
        return Registry(())
    return load_registry(base / (config.registry or REGISTRY))


def uses_numbers(config: Config, registry: Registry) -> bool:
    """Whether producers may declare topics beyond the registry. Raises ConfigError."""
    if config.auto is None:
        return not len(registry)
    if config.auto and not registry.leaves_numbers:
        raise ConfigError(
            f"auto: got true; it needs topic id {DECLARED_TOPIC_ID}, but the registry has "
            f"{len(registry)} topics; allowed: false, or a registry of at most "
            f"{DECLARED_TOPIC_ID} topics"
        )
    if not config.auto and not len(registry):
        raise ConfigError(
            "auto: got false, but there is no registry either, so there is no topic to send; "
            "allowed: true, or name a `registry`"
        )
    return config.auto


def load_registry(path: Path) -> Registry:
    """The registry in `path`. Raises RegistryError."""
    try:
        text = read_bounded(path).decode()
    except (OSError, ValueError, UserError) as error:
        raise RegistryError(
            f"{str(path)!r}: the topic registry is unreadable ({error}); "
            "it is a CSV of `name,type` lines, named by the key `registry`"
        ) from None
    return parse_registry(text, str(path))


def topics_from_bus(config: Config, registry: Registry) -> dict[str, int]:
    """Ids of the registry's topics that are taken from the bus, by bus topic.

    Raises ConfigError.
    """
    for name in config.topics:
        if registry.by_name(name) is None:
            raise ConfigError(
                f'topics: got "{name}"; allowed: names of the registry: {registry.suggest(name)}'
            )
    wanted = {name.removeprefix("/") for name in config.topics}
    prefix = "/" + config.namespace.strip("/") if config.namespace else ""
    return {
        f"{prefix}/{topic.name}": topic.id
        for topic in registry.topics
        if not wanted or topic.name in wanted
    }


def policies_by_name(
    config: Config, registry: Registry, has_numbers: bool
) -> dict[str, TopicPolicy]:
    """The configured policies by topic name without leading slash. Raises ConfigError."""
    policies: dict[str, TopicPolicy] = {}
    for given, policy in config.topic.items():
        name = given.removeprefix("/")
        if registry.by_name(name) is None and not has_numbers:
            raise ConfigError(
                f'topic."{given}": unknown topic; allowed: names of the registry: '
                f"{registry.suggest(name)}"
            )
        if not is_topic_name(name):
            raise ConfigError(f'topic."{given}": allowed: a ROS name such as odom or camera/image')
        if name in policies:
            raise ConfigError(f'topic."{given}": listed twice, with and without the slash')
        policies[name] = policy
    return policies


@cache
def policies_by_type() -> TypePolicies:
    """The shipped policies by message type."""
    return parse_toml(BY_TYPE.read_text(), str(BY_TYPE), TypePolicies)


def with_commands(policies: dict[str, TopicPolicy], node_id: int) -> dict[str, TopicPolicy]:
    """`policies` with those of the commands to this robot, unless they have policies of their own.

    A command to robot 2 that appears there as cmd_vel is called robot_2/cmd_vel on the air.
    """
    commands = {f"robot_{node_id}/{name}": policy for name, policy in policies.items()}
    return {**commands, **policies}
