"""The status schema: what each part of the daemon reports about itself.

Reports are frozen. A unit is part of the field's name. Counters count from the daemon's start and
only grow; `*_per_s` are means over the last `RATE_WINDOW_S`. One `Snapshot` holds all reports, and
every view renders that snapshot.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

EVERYONE = 255
"""In the place of a robot's id: what is for everyone."""
RATE_WINDOW_S = 5.0
"""Window in s of all rates and recent shares."""
ONLY_GROWS = "only_grows"
"""Marks, in the extra of a type, what counts from the daemon's start."""
Count = Annotated[int, Meta(extra={ONLY_GROWS: True})]
Total = Annotated[float, Meta(extra={ONLY_GROWS: True})]


class TopicReport(msgspec.Struct, frozen=True, kw_only=True):
    """A topic of the registry, as this robot sends it."""

    topic_id: int
    """Id of the topic on the air."""
    name: str
    """Name on the bus where the topic is subscribed, else `/` and the name in the registry."""
    type: str
    """ROS message type."""
    subscribed: bool
    """Whether the bus accepts messages for this topic."""
    qos: str
    """Default class of its messages: urgent | latency | default | bulk"""
    priority: int
    """Default priority of its messages within the class, 0 to 127; 127 is sent first."""
    accepted: Count = 0
    """Messages submitted, including those that were then dropped."""
    accepted_per_s: float = 0.0
    """Messages submitted per second."""
    accepted_bytes_per_s: float = 0.0
    """Payload bytes submitted per second."""
    sent: Count = 0
    """Messages that have left completely."""
    sent_bytes: Count = 0
    """Payload bytes of the sent messages; compressed size where the topic is compressed."""
    queued: int = 0
    """Messages in the queue of which no part has been sent yet."""
    reoffered: Count = 0
    """Latched messages sent again to late joiners; `accepted` includes them."""
    dropped: dict[str, Count] = {}
    """Messages dropped, by reason (`tx_*`)."""
    lifespan_s: float | None = None
    """Default age in s after which a message is not sent any more; null: no limit."""
    lifespan_from: str = ""
    """Where the default lifespan is set: topic | class; empty: nowhere."""
    policy_from: str = ""
    """First of these that gives a key of its policy: set (while running) | file | type | offer |
    default"""
    queue_ms: float | None = None
    """Recent mean of the time that messages waited behind others, in ms; null: unknown."""
    access_ms: float | None = None
    """Recent mean of the time that messages waited for the channel, in ms; null: unknown."""
    again_ms: float | None = None
    """Recent mean of the time that messages waited in the retry queue, in ms; null: unknown."""


class LatencyReport(msgspec.Struct, frozen=True, kw_only=True):
    """How late messages of one topic from one source arrive, as means over the last messages in ms.

    A message's age is wait + reassembly + air + handover; its wait is queue + access + again.
    """

    wait_ms: float
    """From submission to the preamble of the burst with the first fragment, in ms."""
    queue_ms: float | None = None
    """Part of the wait behind other messages, in ms; null: the source has not reported it."""
    access_ms: float | None = None
    """Part of the wait for the channel, in ms; null: the source has not reported it."""
    again_ms: float | None = None
    """Part of the wait in the retry queue, in ms; null: the source has not reported it."""
    reassembly_ms: float
    """From the preamble of the burst with the first fragment to that with the last, in ms."""
    air_ms: float
    """From that preamble to the end of the last fragment, in ms."""
    handover_ms: float
    """From the end of the last fragment to the handover to the bus, in ms."""
    period_ms: float | None = None
    """Time between two messages, in ms; null: fewer than two have arrived."""
    jitter_ms: float | None = None
    """Standard deviation of the time between messages, in ms: Jd in the Pound paper."""
    percentiles_ms: dict[str, float] = {}
    """Percentiles of all ages since the start, in ms: 50, 90, 99, 99.9 and max."""


class ClockReport(msgspec.Struct, frozen=True, kw_only=True):
    """What this robot knows about another robot's clock."""

    state: str
    """How well the clock is known: unsynced | coarse | synced | holdover (no recent CLOCK)"""
    offset_ms: float | None = None
    """Our link's clock minus the other robot's, in ms; null: unknown."""
    bound_us: float | None = None
    """Largest possible error of `offset_ms`, in µs."""
    skew_ppm: float | None = None
    """Rate at which our link's clock gains on the other, in ppm."""
    wall_offset_ms: float | None = None
    """Our host's time since 1970 minus the other host's, in ms; null: unknown."""
    wall_bound_us: float | None = None
    """Largest possible error of `wall_offset_ms`, in µs."""
    period_s: float = 0.0
    """Time between its last two CLOCK records, in s."""
    samples: Count = 0
    """Time stamps taken, of both directions."""
    steps: Count = 0
    """How often the clock jumped."""
    false_steps: Count = 0
    """How often the clock seemed to jump but had not; not among `steps`."""
    contradicted: Count = 0
    """Time stamps rejected because they contradict the others."""
    refused: Count = 0
    """CLOCK records rejected: of another boot, or not newer than the last one."""
    resets: Count = 0
    """How often the robot restarted with another clock."""


