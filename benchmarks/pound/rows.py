"""All rows, with the paper's figures and those of the peers in the same run."""

import math
from collections.abc import Mapping

import numpy as np

from benchmarks.flows import Figures
from benchmarks.peers.pound.runs import Recovery
from benchmarks.pound import beside, cost, limits, loop, one_channel, tables
from benchmarks.pound.forecast import errors_pct
from benchmarks.pound.ours import PDU_SIZE, Air
from benchmarks.report import Row

SIZE_64KB = 65_536
# Pound's own rows in Tables I to IV.
POUND = {
    "laser_2n": Figures(20.0, 2.0, 4.1, 4.0, 99.8, 0.400),
    "image_2n": Figures(150.2, 2.9, 112.0, 1.9, 99.9, 3.417),
    "laser_3n": Figures(20.1, 1.7, 6.8, 1.4, 99.4, 0.398),
    "image_3n": Figures(300.7, 13.6, 294.2, 2.8, 99.8, 1.706),
}
POUND_MBPS = 5.1
TABLE_V_S = 1.31
SLACK_MS = 0.3

Beside = Mapping[str, Mapping[str, Figures]]


def two_nodes(seed: int, quick: bool, peers: Beside) -> list[Row]:
    """Tables I and II; the notes have the lasers with jitter and drift."""
    run = tables.two_nodes(seed, quick)
    ours = tables.by_flow(run.traces)
    others = []
    for case in tables.CASES:
        laser, image = tables.by_flow(tables.two_nodes(seed, quick, case).traces).values()
        others.append(
            f"{case.name}: laser D {laser.d_ms:.2f}, std {laser.std_d_ms:.2f}, std Jd "
            f"{laser.std_jd_ms:.2f}, image D {image.d_ms:.1f}"
        )
    laser, image = ours["laser"], ours["image"]
    n, m = len(run.traces[0].sent_at), len(run.traces[1].sent_at)
    return [
        _row("laser_2n_D_ms", laser.d_ms, 1.9, n, "laser_2n", "d_ms", peers,
             "; ".join([_rest(laser), *others])),
        _row("laser_2n_stdD_ms", laser.std_d_ms, 0.2, n, "laser_2n", "std_d_ms", peers),
        _row("laser_2n_stdJd_ms", laser.std_jd_ms, 0.3, n, "laser_2n", "std_jd_ms", peers),
        _row("image_2n_D_ms", image.d_ms, 101, m, "image_2n", "d_ms", peers, _rest(image)),
        _row("image_2n_stdD_ms", image.std_d_ms, 1, m, "image_2n", "std_d_ms", peers),
        _row("mdr_2n_laser_pct", laser.mdr_pct, 100, n, "laser_2n", "mdr_pct", peers),
        _row("mdr_2n_image_pct", image.mdr_pct, 100, m, "image_2n", "mdr_pct", peers),
    ]  # fmt: skip


def three_nodes(seed: int, quick: bool, peers: Beside) -> list[Row]:
    """Tables III and IV, with section VI-H in the notes."""
    run = tables.three_nodes(seed, quick)
    laser, image = tables.by_flow(run.traces).values()
    more = {
        "four nodes": tables.by_flow(tables.four_nodes(seed, quick).traces),
        "both ways": tables.by_flow(tables.opposing(seed, quick).traces),
    }
    note = "; ".join(
        f"{name}: "
        + ", ".join(f"{flow} D {f.d_ms:.1f} MDR {f.mdr_pct:.1f}" for flow, f in of.items())
        for name, of in more.items()
    )
    n, m = len(run.traces[0].sent_at), len(run.traces[1].sent_at)
    access = f"access minislot, turnaround 0.1 ms; {_rest(laser)}; {note}"
    return [
        _row("laser_3n_D_ms", laser.d_ms, 6.0, n, "laser_3n", "d_ms", peers, access),
        _row("laser_3n_stdD_ms", laser.std_d_ms, 1.2, n, "laser_3n", "std_d_ms", peers),
        _row("image_3n_D_ms", image.d_ms, 260, m, "image_3n", "d_ms", peers, _rest(image)),
        _row("image_3n_stdD_ms", image.std_d_ms, 5, m, "image_3n", "std_d_ms", peers),
        Row("mdr_3n_pct", min(laser.mdr_pct, image.mdr_pct), "%", 99.9, "more", n + m,
            {name: min(f.mdr_pct for f in of.values()) for name, of in peers.items()},
            POUND["laser_3n"].mdr_pct),
    ]  # fmt: skip


