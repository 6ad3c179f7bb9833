"""The status schema: what each part tells of itself.

Frozen, with the unit in the name; counters only grow; `*_per_s` are means over the last
`RATE_WINDOW_S`. One `Snapshot` is built from all of them, and every view renders that snapshot.
"""

import msgspec

RATE_WINDOW_S = 5.0


class TopicReport(msgspec.Struct, frozen=True, kw_only=True):
    """A topic of the registry on its way out."""

    topic_id: int
    name: str
    type: str
    subscribed: bool
    qos: str
    priority: int
    accepted: int = 0
    accepted_per_s: float = 0.0
    accepted_bytes_per_s: float = 0.0
    sent: int = 0
    sent_bytes: int = 0
    queued: int = 0
    reoffered: int = 0
    """Messages among those accepted that were sent again to robots that came late."""
    dropped: dict[str, int] = {}
    lifespan_s: float | None = None
    """Age after which its messages are not sent any more; null: they have no end."""
    lifespan_from: str = ""
    """Whose lifespan that is: topic | class; empty: nobody's."""
    queue_ms: float | None = None
    """What messages waited lately: for others before them; for the air; for another chance."""
    access_ms: float | None = None
    again_ms: float | None = None


class LatencyReport(msgspec.Struct, frozen=True, kw_only=True):
    """How late messages of one topic of one source come: means over the last ones, all in ms.

    Their age = wait + reassembly + air + handover; wait = queue + access + again, as far as the
    source told (null: it did not). `period` is the time between two messages, `jitter` its standard
    deviation (the Pound paper's Jd); `percentiles` are of all ages since the start.
    """

    wait_ms: float
    queue_ms: float | None = None
    access_ms: float | None = None
    again_ms: float | None = None
    reassembly_ms: float
    air_ms: float
    handover_ms: float
    period_ms: float | None = None
    jitter_ms: float | None = None
    percentiles_ms: dict[str, float] = {}


class ClockReport(msgspec.Struct, frozen=True, kw_only=True):
    """Another robot's clock, as far as it is known here.

    `offset_ms`: its link's clock behind ours, ± `bound_us`; `wall_offset_ms` and `wall_bound_us`
    are that of the hosts' clocks since 1970. `skew_ppm`: what we gain on it.
    """

    state: str
    """unsynced | coarse | synced | holdover"""
    offset_ms: float | None = None
    bound_us: float | None = None
    skew_ppm: float | None = None
    wall_offset_ms: float | None = None
    wall_bound_us: float | None = None
    period_s: float = 0.0
    """Time between its CLOCK records."""
    samples: int = 0
    steps: int = 0
    """How often the clock jumped."""
    contradicted: int = 0
    """Stamps that did not fit the others."""
    refused: int = 0
    """Records of another boot, or not newer than the last one."""
    resets: int = 0
    """How often it started anew, with another clock."""


class ReceivedTopicReport(msgspec.Struct, frozen=True, kw_only=True):
    """A topic of one source, as heard here. `pdr` is delivered over begun messages."""

    src: int
    topic_id: int
    name: str
    republished_as: str
    delivered: int = 0
    delivered_per_s: float = 0.0
    delivered_bytes: int = 0
    delivered_bytes_per_s: float = 0.0
    dropped: dict[str, int] = {}
    pdr: float | None = None
    age_ms_last: float | None = None
    age_ms_p50: float | None = None
    age_ms_p99: float | None = None
    latency: LatencyReport | None = None
    stops: int = 0
    """Stop messages published because nothing came."""


class NeighborReport(msgspec.Struct, frozen=True, kw_only=True):
    """A source of PDUs. `per` is PDUs known lost over PDUs sent, from sequence numbers."""

    src: int
    is_self: bool
    last_heard_s_ago: float
    pdus_heard: int
    pdus_lost: int
    per: float
    per_lately: float | None = None
    """PDUs known lost over PDUs sent in the last `RATE_WINDOW_S`; null: nothing was due from it."""
    duplicates: int
    usual_gap_s: float = 0.0
    """The longest pause between its PDUs lately."""
    hops_left: int
    reboots: int
    snr_db: float | None = None
    registry: str = "unknown"
    """same | differs | unknown"""
    snr_there_db: float | None = None
    """How this neighbor hears us, by its own report; `per_there` likewise."""
    per_there: float | None = None
    mcs: int = 0
    """The MCS with which we send to it."""
    clock: ClockReport | None = None


class TxReport(msgspec.Struct, frozen=True, kw_only=True):
    """The transmit ledger: accepted = sent + queued + in_flight + every reason of `dropped`."""

    accepted: int
    sent: int
    queued: int
    queued_bytes: int
    in_flight: int
    dropped: dict[str, int]
    queued_by_class: dict[str, int]
    entries: int
    pdus_composed: int
    pdus_sent: int
    pdus_failed: int
    bursts_sent: int
    bursts_failed: int