class ReceivedTopicReport(msgspec.Struct, frozen=True, kw_only=True):
    """A topic of one source, as this robot receives it."""

    src: int
    """Id of the robot that sends the topic."""
    topic_id: int
    """Id of the topic on the air."""
    name: str
    """`/` and the topic's name in the registry; for an unknown topic, its id."""
    republished_as: str
    """Name on the bus; empty: nothing has been published yet."""
    delivered: Count = 0
    """Messages handed to the bus."""
    delivered_per_s: float = 0.0
    """Messages handed to the bus per second."""
    delivered_bytes: Count = 0
    """Payload bytes handed to the bus."""
    delivered_bytes_per_s: float = 0.0
    """Payload bytes handed to the bus per second."""
    dropped: dict[str, Count] = {}
    """Messages dropped, by reason (`rx_*`)."""
    pdr: float | None = None
    """Share of the messages that were delivered rather than dropped, 0 to 1; null: no messages."""
    age_ms_last: float | None = None
    """Age of the last message at its handover, in ms; null: unknown."""
    age_ms_p50: float | None = None
    """Median age of the recent messages, in ms; null: unknown."""
    age_ms_p99: float | None = None
    """99th percentile of the ages of the recent messages, in ms; null: unknown."""
    latency: LatencyReport | None = None
    """The parts of the age; null: no age is known."""
    stops: Count = 0
    """Stop messages published because the topic fell silent."""


class NeighborReport(msgspec.Struct, frozen=True, kw_only=True):
    """A robot that this robot hears."""

    src: int
    """Id of the robot."""
    is_self: bool
    """Whether it is this robot itself, which hears its own PDUs."""
    last_heard_s_ago: float
    """Time since its last PDU, in s."""
    pdus_heard: Count
    """PDUs heard, without duplicates."""
    pdus_lost: int
    """PDUs lost, by gaps in the PDU numbers."""
    pdus_repaired: Count = 0
    """PDUs lost at first that came when they were sent again; they are not in `pdus_lost`."""
    per: float
    """Share of its PDUs that were lost since the start, 0 to 1."""
    per_lately: float | None = None
    """Share of its PDUs that were lost in the last `RATE_WINDOW_S`, 0 to 1; null: none was sent."""
    duplicates: Count
    """PDUs heard again and ignored."""
    usual_gap_s: float = 0.0
    """Longest recent pause between its PDUs, in s."""
    hops_left: int
    """How many more times its last PDU may be relayed."""
    reboots: Count
    """How often the robot restarted since it was first heard."""
    snr_db: float | None = None
    """Recent mean SNR of its PDUs, in dB; null: the PDU link measures none."""
    registry: str = "unknown"
    """Its registry compared with ours: same | differs | unknown"""
    snr_there_db: float | None = None
    """SNR at which it hears us by its own report, in dB; null: not reported."""
    per_there: float | None = None
    """Share of our PDUs that it lost by its own report, 0 to 1; null: not reported."""
    mcs: int = 0
    """MCS with which we send default and bulk traffic to it."""
    doppler_hz: float | None = None
    """Recent Doppler of its bursts, in Hz; null: not known."""
    longest_burst_s: float | None = None
    """Longest burst that its Doppler allows, in s; null: it sets no bound."""
    clock: ClockReport | None = None
    """What is known about its clock; null: nothing."""


class TxReport(msgspec.Struct, frozen=True, kw_only=True):
    """The transmit ledger: accepted = sent + queued + in_flight + every reason of `dropped`."""

    accepted: Count
    """Messages that entered the ledger: submitted, refused by the bus, reoffered or relayed."""
    sent: Count
    """Messages that have left completely."""
    queued: int
    """Messages in the queue of which no part has been sent yet."""
    queued_bytes: int
    """Payload bytes of the queued messages."""
    in_flight: int
    """Messages of which a part is composed and that are neither sent nor dropped yet."""
    dropped: dict[str, Count]
    """Messages dropped, by reason (`tx_*`)."""
    queued_by_class: dict[str, int]
    """Queued messages by class."""
    entries: Count
    """Entries composed into PDUs."""
    pdus_composed: Count
    """PDUs composed."""
    pdus_sent: Count
    """PDUs in bursts that left."""
    pdus_failed: Count
    """PDUs in bursts that failed."""
    bursts_sent: Count
    """Bursts that left."""
    bursts_failed: Count
    """Bursts that did not leave and were given up."""


