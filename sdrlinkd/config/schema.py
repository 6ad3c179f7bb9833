"""The configuration file as types: the parts' own parameters, composed."""

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
    ClassesParams,
    ClockParams,
    LinkParams,
    QueueParams,
    RateParams,
    ReassemblyParams,
    RelayParams,
    TopicPolicy,
)

WITHOUT_AIR = ("direct", "gnuradio")
"""Backends that carry PDUs, not samples."""
BACKENDS = ("direct", *BUILT_IN, "gnuradio")
"""All that the key `backend` takes, but for radios of other packages."""

if TYPE_CHECKING:
    BackendName = str
else:
    BackendName = Literal[BACKENDS]


class BusParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the local ZeroMQ bus is, and what it takes."""

    runtime_dir: str = ""
    """Directory of the sockets; empty: systemd's, or the user's own."""
    max_message_bytes: Annotated[int, Meta(ge=64, le=1 << 24)] = 1 << 20


class ChronyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Another robot's clock as a source for this host's chronyd."""

    socket: str = ""
    """The socket's path, as in chrony.conf: `refclock SOCK PATH`; empty: none."""
    robot: Annotated[int, Meta(ge=0, le=254)] = 0
    """The robot whose clock is the true one."""


class Config(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One daemon's configuration. Every key has a default; see etc/sdrlinkd.toml."""

    namespace: str = "robot_1"
    """ROS namespace of this robot's topics; empty: the registry holds absolute names."""
    robot_id: Annotated[int, Meta(ge=-1, le=254)] = -1
    """Source id on the air; -1: the last number in the namespace, or, without one, in the names of
    the topics taken."""
    registry: str = "registry.csv"
    """Topic registry, relative to the configuration file; the same file at all nodes."""
    topics: list[str] = []
    """Registry names to take from the bus; empty: all."""
    rx_format: str = "/rx_robot_{src_id}"
    """Namespace under which another robot's topics are republished."""
    rx_depth: Annotated[int, Meta(ge=0)] = 256
    """Messages kept for a consumer that does not read; 0: without bound."""
    backend: BackendName = "direct"
    drain_s: Annotated[float, Meta(ge=0, le=60)] = 1.0
    """Time to send what is queued when the daemon is stopped."""
    seed: int | None = None
    """Seed of all chance; absent: from the operating system."""
    link: LinkParams = LinkParams()
    queue: QueueParams = QueueParams()
    reassembly: ReassemblyParams = ReassemblyParams()
    classes: ClassesParams = ClassesParams()
    relay: RelayParams = RelayParams()
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
    topic: dict[str, TopicPolicy] = {}
    """Policies by registry name: `[topic.odom]`."""

    @property
    def backend_settings(self) -> msgspec.Struct:
        """The section of the backend in use."""
        settings: msgspec.Struct = getattr(self, self.backend)
        return settings

    @property
    def radio_needs(self) -> ModemNeeds:
        """What the modem asks of its radio."""
        modem = self.modem
        return ModemNeeds(modem.rate_hz, modem.oversampling, modem.frequency_hz, modem.block_s)

    @property
    def hears_self(self) -> bool:
        """Whether this node takes its own PDUs (the paper's experiment)."""
        return bool(getattr(self.backend_settings, "hear_self", False))

    @property
    def waits_for_consumer(self) -> bool:
        """Whether the radio's time begins when the first consumer subscribes."""
        own = getattr(self.backend_settings, "wait_for_consumer", False)
        return bool(own) or self.play.wait_for_consumer
