"""Links for tests: small to make, with their times written down."""

from random import Random

from sdrlinkd.link import (
    Allowance,
    ClassesParams,
    ClockParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    QueueParams,
    ReassemblyParams,
    RelayParams,
)
from sdrlinkd.wire import CONTROL_TOPIC_ID, make_registry, parse, parse_records

PDU_S = 0.001
TOPICS = (
    ("odom", "nav_msgs/Odometry"),
    ("scan", "sensor_msgs/LaserScan"),
    ("imu", "sensor_msgs/Imu"),
)


def make_link(
    own_id=1,
    topics=TOPICS,
    seed=1,
    queue=None,
    reassembly=None,
    hears_self=False,
    classes=None,
    relay=None,
    dictionaries=None,
    beacon_s=0.0,
    clock=None,
    **params,
):
    """A link; `params` are LinkParams. No beacons unless asked for."""
    return Link(
        LinkParams(beacon_s=beacon_s, **params),
        queue or QueueParams(),
        reassembly or ReassemblyParams(),
        make_registry(topics),
        own_id,
        Random(seed),
        hears_self=hears_self,
        classes=classes or ClassesParams(),
        relay=relay or RelayParams(),
        dictionaries=dictionaries or {},
        clock=clock or ClockParams(period_s=0.0),
    )


def send_all(link, now=0.0, max_pdus=63):
    """Compose and confirm until nothing is left that may go at `now`; the PDUs."""
    pdus = []
    while burst := link.scheduler.compose(now, Allowance.of(max_pdus)):
        pdus += burst.pdus
        link.confirm(burst, Outcome.SENT, now)
    return pdus


def layouts(pdus, pdu_size):
    """Per PDU the (topic id, index, total, payload size) of its data entries."""
    return [
        [
            (e.topic_id, e.index, e.total, len(e.payload))
            for e in parse(pdu, pdu_size).entries
            if e.topic_id != 15
        ]
        for pdu in pdus
    ]


def airtime_s(_mcs, n_pdus):
    """As of a carrier without preambles."""
    return PDU_S * n_pdus


def most_pdus(_mcs, longest_s):
    """At most 8."""
    return int(min(8, longest_s / PDU_S + 1e-6))


def next_burst(link, now):
    """What the link sends when it is asked at `now`."""
    return link.next_burst(Opportunity(now, airtime_s, most_pdus))


def records_in(pdu, pdu_size):
    """All control records in a PDU."""
    entries = parse(pdu, pdu_size).entries
    controls = [e.payload for e in entries if e.topic_id == CONTROL_TOPIC_ID]
    return [record for payload in controls for record in parse_records(payload)]
