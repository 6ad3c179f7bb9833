"""Tables I and II on one half-duplex channel that both directions share, by access policy."""

from benchmarks.flows import Figures
from benchmarks.pound.ours import Air, Sent, run
from benchmarks.pound.tables import EXACT, TURNAROUND_S, by_flow, flows
from sdrlinkd.config import Config

AUTO = "auto"
"""What a daemon selects if nobody names a policy."""
POLICIES = ("minislot", "csma", "tdma", "auction", "grant")
FOR_THESE = Air(full_duplex=False, turnaround_s=TURNAROUND_S)
"""Settings for these flows: a laser fits in a PDU, bursts of 20 ms, blocks of 0.2 ms."""
_CONFIG = Config()
DEFAULTS = FOR_THESE._replace(
    max_burst_s=_CONFIG.modem.max_burst_s,
    classes=_CONFIG.classes,
    block_s=_CONFIG.modem.block_s,
    pdu_size=_CONFIG.link.pdu_size,
)
"""A daemon's defaults, except for sample rate and MCS, which make the channel the paper's."""


def table(air: Air, seed: int, quick: bool) -> dict[str, dict[str, Figures]]:
    """The figures of laser and image, by access policy; first what "auto" selects."""
    found = {}
    for policy in (AUTO, *POLICIES):
        laser, image = flows(1, EXACT, seed, quick)
        done = run([Sent(laser, 1, 2), Sent(image, 1, 2)], air._replace(policy=policy), seed)
        selected = done.simulation.stations[1].settled.policy
        found[f"auto_{selected}" if policy == AUTO else policy] = by_flow(done.traces)
    return found
