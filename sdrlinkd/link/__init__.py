"""The link: queues, packing, duplicates, ages and the ledger, computed from inputs and `now`."""

from sdrlinkd.link.access import (
    AUCTION_PATIENCE,
    CLOCK_ERROR_S,
    LEAST_TURNS,
    MARGIN_S,
    AccessParams,
    Csma,
    Settled,
    check_access,
    may_share,
    percent,
    settle,
)
from sdrlinkd.link.link import Link
from sdrlinkd.link.packing import flush_told, parity_pdus
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.qos import (
    AS_CONFIGURED,
    QOS_BY_LABEL,
    Overrides,
    Qos,
)
from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    RX_PDU_REASONS,
    RX_REASONS,
    TX_REASONS,
    Deflated,
    Lives,
    Outbox,
    Outgoing,
    TopicPolicy,
    lifespan_of,
    train_dictionary,
)
from sdrlinkd.link.receipts import Verdict
from sdrlinkd.link.receive import (
    CDR_HEADER_SIZE,
    NOT_RETAINED,
    Delivered,
    Retain,
)
from sdrlinkd.link.repeat import RepeatParams
from sdrlinkd.link.report import Names
from sdrlinkd.link.routes import FixedRoutes, RelayParams
from sdrlinkd.link.schedule import (
    IDLE_SHARE,
    OVERRUN,
    SHARED_OVERRUN,
    AdmissionParams,
    Allowance,
    BulkParams,
    ClassesParams,
    ClassParams,
    DefaultParams,
    LatencyParams,
    UrgentParams,
)
from sdrlinkd.link.status import Told
from sdrlinkd.link.timesync import (
    ClockParams,
    DualEnvelope,
    Estimate,
    PaperFilter,
    State,
    Wall,
)
from sdrlinkd.link.topics import HeardTopic, Offer
from sdrlinkd.link.traits import Opportunity, PduLinkTraits, Sensed
from sdrlinkd.link.transmit import Burst, Fit, Outcome, RateControl, RateParams

__all__ = [
    "AS_CONFIGURED",
    "AUCTION_PATIENCE",
    "CDR_HEADER_SIZE",
    "CLOCK_ERROR_S",
    "DEFAULT_POLICY",
    "IDLE_SHARE",
    "LEAST_TURNS",
    "MARGIN_S",
    "NOT_RETAINED",
    "OVERRUN",
    "QOS_BY_LABEL",
    "RX_PDU_REASONS",
    "RX_REASONS",
    "SHARED_OVERRUN",
    "TX_REASONS",
    "AccessParams",
    "AdmissionParams",
    "Allowance",
    "BulkParams",
    "Burst",
    "ClassParams",
    "ClassesParams",
    "ClockParams",
    "Csma",
    "DefaultParams",
    "Deflated",
    "Delivered",
    "DualEnvelope",
    "Estimate",
    "Fit",
    "FixedRoutes",
    "HeardTopic",
    "LatencyParams",
    "Link",
    "LinkParams",
    "Lives",
    "Names",
    "Offer",
    "Opportunity",
    "Outbox",
    "Outcome",
    "Outgoing",
    "Overrides",
    "PaperFilter",
    "PduLinkTraits",
    "Qos",
    "QueueParams",
    "RateControl",
    "RateParams",
    "ReassemblyParams",
    "RelayParams",
    "RepeatParams",
    "Retain",
    "Sensed",
    "Settled",
    "State",
    "Told",
    "TopicPolicy",
    "UrgentParams",
    "Verdict",
    "Wall",
    "check_access",
    "flush_told",
    "lifespan_of",
    "may_share",
    "parity_pdus",
    "percent",
    "settle",
    "train_dictionary",
]
