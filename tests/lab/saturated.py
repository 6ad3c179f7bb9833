"""Robots that always have something to send, on radios of any kind, in virtual time."""

from random import Random

from backends import AirParams, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    Link,
    LinkParams,
    Overrides,
    Qos,
    QueueParams,
    ReassemblyParams,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import make_registry

PDU_SIZE = 1024
SETTLE_S = 3.0
TOPICS = (("data", "std_msgs/msg/ByteMultiArray"),)


def usrp(traits):
    """The traits of a device with a lead of 20 ms and blocks of 1 ms, as in modem.traits."""
    return traits._replace(
        is_lockstep=False, lead_s=0.0205 + traits.turnaround_s, react_s=0.003, ahead_s=0.005
    )


def saturated(access, n, qos=Qos.DEFAULT, *, rate_hz=5e6, block_s=1e-3, seconds=5.0, seed=1,
              turnaround_s=1e-4, fit=lambda traits: traits, size=8000):  # fmt: skip
    """The simulation, and the share of the air used by bursts once all robots take turns."""
    air = AirParams(rate_hz=rate_hz, block_s=block_s, snr_db=25.0)
    modem = ModemParams(rate_hz=rate_hz)
    airtimes = Airtimes(modem, PDU_SIZE)
    ids, rng = range(1, n + 1), Random(seed)
    until_s = SETTLE_S + seconds
    # More than a single robot could send.
    period_s = airtimes.airtime_s(modem.mcs, 1) * size / PDU_SIZE

    def arrivals(node):
        for i in range(int(until_s / period_s)):
            yield Arrival((i + node / (n + 1)) * period_s, 0, bytes(size), Overrides(qos=qos))

    links = {
        node: Link(LinkParams(pdu_size=PDU_SIZE), QueueParams(max_bytes=1 << 19),
                   ReassemblyParams(), make_registry(TOPICS), node, Random(100 * seed + node))
        for node in ids
    }  # fmt: skip
    flights = []
    radios = {
        node: RadioParams(
            full_duplex=False, turnaround_s=turnaround_s, clock_ppm=rng.uniform(-10, 10)
        )
        for node in ids
    }
    sim = Simulation(
        air, World(air, {}), radios, links, modem, airtimes,
        AccessParams(policy=access, nodes=list(ids), force=True),
        {node: arrivals(node) for node in ids}, seed=seed, fit=fit,
        watch=lambda flight, _: flights.append(flight),
    )  # fmt: skip
    sim.run(until_s)
    used_s = sum(each.end_s - each.start_s for each in flights if each.start_s > SETTLE_S)
    return sim, used_s / seconds