class RxReport(msgspec.Struct, frozen=True, kw_only=True):
    """The receive ledgers, of PDUs and of messages.

    pdus_heard = pdus_used + every reason of `pdus_dropped`;
    started = delivered + held + every reason of `dropped`.
    """

    pdus_heard: int
    pdus_used: int
    pdus_dropped: dict[str, int]
    started: int
    delivered: int
    held: int
    held_bytes: int
    dropped: dict[str, int]
    control_bad: int = 0
    """Control entries skipped because they could not be read (rx_control_bad)."""


class RelayReport(msgspec.Struct, frozen=True, kw_only=True):
    """PDUs that are forwarded; each also counts as a message of the transmit ledger."""

    accepted: int = 0
    sent: int = 0
    dropped: dict[str, int] = {}


class LinkReport(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that the link reports."""

    pdu_size: int
    access: str
    access_policy: str = "none"
    """The access policy in force; where access.policy is auto, the one that was chosen."""
    access_reason: str = ""
    """Why the access policy in force was chosen."""
    access_share_pct: float = 100.0
    """Share of the air that the policy in force carries on this radio, when all always send."""
    airtime_s: float
    """Time on the air, all bursts together."""
    air_sent_pct: float = 0.0
    """Share of the air that our bursts took over the last `RATE_WINDOW_S`."""
    air_heard_pct: float = 0.0
    """Share of the air that bursts of others took in that time, as far as they were heard."""
    airtime_by_class_s: dict[str, float] = {}
    """Time on the air by the class of what was inside, bursts that failed included."""
    control_airtime_s: float = 0.0
    """Time on the air of PDUs with nothing but records."""
    control_period_s: float = 0.0
    """Longest time between PDUs with nothing but CLOCK and RECEIPT records."""
    bursts_by_mcs: dict[int, int]
    bursts_late: int
    """Bursts that came too late for their slot and were sent again."""
    mcs_lowest: int | None = None
    """The slowest MCS that may be chosen; null: it is fixed."""
    mcs_changes: list[tuple[float, int, int]]
    """(when by the link's clock, neighbor, MCS from then on), the last ones."""
    control_channel: bool
    registry_digest: str
    relayed: RelayReport = RelayReport()
    fragments_repaired: int = 0
    """Fragments computed from parity."""
    receipts_untold: int = 0
    """RECEIPTs to others that found no room."""
    receipts_unasked: int = 0
    """RECEIPTs of others of which nothing was known here any more."""
    tx: TxReport
    rx: RxReport
    topics: list[TopicReport]
    received: list[ReceivedTopicReport]
    neighbors: list[NeighborReport]


class PduLinkReport(msgspec.Struct, frozen=True, kw_only=True):
    """What carries the PDUs, and how it fares."""

    kind: str
    state: str
    """opening | up | waiting (for a radio that is not there yet) | refused (by a radio that does
    not take its settings) | down | ended (a recording is over)"""
    detail: str = ""
    reason: str = ""
    """Why the link is not up, in a sentence."""
    since_s: float = 0.0
    """How long it has been in this state."""
    level_dbfs: float | None = None
    """Mean power of what the radio received lately; full scale is 0."""
    clipped_pct: float = 0.0
    """Share of the samples received lately that stood at full scale."""
    max_cfo_hz: float | None = None
    """Bursts are looked for up to so far off in frequency."""
    counters: dict[str, int] = {}
    realtime_ratio: float | None = None
    """How many times faster than real time the receiver works, in processor time."""
    notices: list[str] = []


class BusReport(msgspec.Struct, frozen=True, kw_only=True):
    """What the local bus took and handed over."""

    runtime_dir: str
    received: int
    published: int
    control_requests: int
    bad_envelope_last: str = ""


class VerdictReport(msgspec.Struct, frozen=True, kw_only=True):
    """How the daemon and its link fare, in a word and in plain sentences."""

    level: str = "OK"
    """OK | DEGRADED | DOWN"""
    reasons: list[str] = []
    """Why it is not OK, the worst first."""


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that one daemon reports at one moment."""

    version: str
    node: int
    namespace: str
    state: str
    """running | draining"""
    taken_at_unix_ns: int
    uptime_s: float
    loop_lag_ms: float
    host_clock_steps: int = 0
    """How often this host's clock was set, by more than it strays."""
    verdict: VerdictReport = VerdictReport()
    carrier: PduLinkReport
    bus: BusReport
    link: LinkReport
    notices: list[str] = []
    """Sentences a person should read: what is switched off, disagrees or was refused."""