class RxReport(msgspec.Struct, frozen=True, kw_only=True):
    """The receive ledgers, of PDUs and of messages.

    pdus_heard = pdus_used + every reason of `pdus_dropped`;
    started = delivered + held + every reason of `dropped`.
    """

    pdus_heard: Count
    """PDUs received from the PDU link."""
    pdus_used: Count
    """PDUs with entries for this robot."""
    pdus_dropped: dict[str, Count]
    """Other PDUs, by reason (`rx_*`, `sec_*`)."""
    started: Count
    """Messages of which at least one part has arrived."""
    delivered: Count
    """Messages handed to the bus."""
    held: int
    """Incomplete messages that wait for more fragments."""
    held_bytes: int
    """Memory of the incomplete messages, in bytes."""
    dropped: dict[str, Count]
    """Messages dropped, by reason (`rx_*`)."""
    control_bad: Count = 0
    """Unreadable control entries that were skipped (rx_control_bad)."""


class RelayReport(msgspec.Struct, frozen=True, kw_only=True):
    """PDUs that this robot relays; each also counts as a message in the transmit ledger."""

    accepted: Count = 0
    """PDUs to be relayed, including those that were then dropped."""
    sent: Count = 0
    """PDUs relayed."""
    dropped: dict[str, Count] = {}
    """PDUs dropped, by reason (`tx_*`)."""


class RobotLinksReport(msgspec.Struct, frozen=True, kw_only=True):
    """How well a robot hears others, as the team was told."""

    id: int
    """Id of the robot."""
    told_s_ago: float
    """Time in s since this came."""
    hears: dict[int, float]
    """Share of the PDUs of each other robot that it receives directly."""


class FlowReport(msgspec.Struct, frozen=True, kw_only=True):
    """PDUs of one source to one destination that this robot sends or relays."""

    src: int
    """Id of the robot that they are from."""
    dst: int
    """Id of the robot that they are for; 255: everyone."""
    forwarded_by: list[int]
    """The robots that are to forward them next."""
    went_around: Count
    """How often a robot did not answer, so that others were named."""


class RoutesReport(msgspec.Struct, frozen=True, kw_only=True):
    """Links and paths of the team, with `relay.policy = "auto"`."""

    robots: list[RobotLinksReport] = []
    """The robots of which links are known, in ascending order of ids."""
    flows: list[FlowReport] = []
    """What goes through this robot, in ascending order of sources."""
    going_around: list[int] = []
    """Robots that did not answer, and that nothing is sent through for some seconds."""


class ReservedFlowReport(msgspec.Struct, frozen=True, kw_only=True):
    """A flow of the team that air is reserved for."""

    src: int
    """Id of the robot that it is from."""
    topic_id: int
    """Topic id at that robot."""
    name: str
    """Name of the topic; empty if it is not known here."""
    qos: str
    """Class of its messages."""
    priority: int
    """Priority within the class."""
    dst: int
    """Id of the robot that it is for; 255: everyone."""
    via: list[int]
    """The robots that forward it."""
    rate_hz: float
    """Messages a second."""
    size: int
    """Largest size of a message in bytes."""
    air_pct: float
    """Airtime in % that it takes over its route."""
    admitted: bool | None
    """Whether it has air; null: the planner has not said anything of it yet."""


class AdmissionReport(msgspec.Struct, frozen=True, kw_only=True):
    """Air that flows reserve in the team (the key `reserve` of a topic)."""

    planner: int | None = None
    """Id of the robot that decides; null: nothing is reserved."""
    limit_pct: float = 0.0
    """Airtime in % up to which flows are admitted."""
    admitted_pct: float = 0.0
    """Airtime in % of all flows that are admitted."""
    flows: list[ReservedFlowReport] = []
    """The flows, in ascending order of robots and topic ids."""
    records_ignored: Count = 0
    """FLOWS and ADMIT records that cannot be true, or that are not from the planner."""


