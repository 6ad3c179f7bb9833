"""Resolves a configuration into what the parts are built with, and finds every contradiction."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from zstandard import ZstdCompressionDict

from sdrlinkd.config.link_checks import (
    check_bridge,
    check_relay,
    check_reserved,
    check_security,
    load_dictionaries,
)
from sdrlinkd.config.not_checked import unchecked
from sdrlinkd.config.offsets import cfo_told, cfo_warning
from sdrlinkd.config.pdu_link_checks import check_pdu_link, with_paths
from sdrlinkd.config.places import located
from sdrlinkd.config.robot_id import robot_id
from sdrlinkd.config.schema import WITHOUT_AIR, Config
from sdrlinkd.config.topics import (
    policies_by_name,
    policies_by_type,
    registry_of,
    topics_from_bus,
    uses_numbers,
    with_commands,
)
from sdrlinkd.errors import ConfigError
from sdrlinkd.link import PolicyTable, Qos, TopicPolicy, check_access, flush_told
from sdrlinkd.units import LONG_LIFESPAN_S
from sdrlinkd.wire import (
    BROADCAST,
    Registry,
    equal_payload,
    is_topic_name,
    max_large_size,
    max_message_size,
    name_for,
    read_origin,
)

MIN_BEACON_S = 0.01
_NAMESPACE = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
_RX_NAME = re.compile(r"(/[A-Za-z_]\w*)+/?", re.ASCII)
_PLACEHOLDER = re.compile(r"\{(src_id|src)\}")

TF_TYPE = "tf2_msgs/msg/TFMessage"
# Types whose messages have no upper size limit, so that a small PDU size may be too small.
UNBOUNDED_TYPES = {
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Path",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/PointCloud2",
    "visualization_msgs/msg/MarkerArray",
}


@dataclass(frozen=True)
class Setup:
    """One node's setup: everything that follows from its configuration and registry."""

    config: Config
    registry: Registry
    node_id: int
    topics_in: dict[str, int]
    """Topic ids of the topics taken from the bus, by bus topic."""
    table: PolicyTable
    """Which policy a topic gets: as configured, or by its message type."""
    dictionaries: dict[int, ZstdCompressionDict]
    has_numbers: bool
    """Whether producers may declare topics beyond the registry."""
    transforms: frozenset[str]
    """Names, without leading slash, of the topics to which [tf] applies."""
    warnings: list[str]
    topic_warnings: dict[int, str]
    """Warnings by topic id, which matter only once the topic is used."""
    source: str = ""
    """The configuration file; empty if there is none."""

    @cached_property
    def policies(self) -> dict[int, TopicPolicy]:
        """The policies of the registry's topics by topic id, if no producer offers more."""
        return {each.id: self.table.of(each.name, each.type) for each in self.registry.topics}

    def republished_as(self, src: int, topic_id: int) -> str:
        """The bus topic under which messages of a registry's topic from robot `src` appear."""
        topic = self.registry.by_id(topic_id)
        return self.republished(src, topic.name if topic else str(topic_id))

    def republished(self, src: int, name: str) -> str:
        """The bus topic under which messages of topic `name` from robot `src` appear.

        Those that it sends for another robot appear as that robot's.
        """
        origin = read_origin(name)
        src, name = (src if origin.robot is None else origin.robot), origin.name
        return _PLACEHOLDER.sub(str(src), self.config.rx_format).rstrip("/") + "/" + name

    def name_on_air(self, name: str) -> str:
        """The name of a bus topic on the air: without this robot's namespace.

        At a gateway that bridges, the names of other robots' messages mean these robots' topics.
        """
        prefix = f"/{self.config.namespace.strip('/')}/"
        if self.config.fleet.bridge and not name.startswith(prefix):
            found = self._received.fullmatch(name)
            if found and int(found[1]) < BROADCAST:
                return name_for(int(found[1]), found[2])
        return name.removeprefix(prefix).removeprefix("/")

    def name_on_bus(self, name: str) -> str:
        """The bus topic of this robot's topic `name` on the air."""
        namespace = self.config.namespace.strip("/")
        return f"/{namespace}/{name}" if namespace else f"/{name}"

    @cached_property
    def _received(self) -> re.Pattern[str]:
        """What bus topics look like under which other robots' messages appear."""
        # split() also gives what the placeholders' group matched.
        before, *rest = map(re.escape, _PLACEHOLDER.split(self.config.rx_format.rstrip("/"))[::2])
        robot = "(0|[1-9][0-9]{0,2})"
        return re.compile(before + robot + r"\1".join(rest) + "/(.+)")

    @property
    def largest(self) -> int:
        """Largest message in octets that PDUs can carry."""
        size, classes = self.config.inner_pdu_size, self.config.classes
        if not self.has_numbers:
            return max_message_size(size)
        return max_large_size(size, max(classes.of(qos).parity for qos in Qos))

    def _example(self, src: int) -> str:
        topics = self.registry.topics
        return self.republished(src, topics[0].name if topics else "…")

    @property
    def all_warnings(self) -> list[str]:
        """The warnings about the configuration as a whole and about its topics."""
        return [*self.warnings, *self.topic_warnings.values()]

    def summary(self) -> list[str]:
        """The lines about the configuration that `--check` prints."""
        config = self.config
        size = config.link.pdu_size
        other = 1 if self.node_id == 2 else 2
        return [
            f"robot {self.node_id}, namespace {config.namespace or '-'}, backend {config.backend}",
            f"PDUs of {size} B; messages up to {self.largest} B",
            flush_told(config.link.flush_s),
            _sealing_told(config),
            *([] if config.backend in WITHOUT_AIR else [cfo_told(config.modem)]),
            *(
                f"  {topic_id:>2}  {name}  {self.registry.topics[topic_id].type}"
                for name, topic_id in self.topics_in.items()
            ),
            *(["producers declare topics"] if self.has_numbers else []),
            f"received messages appear as {self._example(other)} (from robot {other})",
            *(f"warning: {warning}" for warning in self.all_warnings),
            *(f"not checked: {each}" for each in unchecked(config)),
        ]


