"""Links for tests: easy to make, with explicit times."""

from collections import Counter
from itertools import count
from math import inf
from random import Random

import msgspec

from sdrlinkd.link import (
    QOS_BY_LABEL,
    AccessParams,
    AdmissionParams,
    ClassesParams,
    ClockParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    PduLinkTraits,
    Qos,
    QueueParams,
    RateParams,
    ReassemblyParams,
    RelayParams,
    RepeatParams,
)
from sdrlinkd.link.queue import Outgoing, TxTally
from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    Beacon,
    PduBuilder,
    Registry,
    build_records,
    equal_payload,
    flags,
    make_registry,
    parse,
    parse_records,
)

PDU_S = 0.001
MAX_PDUS = 63
NUMBERS = count()
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
    repeat=None,
    has_numbers=False,
    admission=None,
    traits=None,
    **params,
):
    """A link on its own air; `params` are LinkParams. No beacons unless requested."""
    link = Link(
        LinkParams(beacon_s=beacon_s, **params),
        queue or QueueParams(),
        reassembly or ReassemblyParams(),
        make_registry(topics) if topics else Registry(()),
        own_id,
        Random(seed),
        hears_self=hears_self,
        classes=classes or ClassesParams(),
        relay=relay or RelayParams(),
        dictionaries=dictionaries or {},
        clock=clock or ClockParams(period_s=0.0),
        repeat=repeat or RepeatParams(share=0.0),
        has_numbers=has_numbers,
        admission=admission or AdmissionParams(),
    )
    link.attach(traits or PduLinkTraits(), AccessParams(), RateParams())
    return link


def outgoing(
    size=10, qos=Qos.DEFAULT, priority=64, topic_id=0, dst=255, at=0.0, until=inf, **more
):  # fmt: skip
    """A message for the queue."""
    return Outgoing(topic_id, bytes(size), qos, priority, dst, at, until, False, TxTally(), **more)


def compose(link, now, max_pdus=MAX_PDUS):
    """The burst that leaves at `now` over an air with zero airtime; None if none leaves."""
    return link.next_burst(Opportunity(now, lambda _mcs, _n: 0.0, lambda _mcs, _s: max_pdus))


def compose_at(link, bytes_per_s):
    """Make the link send something of topic 2 on an air of that capacity."""
    link.submit(2, b"", 0.0)
    each_s = equal_payload(link.params.pdu_size, 1) / bytes_per_s
    burst = link.next_burst(Opportunity(0.0, lambda _, n: n * each_s, lambda *_: 8))
    link.confirm(burst, Outcome.SENT, 0.0)


def tx(link):
    """The TX half of the ledger."""
    return link.report(0.0).tx


def rx(link):
    """The RX half of the ledger; 0 for anything that never came."""
    report = link.report(0.0).rx
    return msgspec.structs.replace(
        report, dropped=Counter(report.dropped), pdus_dropped=Counter(report.pdus_dropped)
    )


def topic_of(link, topic_id):
    """The report on a topic to send; 0 for anything that never came."""
    report = link.report(0.0).topics[topic_id]
    return msgspec.structs.replace(report, dropped=Counter(report.dropped))


def received(link):
    """Reports on received topics, by (source, topic id)."""
    return {
        (each.src, each.topic_id): msgspec.structs.replace(each, dropped=Counter(each.dropped))
        for each in link.report(0.0).received
    }


def neighbors(link):
    """The neighbors, by robot."""
    return {each.src: each for each in link.report(0.0).neighbors}


def classes_queued(link):
    """Waiting messages, by class."""
    return {QOS_BY_LABEL[label]: n for label, n in tx(link).queued_by_class.items()}


def send_all(link, now=0.0, max_pdus=63):
    """Compose and confirm until no message may leave at `now`; returns the PDUs."""
    pdus = []
    while burst := compose(link, now, max_pdus):
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
    """Airtime on an air without preambles."""
    return PDU_S * n_pdus


def most_pdus(_mcs, longest_s):
    """Always 8 PDUs at most."""
    return int(min(8, longest_s / PDU_S + 1e-6))


def next_burst(link, now):
    """What the link sends when queried at `now`."""
    return link.next_burst(Opportunity(now, airtime_s, most_pdus))


def tell(link, src, *records, at, number=None):
    """Make `link` hear a PDU of robot `src` with only `records`; a BEACON by default.

    Without a `number`, it has one that no other test used, which may look like a late one.
    """
    builder = PduBuilder(link.params.pdu_size)
    for record in records or (Beacon(src, 0),):
        assert builder.add_record(build_records([record]))
    number = next(NUMBERS) if number is None else number
    pdu = builder.build(flags(0), src, BROADCAST, number & 0xFF, link.params.hop_limit, number >> 8)
    link.hear(pdu, at)


def use(link, access, **traits):
    """Make `link` use `access` to decide when to send."""
    fit = link.attach(PduLinkTraits(**traits), AccessParams(), RateParams())
    link.use(fit._replace(settled=fit.settled._replace(access=access)))


def records_in(pdu, pdu_size):
    """All control records in a PDU."""
    entries = parse(pdu, pdu_size).entries
    controls = [e.payload for e in entries if e.topic_id == CONTROL_TOPIC_ID]
    return [record for payload in controls for record in parse_records(payload)]
