"""Links for tests: small to make, with their times written down."""

from random import Random

from sdrlinkd.link import Link, LinkParams, Outcome, QueueParams, ReassemblyParams
from sdrlinkd.wire import make_registry, parse

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
    beacon_s=0.0,
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
    )


def send_all(link, now=0.0, max_pdus=63):
    """Compose and confirm until nothing is left that may go at `now`; the PDUs."""
    pdus = []
    while burst := link.compose(now, max_pdus):
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
