"""The configuration file as a type, composed of the parts' own parameters."""

from typing import TYPE_CHECKING, Annotated, Literal

import msgspec
from msgspec import Meta

from backends import (
    BUILT_IN,
    EtherParams,
    IqFileParams,
    LoopbackParams,
    ModemNeeds,
    SoapyParams,
    ZmqParams,
)
from sdrlinkd.config.fleet import FleetParams
from sdrlinkd.config.pdu_links import (
    ChannelParams,
    DirectParams,
    ModemParams,
    PlayParams,
    TransformParams,
)
from sdrlinkd.config.radios import GnuRadioParams
from sdrlinkd.link import (
    AccessParams,
    AdmissionParams,
    ClassesParams,
    ClockParams,
    LinkParams,
    QueueParams,
    RateParams,
    ReassemblyParams,
    RelayParams,
    RepeatParams,
    TopicPolicy,
)
from sdrlinkd.sealing import SecurityParams
from sdrlinkd.wire import SEAL_OVERHEAD, equal_payload

WITHOUT_AIR = ("direct", "gnuradio")
"""Backends that carry PDUs instead of samples."""
BACKENDS = ("direct", *BUILT_IN, "gnuradio")
"""All values of the key `backend`, except the radios of other packages."""

if TYPE_CHECKING:
    BackendName = str
else:
    BackendName = Literal[BACKENDS]


class BusParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Location and limits of the local ZeroMQ bus."""

    runtime_dir: str = ""
    """Directory of the sockets; empty: systemd's or the user's runtime directory."""
    max_message_bytes: Annotated[int, Meta(ge=64, le=1 << 24)] = 8 << 20
    """Largest message that the bus takes."""


class ChronyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Another robot's clock as a reference clock for this host's chronyd."""

    socket: str = ""
    """Path of chronyd's socket, as in chrony.conf: `refclock SOCK PATH`; empty: none."""
    robot: Annotated[int, Meta(ge=0, le=254)] = 0
    """Id of the robot whose clock is the reference."""


class Config(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One daemon's configuration. Every key has a default; see etc/sdrlinkd.toml."""

    namespace: str = "robot_1"
    """ROS namespace of this robot's topics; empty: the registry has absolute names."""
    robot_id: Annotated[int, Meta(ge=-1, le=254)] = -1
    """This robot's id on the air; -1: the last number in the namespace or, without a namespace, in
    the names of the topics taken from the bus."""
    registry: str = ""
    """File with the topic registry, relative to the configuration file; the same at all nodes.
    Empty: `registry.csv`, or no registry if that file does not exist."""
    auto: bool | None = None
    """Whether producers may declare topics beyond the registry, and messages larger than 255
    fragments are sent in parts; at all robots or none. Absent: only without a registry."""
    topics: list[str] = []
    """Registry names to take from the bus; empty: all."""
    rx_format: str = "/rx_robot_{src_id}"
    """Namespace under which another robot's topics are republished."""
    rx_depth: Annotated[int, Meta(ge=0, le=1_000_000)] = 256
    """Messages kept for a consumer that does not read; 0: no limit."""
    backend: BackendName = "direct"
    """What carries the PDUs: a radio, a simulation, a flowgraph, or `direct`, without a modem."""
    drain_s: Annotated[float, Meta(ge=0, le=60)] = 1.0
    """Time in s for sending the queue when the daemon is stopped."""
    seed: Annotated[int, Meta(ge=0, le=(1 << 63) - 1)] | None = None
    """Seed of all random numbers; absent: from the operating system."""
    link: LinkParams = LinkParams()
    queue: QueueParams = QueueParams()
    reassembly: ReassemblyParams = ReassemblyParams()
    classes: ClassesParams = ClassesParams()
    relay: RelayParams = RelayParams()
    repeat: RepeatParams = RepeatParams()
    admission: AdmissionParams = AdmissionParams()
    security: SecurityParams = SecurityParams()
    clock: ClockParams = ClockParams()
    chrony: ChronyParams = ChronyParams()
    tf: TransformParams = TransformParams()
    access: AccessParams = AccessParams()
    rate: RateParams = RateParams()
    bus: BusParams = BusParams()
    direct: DirectParams = DirectParams()
    modem: ModemParams = ModemParams()
    loopback: LoopbackParams = LoopbackParams()
    iqfile: IqFileParams = IqFileParams()
    ether: EtherParams = EtherParams()
    soapy: SoapyParams = SoapyParams()
    zmq: ZmqParams = ZmqParams()
    gnuradio: GnuRadioParams = GnuRadioParams()
    channel: ChannelParams = ChannelParams()
    play: PlayParams = PlayParams()
    fleet: FleetParams = FleetParams()
    topic: dict[str, TopicPolicy] = {}
    """Topic policies by registry name, as in `[topic.odom]`."""

    @property
    def record_room(self) -> int:
        """Octets for records in a PDU."""
        return equal_payload(self.inner_pdu_size, 1)

    @property
    def inner_pdu_size(self) -> int:
        """Octets of a PDU that carry entries: less than link.pdu_size, if PDUs are sealed."""
        return self.link.pdu_size - (SEAL_OVERHEAD if self.security.mode != "off" else 0)

    @property
    def backend_settings(self) -> msgspec.Struct:
        """The section of the backend in use."""
        settings: msgspec.Struct = getattr(self, self.backend)
        return settings

    @property
    def radio_needs(self) -> ModemNeeds:
        """What the modem requires of its radio."""
        modem = self.modem
        return ModemNeeds(modem.rate_hz, modem.oversampling, modem.frequency_hz, modem.block_s)

    @property
    def hears_self(self) -> bool:
        """Whether this node accepts its own PDUs, as in the paper's experiment."""
        return bool(getattr(self.backend_settings, "hear_self", False))

    @property
    def waits_for_consumer(self) -> bool:
        """Whether the radio's time begins when the first consumer subscribes."""
        own = getattr(self.backend_settings, "wait_for_consumer", False)
        return bool(own) or self.play.wait_for_consumer
