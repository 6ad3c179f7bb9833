"""Two daemons with radios like a USRP, both ways under full load."""

from pathlib import Path

from benchmarks.absent import PeerError
from benchmarks.loopback_radio import use_driver
from benchmarks.realtime.turns import Run
from benchmarks.usrp_like import under_load

RATE_HZ = 5e6
WARM_UP_S, SECONDS, QUICK_S = 2.0, 15.0, 4.0
HERE = Path(__file__).parents[2]


def full_load(tree: Path, seed: int, quick: bool) -> Run:
    """Samples lost by both, and the cores that both take, with all their processes."""
    if tree != HERE:
        raise PeerError("the test radio belongs to this checkout")
    use_driver()
    spans = under_load(RATE_HZ, WARM_UP_S, QUICK_S if quick else SECONDS, seed)
    lost = sum(span.count("samples_lost") for span in spans)
    parts = ("daemon", "radio_process")
    cores = sum(span.cpu_pct(part) for span in spans for part in parts) / 100
    heard, sent = (
        sum(span.link(*of) for span in spans) for of in (("rx", "pdus_heard"), ("tx", "pdus_sent"))
    )
    values = {"usrp_like_5msps_lost_samples": float(lost), "usrp_like_5msps_cores": cores}
    return Run(values, sent, f"{heard} PDUs heard of {sent}; both daemons, modems and radios")
