"""The link: queues, packing, duplicates, ages and the ledger, as a calculator over `now`."""

from sdrlinkd.link.access import (
    AccessParams,
    Settled,
    check_access,
    make_access,
    may_share,
    percent,
    settle,
)
from sdrlinkd.link.carrier import CarrierTraits, Opportunity, Sensed
from sdrlinkd.link.link import Link
from sdrlinkd.link.packing import flush_told
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.qos import (
    AS_CONFIGURED,
    MAX_PRIORITY,
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
    Lifespan,
    Lives,
    Outbox,
    Outgoing,
    TopicPolicy,
    lifespan_of,
    train_dictionary,
)
from sdrlinkd.link.receipts import Verdict
from sdrlinkd.link.receive import CDR_HEADER_SIZE, Delivered, Relay, RelayParams
from sdrlinkd.link.report import link_notices, link_report
from sdrlinkd.link.schedule import (
    IDLE_SHARE,
    OVERRUN,
    SHARED_OVERRUN,
    Allowance,
    BulkParams,
    ClassesParams,
    ClassParams,
    DefaultParams,
    LatencyParams,
    UrgentParams,
)
from sdrlinkd.link.status import Told
from sdrlinkd.link.timesync import ClockParams, Clocks, DualEnvelope, PaperFilter, State, Wall
from sdrlinkd.link.transmit import Burst, Outcome, RateChange, RateControl, RateParams

__all__ = [
    "AS_CONFIGURED",
    "CDR_HEADER_SIZE",
    "DEFAULT_POLICY",
    "IDLE_SHARE",
    "MAX_PRIORITY",
    "OVERRUN",
    "QOS_BY_LABEL",
    "RX_PDU_REASONS",
    "RX_REASONS",
    "SHARED_OVERRUN",
    "TX_REASONS",
    "AccessParams",
    "Allowance",
    "BulkParams",
    "Burst",
    "CarrierTraits",
    "ClassParams",
    "ClassesParams",
    "ClockParams",
    "Clocks",
    "DefaultParams",
    "Deflated",
    "Delivered",
    "DualEnvelope",
    "LatencyParams",
    "Lifespan",
    "Link",
    "LinkParams",
    "Lives",
    "Opportunity",
    "Outbox",
    "Outcome",
    "Outgoing",
    "Overrides",
    "PaperFilter",
    "Qos",
    "QueueParams",
    "RateChange",
    "RateControl",
    "RateParams",
    "ReassemblyParams",
    "Relay",
    "RelayParams",
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
    "link_notices",
    "link_report",
    "make_access",
    "may_share",
    "percent",
    "settle",
    "train_dictionary",
]
