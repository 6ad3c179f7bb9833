"""Our daemons, and their configuration."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from benchmarks import daemons
from benchmarks.pound.ours import MCS, PDU_SIZE, RATE_HZ, SNR_DB

BLOCK_S = {"loopback": 2.5e-4, "ether": 5e-4}
"""Block lengths; three programs on two cores have no time for shorter blocks."""
MAX_BURST_S = 0.02
BULK_BURST_S = 0.003
LEAD_S = 0.001
SCENARIO = """pace = "realtime"
[air]
rate_hz = {rate}
snr_db = {snr}
block_s = {block}
[[robot]]
id = 1
radio = {{ full_duplex = true, clock_ppm = 4.0 }}
[[robot]]
id = 2
radio = {{ full_duplex = true, clock_ppm = -6.0 }}
[outages]
times = {outages}
"""
CONFIG = """[channel]
snr_db = {snr}
[link]
pdu_size = {pdu_size}
[modem]
rate_hz = {rate}
mcs = {mcs}
max_burst_s = {max_burst}
tx_lead_s = {lead}
block_s = {block}
[classes.bulk]
share = 0.05
max_burst_s = {bulk_burst}
[topic.laser]
qos = "latency"
[topic.image]
qos = "bulk"
[topic.stop]
qos = "urgent"
"""
TOPICS = ("laser", "image", "stop")


class Ends(NamedTuple):
    """Folders of the sending and the receiving daemon, and of their air."""

    sends: Path
    hears: Path
    air: Path


@contextmanager
def running(
    backend: str, nodes: Sequence[int], outages: Sequence[tuple[float, float]] = ()
) -> Iterator[Ends]:
    """Run daemons that hear each other, or themselves; `outages` (begin, end) are in s of the air.

    Raises PeerError.
    """
    known = {"rate": RATE_HZ, "snr": SNR_DB, "block": BLOCK_S[backend]}
    scenario = SCENARIO.format(outages=[list(each) for each in outages], **known)
    config = CONFIG.format(
        pdu_size=PDU_SIZE, mcs=MCS, max_burst=MAX_BURST_S, lead=LEAD_S, bulk_burst=BULK_BURST_S,
        **known,
    )  # fmt: skip
    with daemons.running(backend, nodes, TOPICS, config, scenario) as these:
        yield Ends(these.folders[nodes[0]], these.folders[nodes[-1]], these.air)
