"""The rows on one half-duplex channel: Tables I, II and V, with ours by access policy."""

import math
from collections.abc import Iterator, Mapping
from statistics import mean

from benchmarks.flows import Figures
from benchmarks.peers.pound.runs import Recovery
from benchmarks.pound import one_channel
from benchmarks.pound.ours import Air
from benchmarks.pound.recovery import recoveries
from benchmarks.pound.tables import EXACT, flows
from benchmarks.report import Row
from benchmarks.team.rtwmp import FITTED, reconnection_s

Beside = Mapping[str, Mapping[str, Figures]]

# Pound's own figures: of Tables I and II, and of Table V, the later of two flows.
PAPER = {
    "laser": Figures(20.0, 2.0, 4.1, 4.0, 99.8, 0.400),
    "image": Figures(150.2, 2.9, 112.0, 1.9, 99.9, 3.417),
}
PAPER_V_S = {2: 1.31, 3: 1.53}
COLUMNS = {"D_ms": "d_ms", "stdD_ms": "std_d_ms", "Jd_ms": "jd_ms", "mdr_pct": "mdr_pct"}
TABLE_V_POLICY = {2: "minislot", 3: "grant"}
"""What "auto" selects here, and what the manual recommends over several hops."""


def two_nodes(seed: int, quick: bool, peers: Beside) -> Iterator[Row]:
    """Tables I and II, with settings for these flows and with a daemon's defaults."""
    yield from _tables("1ch", one_channel.FOR_THESE, seed, quick, peers)
    yield from _tables("1ch_defaults", one_channel.DEFAULTS, seed, quick, {})


def _tables(name: str, air: Air, seed: int, quick: bool, peers: Beside) -> Iterator[Row]:
    found = one_channel.table(air, seed, quick)
    auto = next(iter(found))
    for flow, paper in PAPER.items():
        of = found[auto][flow]
        note = f"{auto}; std of Jd {of.std_jd_ms:.2f} ms, {of.mbps:.3f} Mbit/s"
        for column, attribute in COLUMNS.items():
            ours = {policy: getattr(each[flow], attribute) for policy, each in found.items()}
            theirs = {peer: getattr(each[flow], attribute) for peer, each in peers.items()}
            value, target = ours.pop(auto), getattr(paper, attribute)
            is_share = column == "mdr_pct"
            yield Row(
                f"{flow}_{name}_{column}", value, "%" if is_share else "ms",
                # A longer mean period says the same as a lower delivery ratio.
                None if column == "Jd_ms" else target, "more" if is_share else "less",
                _n(flow, quick), _known(ours | theirs), target, note,
            )  # fmt: skip


def _n(flow: str, quick: bool) -> int:
    laser, image = flows(1, EXACT, 0, quick)
    return (laser if flow == "laser" else image).count


def outage(seed: int, quick: bool, peers: Mapping[int, Mapping[str, Recovery]]) -> Iterator[Row]:
    """Table V whole: the sender (2 nodes) or the relay (3 nodes) is off for 5 s."""
    for nodes, paper in PAPER_V_S.items():
        found = {policy: recoveries(nodes, policy, seed, quick) for policy in one_channel.POLICIES}
        own = TABLE_V_POLICY[nodes]
        worst = {
            policy: max(math.inf if math.isnan(each.new_s) else each.new_s for each in of)
            for policy, of in found.items()
        }
        rtwmp_s = reconnection_s(nodes, seed, 2 if quick else 20, FITTED)
        known = _known(
            {f"mean_{own}": mean(each.new_s for each in found[own])}
            | {policy: value for policy, value in worst.items() if policy != own}
            | {"rtwmp": max(rtwmp_s)}
            | {name: each.new_s for name, each in peers.get(nodes, {}).items()}
        )
        never = [name for name, each in peers.get(nodes, {}).items() if math.isnan(each.new_s)]
        fresh = [each.fresh_s for each in found[own] if not math.isnan(each.fresh_s)]
        note = (
            f"{own}, the worst of all trials and flows: from the radio's return until the first "
            "message that was sent since; messages then stay younger than 10 ms in "
            f"{len(fresh)} of {len(found[own])} flows, after {mean(fresh or [math.nan]):.3f} s; "
            "the paper's figure includes cards that rejoin their network"
        )
        if never:
            note += f"; never within 10 s: {', '.join(never)}"
        yield Row(
            f"table5_{nodes}n_s", worst[own], "s", paper, "less", len(found[own]), known, paper,
            note,
        )  # fmt: skip


def _known(values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if not math.isnan(value)}