def _sealing_told(config: Config) -> str:
    """Whether PDUs are sealed, as a sentence."""
    security = config.security
    if security.mode == "off":
        return "in the clear: anybody can send commands to this robot (security.mode)"
    readers = "everybody can read them" if security.mode == "auth" else "only the team reads them"
    return f"PDUs are sealed: only the team's key sends, and {readers}"


def make_setup(config: Config, base: Path, source: str = "") -> Setup:
    """Resolve `config`; file names in it are relative to `base`.

    Raises UserError. An error about a key cites its line in the file `source`, if any.
    """
    try:
        return _resolve(config, base, source)
    except ConfigError as error:
        raise ConfigError(located(str(error), source)) from None


def _resolve(config: Config, base: Path, source: str) -> Setup:
    registry = registry_of(config, base)
    has_numbers = uses_numbers(config, registry)
    _check_texts(config)
    check_pdu_link(config)
    config = with_paths(config, base)
    topics_in = topics_from_bus(config, registry)
    node_id = robot_id(config, topics_in)
    check_access(config.access, node_id)
    if config.rate.adapt and not (registry.has_control and config.link.beacon_s):
        raise ConfigError(
            "rate.adapt: got true; it needs beacons (link.beacon_s) and the control "
            "channel, so at most 15 topics; allowed here: false"
        )
    check_relay(config, registry)
    check_security(config, registry)
    check_bridge(config, has_numbers)
    if config.chrony.socket and config.chrony.robot == node_id:
        raise ConfigError(
            f"chrony.robot: got {node_id}, this robot itself; allowed: another robot, "
            "whose clock is the reference"
        )
    named = policies_by_name(config, registry, has_numbers)
    check_reserved(config, named, registry)
    if has_numbers:
        named = with_commands(named, node_id)
    configured = {topic.id: named[topic.name] for topic in registry.topics if topic.name in named}
    return Setup(
        config=config,
        registry=registry,
        node_id=node_id,
        topics_in=topics_in,
        table=PolicyTable(named, policies_by_type()),
        has_numbers=has_numbers,
        dictionaries=load_dictionaries(configured, registry, base),
        transforms=_transforms(config, registry, has_numbers),
        warnings=[
            *_warnings(config, registry),
            *_name_warnings(config, node_id),
            *_lifespan_warnings(named),
        ],
        topic_warnings={} if has_numbers else _topic_warnings(config, registry),
        source=source,
    )