class SecurityReport(msgspec.Struct, frozen=True, kw_only=True):
    """Sealed PDUs: the keys, and the robots that have proven to be alive."""

    mode: str = "off"
    """What is sealed: off (nothing) | auth (all can read) | seal"""
    clear: str = "accept"
    """What happens to PDUs in the clear: accept | refuse"""
    unproven: str = "deliver"
    """What happens to messages of robots that are not proven: deliver | drop"""
    kid: int | None = None
    """Number of the key that seals, 0 to 3; null: none."""
    fingerprint: str = ""
    """Fingerprint of that key, in hex."""
    further_kids: list[int] = []
    """Numbers of the other keys that open PDUs, while keys change."""
    proven: list[int] = []
    """Robots that have proven to be alive now."""
    not_proven: list[int] = []
    """Robots that are heard and have not proven it."""
    key_days_left: float | None = None
    """Days for which the key can still be used; null: no key."""
    waits: Count = 0
    """How often a burst waited for numbers of sealed PDUs."""
    halted: str = ""
    """Why nothing is sent any more, as a sentence; empty: all is well."""
    strangers: list[str] = []
    """Sentences on robots that are heard and not believed, as they have another key, for example.

    Anybody can send what leads to them."""
    copies: list[int] = []
    """Robots on other machines with the machine id of this one: one disk is a copy of the other."""


class RepeatReport(msgspec.Struct, frozen=True, kw_only=True):
    """Selective repeat: what was sent again, and what was asked for."""

    pdus: Count = 0
    """PDUs sent again."""
    airtime_s: Total = 0.0
    """Airtime of the bursts with these PDUs, in s."""
    asked: Count = 0
    """PDUs asked of others, each as often as it was asked for."""
    given_up: Count = 0
    """PDUs of others that were missing for so long that nobody repeats them."""
    asked_of_us: Count = 0
    """PDUs that others asked for, each as often as it was asked for."""
    unknown: Count = 0
    """Of these: never sent, not kept any more, or not for the robot that asked."""
    expired: Count = 0
    """Of these: with messages that have all outlived their lifespans."""
    refused: Count = 0
    """Of these: dropped as too many others waited."""


class LinkReport(msgspec.Struct, frozen=True, kw_only=True):
    """The link: ledgers, topics, neighbors, access, and use of the channel."""

    pdu_size: int
    """Size of every PDU, in octets."""
    access: str
    """State and times of the access policy in force, as text for people."""
    access_policy: str = "none"
    """Access policy in force; where access.policy is auto, the one that was chosen."""
    access_reason: str = ""
    """Why the access policy in force was chosen."""
    access_share_pct: float = 100.0
    """Share of the airtime in % that this policy can use with this radio under full load."""
    airtime_s: Total
    """Airtime of all bursts that left, in s."""
    air_sent_pct: float = 0.0
    """Airtime of our bursts over the last `RATE_WINDOW_S`, in %."""
    air_heard_pct: float = 0.0
    """Airtime of the bursts heard from others over the last `RATE_WINDOW_S`, in %."""
    airtime_by_class_s: dict[str, Total] = {}
    """Airtime by the class of the PDUs, in s; includes bursts that failed."""
    control_airtime_s: Total = 0.0
    """Airtime of PDUs that hold only control records, in s."""
    control_period_s: float = 0.0
    """Longest time in s between PDUs that hold only CLOCK and RECEIPT records."""
    bursts_by_mcs: dict[int, Count]
    """Bursts that left, by MCS."""
    bursts_late: Count
    """How often a burst missed its slot and was put into the retry queue."""
    mcs_lowest: int | None = None
    """Slowest MCS that rate control may choose; null: the MCS is fixed."""
    mcs_changes: list[tuple[float, int, int]]
    """Latest MCS changes: (time on the link's clock in s, neighbor, new MCS)."""
    control_channel: bool
    """Whether the registry leaves a topic id free for control records."""
    registry_digest: str
    """Digest of our registry, in hex; robots with the same registry have the same digest."""
    security: SecurityReport = SecurityReport()
    """Sealed PDUs."""
    relayed: RelayReport = RelayReport()
    """PDUs of other robots that this robot relays."""
    routes: RoutesReport = RoutesReport()
    """Links and paths of the team."""
    admission: AdmissionReport = AdmissionReport()
    """Air that flows of the team reserve."""
    repeats: RepeatReport = RepeatReport()
    """PDUs sent again, and asked for."""
    fragments_repaired: Count = 0
    """Lost fragments that were computed from parity."""
    receipts_untold: Count = 0
    """RECEIPT records for others that were never sent, as too many were waiting."""
    receipts_unasked: Count = 0
    """RECEIPT records received for messages that no longer await one."""
    tx: TxReport
    """The transmit ledger."""
    rx: RxReport
    """The receive ledgers."""
    topics: list[TopicReport]
    """All topics of the registry, as this robot sends them."""
    received: list[ReceivedTopicReport]
    """Topics received from other robots."""
    neighbors: list[NeighborReport]
    """Robots heard, in ascending order of ids."""