def bandwidth(seed: int, quick: bool, peers: Mapping[str, Mapping[int, float]]) -> list[Row]:
    """Fig. 19 at its largest messages; the other sizes are in the note."""
    seconds = 1.0 if quick else 10.0
    largest = {name: of[SIZE_64KB] for name, of in peers.items() if SIZE_64KB in of}
    found = {size: limits.bandwidth(size, seconds, seed) for size in limits.SIZES}
    note = ", ".join(f"{size // 1024} KB {mbps:.2f}" for size, mbps in found.items())
    return [
        Row("user_mbps_64KB_of_6.0", found[SIZE_64KB], "Mbit/s", 5.8, "more",
            int(seconds * 5.8e6 / 8 / SIZE_64KB),
            largest, POUND_MBPS, note)
    ]  # fmt: skip


def outage(seed: int, quick: bool, peers: Mapping[str, Recovery]) -> list[Row]:
    """How soon all is fresh after an outage of the sender, which has the air for itself."""
    found = limits.recovery(seed, quick)
    worst = max(found.images_s)
    fresh = {name: each.fresh_s for name, each in peers.items()}
    known = {name: seconds for name, seconds in fresh.items() if not math.isnan(seconds)}
    never = [name for name in peers if name not in known]
    note = f"never fresh again within 10 s: {', '.join(never)}" if never else ""
    return [
        Row("recovery_after_5s_outage_s", max(found.lasers_s), "s", 0.03, "less",
            len(found.lasers_s), known, TABLE_V_S, note),
        Row("recovery_after_5s_outage_image_s", float(np.mean(found.images_s)), "s", 0.35, "less",
            len(found.images_s), note=f"mean over phases; at worst {worst:.3f} s"),
    ]  # fmt: skip


def control_loop(seed: int, phases: list[float], peers: Mapping[str, float]) -> list[Row]:
    """The row of Fig. 21: a control loop beside other traffic."""
    airs = {policy: loop.TWO._replace(policy=policy) for policy in one_channel.POLICIES}
    airs["pdu_1058B"] = loop.TWO._replace(pdu_size=PDU_SIZE)

    def ours(air: Air) -> list[float]:
        return [
            loop.rms_vs_local_mv(phase, seed + i, beside.LOOP_S, air)
            for i, phase in enumerate(phases)
        ]

    found = {name: ours(air) for name, air in airs.items()}
    value = found.pop(loop.TWO.policy)
    fifo = [rms for name, rms in peers.items() if name in beside.FIFO]
    target = max(min(fifo) / 3, 1.0) if fifo else 1.0
    return [
        Row("rlc_rms_vs_local_mV", float(np.mean(value)), "mV", target, "less", len(phases),
            {name: float(np.mean(each)) for name, each in found.items()} | dict(peers),
            note=f"{loop.TWO.policy}, at worst {max(value):.3g} mV; perturbed by 64 KB every "
            "200 ms from the sender of y; 1 mV is a millisecond of delay")
    ]  # fmt: skip


def urgent(seed: int, quick: bool) -> list[Row]:
    """Latency of urgent messages while 10 MB of bulk wait."""
    ages, own_ms, burst_ms = limits.urgent_waits_ms(seed, quick)
    return [
        Row("urgent_p99_ms", float(np.quantile(ages, 0.99)), "ms", burst_ms + own_ms + SLACK_MS,
            "less", len(ages), {"own_airtime": own_ms, "max_burst": burst_ms},
            note=f"at worst {ages.max():.2f} ms")
    ]  # fmt: skip


def costs(seed: int, quick: bool) -> list[Row]:
    """The rows about the cost of scheduling decisions."""
    return cost.rows(seed, 5 if quick else 25)


def plan(seed: int, quick: bool) -> list[Row]:
    """The largest error of predicted against measured figures.

    The laser drifts past the camera: at a lucky fixed phase the worst case would never occur.
    """
    run = tables.two_nodes(seed, quick, tables.DRIFTING)
    errors = errors_pct(run, Air())
    worst = max(abs(error) for error in errors.values())
    note = ", ".join(f"{name} {error:+.1f} %" for name, error in errors.items())
    return [Row("plan_error_pct", worst, "%", 15, "less", len(errors), note=note)]


def _rest(of: Figures) -> str:
    """The other columns of the tables."""
    return f"Jd {of.jd_ms:.2f} ms, std {of.std_jd_ms:.2f}, {of.mbps:.3f} Mbit/s"


def _row(
    name: str, value: float, target: float, trials: int, table: str, column: str, peers: Beside,
    note: str = "",
) -> Row:  # fmt: skip
    flow = table.split("_")[0]
    known = {peer: getattr(of[flow], column) for peer, of in peers.items() if flow in of}
    known = {peer: value for peer, value in known.items() if not math.isnan(value)}
    is_share = column == "mdr_pct"
    return Row(
        name, value, "%" if is_share else "ms", target, "more" if is_share else "less", trials,
        known, getattr(POUND[table], column), note,
    )  # fmt: skip