def _check_texts(config: Config) -> None:
    if config.namespace and not _NAMESPACE.fullmatch(config.namespace):
        raise ConfigError(
            f'namespace: got "{config.namespace}"; allowed: a ROS namespace such as '
            '"robot_1", or ""'
        )
    named = _PLACEHOLDER.sub("1", config.rx_format)
    if named == config.rx_format or not _RX_NAME.fullmatch(named):
        raise ConfigError(
            f'rx_format: got "{config.rx_format}"; allowed: a name that starts with / '
            'and holds {src_id}, such as "/rx_robot_{src_id}"'
        )
    if 0 < config.link.beacon_s < MIN_BEACON_S:
        raise ConfigError(
            f"link.beacon_s: got {config.link.beacon_s}; allowed: 0 (none), or at least "
            f"{MIN_BEACON_S}"
        )
    if "\0" in config.bus.runtime_dir:
        raise ConfigError("bus.runtime_dir: contains a NUL; allowed: a directory's name")
    most = equal_payload(config.inner_pdu_size, 1)
    if config.link.min_fragment > most:
        raise ConfigError(
            f"link.min_fragment: got {config.link.min_fragment}; allowed: at most "
            f"{most} with link.pdu_size = {config.link.pdu_size}"
        )


def _transforms(config: Config, registry: Registry, has_numbers: bool) -> frozenset[str]:
    found = set()
    for name in config.tf.topics:
        topic = registry.by_name(name)
        if topic is None and has_numbers and is_topic_name(name):
            # A producer may declare it; its type is checked then.
            found.add(name.removeprefix("/"))
            continue
        if topic is None or topic.type != TF_TYPE:
            fit = [each.name for each in registry.topics if each.type == TF_TYPE]
            raise ConfigError(
                f'tf.topics: got "{name}"; allowed: topics of the registry of type '
                f"{TF_TYPE}: {', '.join(fit) or 'none'}"
            )
        found.add(topic.name)
    return frozenset(found)


def _warnings(config: Config, registry: Registry) -> list[str]:
    size, least = config.inner_pdu_size, config.link.min_fragment
    shared = equal_payload(size, 2)
    lonely = (
        f"link.min_fragment = {least} is more than the {shared} B that each of two topics gets in "
        f"a PDU of {size} B: topics seldom share a PDU; set it to at most {shared}"
    )
    full = (
        f"{len(registry)} topics use every topic id: no ages, no beacons, no link reports, no "
        f"receipts; with at most {len(registry) - 1} topics the daemon has them"
    )
    deaf = "" if config.backend in WITHOUT_AIR else cfo_warning(config.modem)
    return [deaf] * bool(deaf) + [lonely] * (least > shared) + [full] * (not registry.has_control)


def _name_warnings(config: Config, node_id: int) -> list[str]:
    """A warning if the namespace is written otherwise than others will see this robot."""
    own = config.namespace.strip("/")
    digits = own.rsplit("_", 1)[-1]
    if config.robot_id >= 0 or not digits.isdecimal() or digits == str(node_id):
        return []
    seen = f"{own[: -len(digits)]}{node_id}"
    return [f"namespace {own}: others see this robot as robot {node_id}; write {seen}"]


def _lifespan_warnings(named: Mapping[str, TopicPolicy]) -> list[str]:
    """A warning for each urgent topic whose messages may be a minute old, or older."""
    return [
        f"topic.{name}.lifespan_s: {policy.lifespan_s:g} s lets {policy.qos} messages arrive when "
        f'they are minutes old; for milliseconds, write "{policy.lifespan_s:g} ms"'
        for name, policy in named.items()
        if policy.qos in ("urgent", "latency")
        and policy.lifespan_s is not None
        and policy.lifespan_s > LONG_LIFESPAN_S
    ]


def _topic_warnings(config: Config, registry: Registry) -> dict[int, str]:
    size, inner = config.link.pdu_size, config.inner_pdu_size
    return {
        topic.id: f"{topic.name} ({topic.type}) can be larger than the {max_message_size(inner)} B "
        f"that 255 fragments of {size} B PDUs carry; larger messages are refused (tx_too_big)"
        for topic in registry.topics
        if topic.type in UNBOUNDED_TYPES
    }