class LineReport(msgspec.Struct, frozen=True, kw_only=True):
    """A tone or narrow signal of others, which the modem cuts out of what it receives."""

    offset_hz: float
    """Its frequency relative to the centre of the channel, in Hz."""
    level_dbfs: float
    """Its power, in dB relative to full scale."""
    over_noise_db: float | None = None
    """Its power over that of the noise, in dB; null: the modem does not listen for energy."""
    cut_pct: float = 0.0
    """Share of the band that is cut for it, in %."""
    sweeps: bool = False
    """Whether it moves through the band."""


class OtherLinkReport(msgspec.Struct, frozen=True, kw_only=True):
    """A link whose bursts are heard, but not received: it has another network or PDU size."""

    network: int
    """Its modem.network."""
    pdu_size: int
    """Its link.pdu_size, in bytes."""


class PduLinkReport(msgspec.Struct, frozen=True, kw_only=True):
    """The PDU link, which carries the PDUs, and its state."""

    kind: str
    """The configured backend."""
    state: str
    """State of the PDU link: opening | up | waiting (for a radio that is absent) | refused (the
    radio does not accept its settings) | down | ended (a recording is over)"""
    detail: str = ""
    """The PDU link and its main settings, as text for people."""
    reason: str = ""
    """Why the link is not up, as a sentence; empty: it is up."""
    since_s: float = 0.0
    """Time in the present state, in s."""
    level_dbfs: float | None = None
    """Recent mean power of the received samples, in dB relative to full scale; null: unknown."""
    clipped_pct: float = 0.0
    """Share of the recently received samples at full scale, in %."""
    max_cfo_hz: float | None = None
    """Largest frequency offset at which the receiver searches for bursts, in Hz."""
    counters: dict[str, Count] = {}
    """Counters of the radio and the modem by name."""
    realtime_ratio: float | None = None
    """Speed of the receiver as a multiple of real time, by CPU time; null: unknown."""
    scheduling: str = ""
    """How the kernel runs the modem's process, as text for people; empty: nothing was asked."""
    engine: str = ""
    """What computes the modem, as text for people; empty: not known yet."""
    lines: list[LineReport] = []
    """Tones and narrow signals that are cut out of the received samples, the strongest first."""
    network: int | None = None
    """Our modem.network; null: there is no modem."""
    others: list[OtherLinkReport] = []
    """Other links that were heard in the last 10 s, the most often first."""
    notices: list[str] = []
    """What a person should know about the PDU link, in sentences."""


class BusReport(msgspec.Struct, frozen=True, kw_only=True):
    """The traffic of the local bus."""

    runtime_dir: str
    """Directory of the daemon's sockets."""
    received: Count
    """Messages received from producers, including those that were refused."""
    published: Count
    """Messages from other robots handed to consumers."""
    control_requests: Count
    """Requests answered on the control socket."""
    bad_envelope_last: str = ""
    """What was wrong with the last refused message; empty: none was refused."""


class VerdictReport(msgspec.Struct, frozen=True, kw_only=True):
    """The state of the daemon and its link, in one word and in plain sentences."""

    level: str = "OK"
    """The verdict: OK | DEGRADED | DOWN"""
    protection: str = "in the clear"
    """What protects the PDUs that we send: in the clear | authenticated | sealed"""
    reasons: list[str] = []
    """Why the level is not OK, the worst reason first."""


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that one daemon reports at one moment."""

    version: str
    """Version of sdrlinkd."""
    node: int
    """Id of this robot."""
    namespace: str
    """ROS namespace of this robot's topics."""
    state: str
    """State of the daemon: running | draining (it sends the queue and then stops)"""
    taken_at_unix_ns: int
    """Time of the snapshot by the host's clock, in ns since 1970."""
    uptime_s: float
    """Time since the daemon's start, in s."""
    loop_lag_ms: float
    """Delay of the event loop's timer: the recent maximum, which decays; in ms."""
    host_clock_steps: Count = 0
    """How often this host's clock was set while the daemon ran."""
    verdict: VerdictReport = VerdictReport()
    """OK, DEGRADED or DOWN, with reasons."""
    carrier: PduLinkReport
    """The PDU link."""
    bus: BusReport
    """The local bus."""
    link: LinkReport
    """The link: ledgers, topics, neighbors and airtime."""
    notices: list[str] = []
    """What a person should know: what is switched off, disagrees or was refused."""
